"""Parts of shapes, each in its colour: the same label has the same colour in all shapes of a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from spem.errors import ParameterError
from spem.plots.camera import picture_aspect
from spem.plots.layout import colour_key, panels
from spem.plots.part_pictures import draw_parts
from spem.plots.style import INK, TITLE_SIZE, part_colours
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from spem.decomposition.parts import Parts
    from spem.plots.camera import View
    from spem.plots.part_surface import Mesh

# As wide as a digit.
FIGURE_SPACE = "\N{FIGURE SPACE}"


def figure_parts(
    parts: Parts | Sequence[Parts],
    titles: Sequence[str] | None = None,
    *,
    boundary: bool = True,
    view: View | None = None,
    meshes: Sequence[Mesh | None] | None = None,
    columns: int = 5,
    width: float | None = None,
) -> Figure:
    """Return a figure with a panel for the parts of each shape and one key to the colours.

    Parameters
    ----------
    parts
        Parts of one shape or of several; matched ones have the same label in all.
    titles
        One title a shape; the names of the shapes by default, of a single one none.
    boundary, view
        As in `spem.plots.part_pictures.draw_parts`.
    meshes
        Of three-dimensional shapes, the vertices and faces that each was made of, to be coloured in place
        of the surface of its voxels; None where there are none.
    columns
        Most panels in a row.
    width
        Most width of a panel, in inches; by default the more, the fewer stand in a row.

    Raises
    ------
    ShapeError
        If a shape has more than three dimensions.
    ParameterError
        If there are no parts, or titles or meshes do not match them in number.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.shapes.shape import Shape
    >>> cube = Shape.from_mask(np.ones((4, 4, 4)))
    >>> toy = SimpleNamespace(shape=cube, node_labels=np.arange(64) // 32)
    >>> [text.get_text() for text in figure_parts(toy).legends[0].get_texts()]
    ['0  \u200750 %', '1  \u200750 %']
    """
    several = list(parts) if isinstance(parts, Sequence) else [parts]
    _check(several, titles, meshes)
    names = titles or ([part.shape.name for part in several] if len(several) > 1 else None)
    labels = np.unique(np.concatenate([part.node_labels for part in several]))
    labels = np.append(labels[labels >= 0], labels[labels < 0][:1])
    aspect = max(picture_aspect(part.shape, view) for part in several)
    words = _words(labels, several)
    figure, axes = panels(
        len(several), columns=columns, aspect=aspect, width=width, titled=names is not None, key=words
    )
    for i, (part, ax) in enumerate(zip(several, axes, strict=True)):
        draw_parts(part, ax, boundary=boundary, view=view, mesh=meshes[i] if meshes else None)
        _fill_panel(ax)
        title = ax.set_title(names[i] if names else "", fontsize=TITLE_SIZE, color=INK, pad=4)
        title.set_parse_math(titles is not None)  # names are file names
    colour_key(figure, part_colours(labels), words)
    return figure


def _fill_panel(ax: Axes) -> None:
    """Widen the limits of a picture to those of its panel, so that titles in a row stand level."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    tall = (ax.bbox.height / ax.bbox.width) / abs((top - bottom) / (right - left))
    more_x, more_y = (right - left) * max(0.0, 1 / tall - 1) / 2, (top - bottom) * max(0.0, tall - 1) / 2
    ax.set(xlim=(left - more_x, right + more_x), ylim=(bottom - more_y, top + more_y))


def _words(labels: NDArray[np.int32], several: Sequence[Parts]) -> list[str]:
    """Each label, of a single shape with its share of the nodes."""
    names = [str(label) if label >= 0 else "none" for label in labels]
    if len(several) > 1:
        return names
    share = [100 * float(np.mean(several[0].node_labels == label)) for label in labels]
    # Figure spaces keep the percentages in a column.
    return [
        f"{name}  {f'{part:.0f}'.rjust(3, FIGURE_SPACE)} %" for name, part in zip(names, share, strict=True)
    ]


def _check(
    several: Sequence[Parts], titles: Sequence[str] | None, meshes: Sequence[Mesh | None] | None
) -> None:
    """Raise unless there is something to draw, with as many titles and meshes."""
    n = len(several)
    if n == 0:
        msg = "nothing to draw: give the parts of at least one shape"
        raise ParameterError(msg)
    for what, given in (("titles", titles), ("meshes", meshes)):
        if given is not None and len(given) != n:
            msg = f"{n} shapes need as many {what}, not {len(given)}"
            raise ParameterError(msg)
    for parts in several:
        require_drawable(parts.shape)
