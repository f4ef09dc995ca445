"""The surface of a solid as a PLY file: maps, a field or parts at its vertices, in numbers and colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from spem.errors import ParameterError, ShapeError
from spem.fields.rho import single_rho
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.raster import vertex_normals
from spem.plots.style import FIELD_CMAP, MAP_CMAP, part_colours
from spem.plots.surfaces import SAMPLE_DEPTH
from spem.server.views.division import divide
from spem.server.views.field import N_MAPS, shown_maps
from spem.server.views.options import Options, shown_shape, whole_option
from spem.server.views.outline import Mesh, mesh_of
from spem.shapes.shape import Shape


@dataclass(frozen=True, eq=False)
class _Values:
    """What the vertices carry: numbers by name, a colour each, and a word on what the colours show."""

    columns: dict[str, NDArray[np.float64]]
    colours: NDArray[np.float64]
    caption: str


def surface_file(shape: Shape, options: Options) -> bytes:
    r"""Return the surface of a solid as a binary PLY file.

    Vertices are those of the view of the geometry, in the shape's own coordinates. Their values are those one
    voxel below them, as properties of floats that viewers of meshes can colour by; their part is that of the
    nearest node.

    Parameters
    ----------
    shape
        A shape of three dimensions.
    options
        ``show``: ``"map"`` (default), with all maps as properties and colours by number ``map``, from 1;
        ``"field"``, at ``rho`` in the unit of the spacing, the middle of the default range where it is
        absent; or ``"part"``, of ``k`` parts. ``max_nodes``, as for the view of the geometry.

    Raises
    ------
    ShapeError
        When the shape is not of three dimensions.
    ParameterError
        When an option is out of its range.

    Examples
    --------
    >>> content = surface_file(Shape.from_mask(np.ones((3, 3, 3))), {"show": "field"})
    >>> content.splitlines()[2].decode()
    'comment colours: field at rho 0.4215'
    """
    if shape.ndim != 3:
        msg = f"{shape.name}: a surface is of shapes of 3 dimensions, this one has {shape.ndim}"
        raise ShapeError(msg)
    kinds = {"map": _maps, "field": _field, "part": _parts}
    show = options.get("show", "map")
    if show not in kinds:
        msg = f"show={show!r}: expected one of {', '.join(kinds)}"
        raise ParameterError(msg)
    shown = shown_shape(shape, options)
    mesh = mesh_of(shown)
    return _ply(shown, mesh, kinds[show](shape, options, mesh))


def vertex_values(shape: Shape, mesh: Mesh, values: ArrayLike) -> NDArray[np.float64]:
    """Interpolate values of nodes one voxel below the vertices of a mesh.

    The node nearest to a vertex may be anywhere in the first voxel, and fields fall fast there.

    Parameters
    ----------
    shape
        The shape.
    mesh
        Its mesh, as `mesh_of` makes it.
    values
        ``(n_nodes, k)`` values.

    Returns
    -------
    numpy.ndarray
        ``(v, k)``.

    Examples
    --------
    >>> cube = Shape.from_mask(np.ones((5, 5, 5)))
    >>> mesh = mesh_of(cube)
    >>> below = vertex_values(cube, mesh, cube.points)
    >>> bool(np.ptp(below) < np.ptp(mesh.position))
    True
    """
    step = min(shape.spacing) / np.asarray(shape.spacing)
    normals = vertex_normals(mesh.position * np.asarray(shape.spacing), mesh.faces)
    places = (mesh.position - SAMPLE_DEPTH * step * normals).T
    level = surface_level(shape)
    columns = np.asarray(values, np.float64).T
    grids = (extend_values(shape, column, level) for column in columns)
    return np.stack([map_coordinates(grid, places, order=1, mode="nearest") for grid in grids], axis=1)


def _maps(shape: Shape, options: Options, mesh: Mesh) -> _Values:
    """Return all maps, coloured by one of them."""
    number = whole_option(options, "map", 1, 1, N_MAPS)
    _, maps = shown_maps(shape, options)
    values = vertex_values(maps.shape, mesh, maps.values)
    limit = float(np.abs(values[:, number - 1]).max()) or 1.0
    colours = colormaps[MAP_CMAP](0.5 + values[:, number - 1] / (2 * limit))[:, :3]
    columns = {f"map_{j + 1}": column for j, column in enumerate(values.T)}
    return _Values(columns, colours, f"map {number}, red to blue from {limit:.4g} to {-limit:.4g}")


def _field(shape: Shape, options: Options, mesh: Mesh) -> _Values:
    """Return the field at one ρ."""
    field, _ = shown_maps(shape, options, 1)
    length = options.get("rho")
    rho = float(np.median(field.rho)) if length is None else single_rho(length)
    values = vertex_values(field.shape, mesh, field.at([rho]))[:, 0]
    return _Values({"v": values}, colormaps[FIELD_CMAP](values)[:, :3], f"field at rho {rho:.4g}")


def _parts(shape: Shape, options: Options, mesh: Mesh) -> _Values:
    """Return the part of each vertex."""
    labels = divide(shape, options).labels[mesh.node]
    return _Values({"part": labels.astype(np.float64)}, part_colours(labels), "parts, -1 for none")


def _ply(shape: Shape, mesh: Mesh, values: _Values) -> bytes:
    """Return a mesh with values and colours as a binary PLY file."""
    named = [(name, "<f4") for name in values.columns]
    vertex = np.empty(len(mesh.position), [("at", "<f8", 3), *named, ("colour", "u1", 3)])
    vertex["at"] = np.asarray(shape.origin) + mesh.position * np.asarray(shape.spacing)
    for name, column in values.columns.items():
        vertex[name] = column
    vertex["colour"] = np.rint(255 * values.colours)
    face = np.empty(len(mesh.faces), [("count", "u1"), ("vertices", "<i4", 3)])
    face["count"], face["vertices"] = 3, mesh.faces
    properties = [f"double {axis}" for axis in "xyz"] + [f"float {name}" for name in values.columns]
    properties += [f"uchar {colour}" for colour in ("red", "green", "blue")]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment colours: {values.caption}",
        f"element vertex {len(vertex)}",
        *(f"property {one}" for one in properties),
        f"element face {len(face)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return "\n".join(header).encode("ascii") + vertex.tobytes() + face.tobytes()
