"""Parts of three-dimensional shapes to turn and to look at, in a single HTML file without a network."""

from __future__ import annotations

import json
from base64 import b64encode
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_hex

from spem.errors import ParameterError, ShapeError
from spem.files import write_whole
from spem.plots.camera import picture_size, principal_view, view_rotation
from spem.plots.markup import data_uri, page, text
from spem.plots.part_surface import part_surface
from spem.plots.raster import AMBIENT, FILL_LIGHT, KEY_LIGHT, render_surface
from spem.plots.style import part_colours

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    from numpy.typing import NDArray

    from spem.decomposition.parts import Parts
    from spem.plots.camera import View
    from spem.plots.part_surface import Mesh, PartSurface
    from spem.shapes.shape import Shape

# Parts are told apart by one byte of a pixel.
MOST_PARTS = 256
# Coordinates are numbers from 0 to this, along the longest side of a shape.
FINEST = 65535
# Width of the pictures shown where the page cannot draw, in pixels.
STILL = 480


def write_parts_page(
    path: str | PathLike[str],
    parts: Sequence[Parts],
    *,
    title: str = "Parts",
    meshes: Sequence[Mesh | None] | None = None,
    view: View | None = None,
) -> Path:
    """Write a page on which parts of shapes can be turned, zoomed, named, hidden and shown.

    The page is one file: no other is read, no address is called. Where WebGL is missing it shows pictures.

    Parameters
    ----------
    path
        File to write; an existing one is replaced at the end, in one step.
    parts
        Parts of three-dimensional shapes, side by side; matched ones have the same label in all.
    title
        Heading of the page.
    meshes
        Vertices and faces that each shape was made of, to be coloured in place of the surface of its
        voxels; None where there are none.
    view
        First view of all shapes: elevation and azimuth, or a rotation; of each, its broad side by default.

    Returns
    -------
    path
        The file written.

    Raises
    ------
    ShapeError
        If a shape is not three-dimensional.
    ParameterError
        If there are no parts or too many, meshes do not match them in number, or the file cannot be
        written.

    Examples
    --------
    >>> import tempfile
    >>> from types import SimpleNamespace
    >>> from spem.shapes.shape import Shape
    >>> cube = Shape.from_mask(np.ones((3, 3, 3)), name="cube")
    >>> toy = SimpleNamespace(shape=cube, node_labels=np.arange(27) // 9)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_parts_page(f"{folder}/a.html", [toy])
    ...     file.read_text(encoding="utf-8").count("<figcaption>cube")
    1
    """
    several = list(parts)
    labels = _labels(several)
    given = [None] * len(several) if meshes is None else list(meshes)
    if len(given) != len(several):
        msg = f"{len(several)} shapes need as many meshes, not {len(given)}"
        raise ParameterError(msg)
    scenes, stills = [], []
    for part, mesh in zip(several, given, strict=True):
        rotation = principal_view(part.shape.points) if view is None else view_rotation(view)
        surface = part_surface(part.shape, part.node_labels, mesh=mesh)
        scenes.append(_scene(part.shape.name, surface, labels, rotation))
        stills.append(_still(part.shape, surface, rotation))
    lights = [[*(d / np.linalg.norm(d)), s] for d, s in (KEY_LIGHT, FILL_LIGHT)]
    colours = np.rint(255 * part_colours(labels)).astype(int)
    data = {"shapes": scenes, "colours": colours.tolist(), "lights": lights, "ambient": AMBIENT}
    body = _body(several, labels, stills, json.dumps(data, separators=(",", ":")))
    whole = page(title, _summary(several, labels), body, style="parts_page.css", script="parts_page.js")
    target = Path(path)
    write_whole(target, lambda file: file.write(whole.encode("utf-8", "replace")))
    return target


