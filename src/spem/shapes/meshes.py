"""Triangle meshes to shapes: OBJ, OFF, PLY, STL and GLB files, or arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from spem.errors import ParameterError, ShapeError
from spem.shapes.components import keep_components
from spem.shapes.distance import signed_distance
from spem.shapes.fit import fit_spacing
from spem.shapes.grids import inner_distance, spacing_per_axis, voxel_count
from spem.shapes.limits import DEFAULT_VOXELS, check_size
from spem.shapes.mesh_files import load_mesh
from spem.shapes.shape import Report, Shape
from spem.shapes.surface import Surface, count_of, mend, merge_vertices
from spem.shapes.voxelize import lattice_around, voxelize
from spem.shapes.winding import fill_by_winding

# Winding range, mask, its crop and component labels for each node of the lattice; with holes also
# the winding numbers and the points they are asked at.
_BYTES_CLOSED, _BYTES_OPEN = 16, 96
# A budget or inner radius is met within this fraction where whole voxels allow it.
_TOLERANCE = 0.03
# More than this share of the volume is lost or won by a coarse grid only, or counted twice by the mesh.
_VOLUME_CHANGE = 0.1


def read_mesh(
    path: str | Path,
    *,
    voxels: int | None = None,
    spacing: float | tuple[float, ...] | None = None,
    inner_radius: float | None = None,
    components: Literal["largest", "all"] = "largest",
    memory_limit: int | None = None,
    name: str | None = None,
) -> Shape:
    """Read a mesh file and fill it.

    Polygons are cut into triangles, and the parts of a scene are put in their places. The rest is
    `mesh_shape`.

    Parameters
    ----------
    path
        OBJ, OFF, PLY, STL or GLB.
    voxels, spacing, inner_radius, components, memory_limit
        As in `mesh_shape`.
    name
        Short name; the file's by default.

    Returns
    -------
    Shape
        In the coordinates of the file, axis 0 is x.

    Raises
    ------
    ReadError
        When the file is missing, empty, truncated or of another kind.
    ShapeError, SizeError, ParameterError
        As `mesh_shape`.

    Examples
    --------
    >>> import tempfile, trimesh
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = Path(folder.name) / "box.off"
    >>> _ = path.write_bytes(trimesh.creation.box((3, 4, 5)).export(file_type="off").encode())
    >>> read_mesh(path, spacing=1.0)
    Shape('box', 3-D, 60 nodes, grid 5 x 6 x 7, spacing 1 x 1 x 1)
    >>> folder.cleanup()
    """
    path = Path(path)
    vertices, faces = load_mesh(path)
    return mesh_shape(
        vertices,
        faces,
        voxels=voxels,
        spacing=spacing,
        inner_radius=inner_radius,
        components=components,
        memory_limit=memory_limit,
        name=path.stem if name is None else name,
        source=str(path),
    )


def mesh_shape(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    voxels: int | None = None,
    spacing: float | tuple[float, ...] | None = None,
    inner_radius: float | None = None,
    components: Literal["largest", "all"] = "largest",
    memory_limit: int | None = None,
    name: str = "mesh",
    source: str = "mesh_shape",
) -> Shape:
    """Fill a triangle mesh on a grid centred on its bounding box.

    Overlapping parts are a union, a part turned the other way inside a larger one is a hollow.
    A mesh with holes is filled by its generalised winding number. What was repaired is reported.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates x y z.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside.
    voxels
        Number of nodes wanted, 15,000 if no size is given. At most one of `voxels`, `spacing`
        and `inner_radius` may be.
    spacing
        Distance between voxel centres, for all axes or one each, in the unit of the mesh.
    inner_radius
        Distance from the deepest node to the surface, in voxels, at least 1. This or the number of nodes
        is met within 3 % where whole voxels allow it, else the report says what it is.
    components
        "largest" keeps the largest connected component, "all" keeps all.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Short name.
    source
        Where the mesh came from, for the report.

    Returns
    -------
    Shape
        With the exact cut of every edge that the surface crosses.

    Raises
    ------
    ShapeError
        When the mesh encloses no volume or no node lies inside; the message names a spacing that
        would do.
    SizeError
        When the grid would pass the memory limit; nothing is allocated.
    ParameterError
        When an argument is out of range.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(3)
    >>> shape = mesh_shape(ball.vertices, ball.faces, spacing=0.1, name="ball")
    >>> shape, shape.report.method
    (Shape('ball', 3-D, 4224 nodes, grid 22 x 22 x 22, spacing 0.1 x 0.1 x 0.1), 'scanline filling')
    """
    if sum(size is not None for size in (voxels, spacing, inner_radius)) > 1:
        msg = f"{name}: voxels, spacing and inner_radius were given together; give one of them"
        raise ParameterError(msg)
    filler = _filler(vertices, faces, components, memory_limit, name, source)
    if spacing is not None:
        x, y, z = spacing_per_axis(spacing, 3, name)
        return filler.at((x, y, z))
    if inner_radius is not None:
        return _to_inner_radius(filler, inner_distance(inner_radius, name))
    return _to_budget(filler, voxel_count(DEFAULT_VOXELS if voxels is None else voxels, name))


@dataclass(frozen=True, eq=False)
class _Filler:
    """A mended surface, to be filled at any spacing."""

    surface: Surface
    report: Report
    components: Literal["largest", "all"]
    memory_limit: int | None
    name: str

    def isotropic(self, step: float) -> Shape:
        """Fill with one spacing on all axes."""
        return self.at((step, step, step))

    def at(self, steps: tuple[float, float, float]) -> Shape:
        """Fill on the grid of the given spacing that is centred on the bounding box."""
        surface = self.surface
        lattice = lattice_around(surface.vertices, steps)
        check_size(
            lattice.shape, _BYTES_CLOSED if surface.closed else _BYTES_OPEN, self.memory_limit, self.name
        )
        if surface.closed:
            filling = voxelize(surface.vertices, surface.faces, lattice)
        else:
            filling = fill_by_winding(surface, lattice)
        if not filling.mask.any():
            # A ball of this radius fits into any convex solid, and one of half the diagonal of a
            # voxel holds a node wherever it lies.
            enough = 2 * surface.volume / surface.area / math.sqrt(3)
            text = " x ".join(f"{h:.4g}" for h in steps)
            msg = (
                f"{self.name}: thinner than the grid, spacing {text} leaves no voxel centre inside; "
                f"a spacing of {enough:.3g} or finer would do"
            )
            raise ShapeError(msg)
        report = self.report
        if filling.n_reversed:
            report = report.with_repair(
                f"left out {count_of(filling.n_reversed, 'voxel')} wound around backwards"
            )
        shape = Shape.from_mask(
            filling.mask,
            steps,
            origin=lattice.origin,
            name=self.name,
            cuts=filling.cuts,
            report=report,
            surface=surface,
        )
        off = shape.volume / surface.volume - 1
        if surface.closed and abs(off) > _VOLUME_CHANGE:
            phrase = f"volume {100 * off:+.0f} % off the mesh's: the grid is coarse, or parts overlap"
            shape = replace(shape, report=report.with_repair(phrase))
        return keep_components(shape, self.components)


def _filler(
    vertices: ArrayLike,
    faces: ArrayLike,
    components: Literal["largest", "all"],
    memory_limit: int | None,
    name: str,
    source: str,
) -> _Filler:
    """Check a mesh, mend it and say in a report what it is."""
    surface = _checked(vertices, faces, name)
    if not surface.closed:
        surface = merge_vertices(surface)
    watertight = surface.closed
    surface = mend(surface)
    if surface.flat:
        msg = f"{name}: the mesh encloses no volume; a solid's closed surface is needed"
        raise ShapeError(msg)
    method, repairs = "scanline filling", surface.repairs
    if not surface.closed:
        method = "generalised winding number"
        edges, loops = count_of(len(surface.open_edges), "open edge"), count_of(surface.n_loops, "loop")
        repairs += (f"filled over {edges} in {loops}",)
    report = Report(source=source, method=method, watertight=watertight, repairs=repairs)
    return _Filler(surface, report, components, memory_limit, name)


def _to_budget(filler: _Filler, voxels: int) -> Shape:
    """Fill at the spacing that gives the number of nodes; overlaps and dropped parts take a few rounds."""
    return fit_spacing(
        filler.isotropic,
        (filler.surface.volume / voxels) ** (1 / 3),
        lambda shape: shape.n_nodes,
        voxels,
        power=3,
        tolerance=_TOLERANCE,
        what="voxels",
    )


def _to_inner_radius(filler: _Filler, radius: float) -> Shape:
    """Fill at the spacing that puts the deepest node the given number of voxels from the surface."""
    return fit_spacing(
        filler.isotropic,
        float(signed_distance(_to_budget(filler, DEFAULT_VOXELS)).max()) / radius,
        lambda shape: float(signed_distance(shape).max()) / shape.spacing[0],
        radius,
        power=1,
        tolerance=_TOLERANCE,
        what="voxels of inner distance",
    )


def _checked(vertices: ArrayLike, faces: ArrayLike, name: str) -> Surface:
    """Return the mesh as a surface, or say what is wrong with its arrays."""
    points, triangles = np.array(vertices, np.float64), np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        msg = f"{name}: expected vertices (n, 3) and faces (m, 3), got {points.shape} and {triangles.shape}"
        raise ParameterError(msg)
    if not len(triangles):
        msg = f"{name}: the mesh has no faces; a solid's closed surface is needed"
        raise ShapeError(msg)
    if triangles.dtype.kind not in "iu" or triangles.min() < 0 or triangles.max() >= len(points):
        msg = f"{name}: faces must hold whole numbers from 0 to {len(points) - 1}, the last vertex"
        raise ShapeError(msg)
    triangles = triangles.astype(np.int64)
    if not np.isfinite(points[triangles]).all():
        msg = f"{name}: some vertices are not finite; expected coordinates x y z"
        raise ShapeError(msg)
    used = np.zeros(len(points), bool)
    used[triangles] = True
    return Surface(points[used], (np.cumsum(used) - 1)[triangles])
