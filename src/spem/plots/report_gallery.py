"""The shapes of a report: their pictures, each embedded once, and the gallery of all classes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from spem.plots.markup import data_uri, natural, section, text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# The gallery shows every shape of small collections and a sample of large ones.
GALLERY_SHAPES = 200


@dataclass(frozen=True, eq=False)
class Gallery:
    """The shapes of a collection as a report shows them; each picture is embedded once.

    Parameters
    ----------
    names
        A name for each shape.
    labels
        A class for each shape, or None.
    thumbnails
        A PNG file, an ``(h, w, 4)`` array of bytes or None for each shape.
    shown
        Numbers of the shapes shown so far.
    """

    names: Sequence[str]
    labels: Sequence[str] | None
    thumbnails: Sequence[bytes | NDArray[np.uint8] | None]
    shown: set[int] = field(default_factory=set)

    def tile(self, i: int, mark: str = "") -> str:
        """Return a shape's picture and name; `mark` is what is said of it as an answer.

        Examples
        --------
        >>> Gallery(["<a>"], None, [None]).tile(0).count("&lt;a&gt;")
        2
        """
        name = text(self.names[i])
        if self.thumbnails[i] is None:
            picture = (
                f'<svg class="thumb" role="img" aria-label="{name}: no picture" viewBox="0 0 96 96"></svg>'
            )
        else:
            self.shown.add(i)
            picture = (
                f'<svg class="thumb" role="img" aria-label="{name}" viewBox="0 0 96 96">'
                f'<use href="#shape-{i}"/></svg>'
            )
        return f"<figure>{picture}<figcaption>{mark}{name}</figcaption></figure>"

    def symbols(self) -> str:
        """Return the pictures of all shapes shown so far, for the tiles to refer to.

        Examples
        --------
        >>> gallery = Gallery(["a"], None, [np.zeros((1, 1, 4), np.uint8)])
        >>> tile = gallery.tile(0)
        >>> gallery.symbols().count("<image")
        1
        """
        images = []
        for i in sorted(self.shown):
            picture = self.thumbnails[i]
            if picture is not None:
                images.append(f'<image id="shape-{i}" width="96" height="96" href="{data_uri(picture)}"/>\n')
        return f'<svg class="store" aria-hidden="true"><defs>\n{"".join(images)}</defs></svg>\n'


def shapes_section(gallery: Gallery) -> str:
    """Return the shapes, class by class; of large collections the first of each class.

    Examples
    --------
    >>> shapes_section(Gallery(["a"], ["letter"], [None])).count("<details")
    1
    """
    n = len(gallery.names)
    labels = ["all"] * n if gallery.labels is None else list(gallery.labels)
    members: dict[str, list[int]] = {}
    for i, label in enumerate(labels):
        members.setdefault(label, []).append(i)
    most = n if n <= GALLERY_SHAPES else max(1, GALLERY_SHAPES // max(1, len(members)))
    groups = []
    for label in sorted(members, key=natural)[:GALLERY_SHAPES]:
        chosen = members[label][:most]
        rest = len(members[label]) - len(chosen)
        more = f'<p class="note">and {rest} more</p>' if rest else ""
        tiles = "".join(gallery.tile(i) for i in chosen)
        groups.append(
            f"<details open><summary>{text(label)} <small>{len(members[label])}</small></summary>"
            f'<div class="tiles">{tiles}</div>{more}</details>\n'
        )
    return section("Shapes", "".join(groups))