def _labels(several: Sequence[Parts]) -> NDArray[np.int32]:
    """Labels that occur, ascending, with -1 at the end."""
    if not several:
        msg = "nothing to show: give the parts of at least one shape"
        raise ParameterError(msg)
    for part in several:
        if part.shape.ndim != 3:
            msg = f"{part.shape.name}: a page shows parts of shapes of 3 dimensions, this one has"
            msg += f" {part.shape.ndim}; draw it with figure_parts"
            raise ShapeError(msg)
    labels = np.unique(np.concatenate([np.asarray(part.node_labels, np.int32) for part in several]))
    if labels.size > MOST_PARTS:
        msg = f"a page shows up to {MOST_PARTS} parts, not {labels.size}"
        raise ParameterError(msg)
    return np.append(labels[labels >= 0], labels[labels < 0][:1])


def _scene(
    name: str, surface: PartSurface, labels: NDArray[np.int32], rotation: NDArray[np.float64]
) -> dict[str, object]:
    """Return what the script draws of one shape: arrays in base 64, in the byte order of all browsers."""
    apart, label = surface.separated()
    number = {int(value): i for i, value in enumerate(labels)}
    low, high = apart.vertices.min(axis=0), apart.vertices.max(axis=0)
    longest = float(np.max(high - low))
    place = np.zeros((len(label), 4), "<u2")
    place[:, :3] = np.rint((apart.vertices - low) * (FINEST / longest))
    place[:, 3] = [number[int(value)] for value in label]
    normal = np.zeros((len(label), 4), np.int8)
    normal[:, :3] = np.rint(127 * apart.normals)
    turned = (apart.vertices - (low + high) / 2) @ rotation.T / longest
    return {
        "name": name,
        "places": _base64(place),
        "normals": _base64(normal),
        "faces": _base64(apart.faces.astype("<u4")),
        "middle": ((high - low) / (2 * longest)).tolist(),
        "rotation": rotation.ravel().tolist(),
        "reach": np.abs(turned).max(axis=0).tolist(),
        "radius": float(np.linalg.norm(turned, axis=1).max()),
    }


def _still(shape: Shape, surface: PartSurface, rotation: NDArray[np.float64]) -> str:
    """Figure of one shape for where the page cannot draw, with its name."""
    size = picture_size(shape, STILL, rotation)
    picture = render_surface(
        surface.vertices,
        surface.faces,
        view=rotation,
        size=size,
        face_colours=part_colours(surface.face_labels),
    )
    name = text(shape.name)
    image = f'<img src="{data_uri(picture)}" alt="{name}, coloured by part">'
    return f"<figure>{image}<figcaption>{name}</figcaption></figure>"


def _body(several: Sequence[Parts], labels: NDArray[np.int32], stills: Sequence[str], data: str) -> str:
    """Pictures, canvas, key and data of the page."""
    template = files("spem.plots").joinpath("parts_page.html").read_text(encoding="utf-8")
    return Template(template).substitute(
        stills="\n".join(stills),
        names=text(", ".join(part.shape.name for part in several)),
        boxes="\n".join(_box(i, int(label), several) for i, label in enumerate(labels)),
        # In a script element, </script would end the data and <!--<script hide their end.
        data=data.replace("<", "\\u003c"),
    )


def _box(i: int, label: int, several: Sequence[Parts]) -> str:
    """Check box of a part, with its share of a single shape."""
    name = f"part {label}" if label >= 0 else "no part"
    share = ""
    if len(several) == 1:
        share = f"<small>{100 * float(np.mean(several[0].node_labels == label)):.0f} %</small>"
    colour = to_hex(part_colours([label])[0])
    swatch = f'<span class="swatch" style="background:{colour}"></span>'
    inside = f'<input type="checkbox" checked>{swatch}<span class="name">{name}</span>{share}'
    return f'<li><label data-part="{i}">{inside}</label></li>'


def _summary(several: Sequence[Parts], labels: NDArray[np.int32]) -> str:
    """How many shapes, and of how many parts."""
    n_parts, n = int((labels >= 0).sum()), len(several)
    shapes = text(several[0].shape.name) if n == 1 else f"{n} shapes"
    return f"{shapes} in {n_parts} part{'' if n_parts == 1 else 's'}"


def _base64(array: NDArray[np.generic]) -> str:
    """Bytes of an array in base 64."""
    return b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
