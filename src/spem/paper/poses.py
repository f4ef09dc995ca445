"""Poses of one body with points that correspond: real meshes whose vertices do, or creatures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import KDTree

from spem.decomposition.transfer import sample_points
from spem.fields.hyperfield import Hyperfield
from spem.paper.data import Data
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.shapes.distance import signed_distance
from spem.shapes.landmarks import creature_poses
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface

# Collection: what it holds, file at rest, the other files.
_MESHES = {
    "horse_poses": ("horse", "reference.obj", "[0-9]*.obj"),
    "tosca_cats": ("cat", "cat0.off", "cat[1-9]*.off"),
}
COLLECTIONS = tuple(_MESHES)
VOXELS, QUICK_VOXELS, QUICK_POSES = 15_000, 1_500, 3
FINER = 1.4
_SEED = 0
# Vertices whose motion carries a point, and the power of their distance that weighs them less and less.
_AROUND, _POWER = 300, 4


@dataclass(frozen=True, eq=False)
class Poses:
    """One body in several poses.

    Parameters
    ----------
    name
        What it is: ``"horse"``, ``"cat"``, or a creature.
    collection
        The collection it is from; empty for a creature.
    source
        One sentence for the page.
    shapes
        A shape each.
    finer
        The first pose again, on a grid of `FINER` times as many voxels.
    inside
        ``(n_poses, n_inside, d)`` corresponding points spread over the volume.
    marks
        ``(n_poses, n_marks, d)`` corresponding points just below the surface; for creatures those inside.
    mirror
        ``(n_marks,)`` number of the mark on the other side of the body.
    """

    name: str
    collection: str
    source: str
    shapes: tuple[Shape, ...]
    finer: Shape
    inside: NDArray[np.float64]
    marks: NDArray[np.float64]
    mirror: NDArray[np.int64]

    @property
    def nodes(self) -> NDArray[np.int64]:
        """``(n_poses, n_marks)`` node nearest to each mark."""
        return np.stack([nearest_nodes(s, x) for s, x in zip(self.shapes, self.marks, strict=True)])


def nearest_nodes(shape: Shape, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the node nearest to each point.

    Examples
    --------
    >>> nearest_nodes(Shape.from_mask([1, 1, 1]), np.array([[0.2], [1.9]])).tolist()
    [0, 2]
    """
    return np.asarray(KDTree(shape.points).query(points)[1], np.int64)


def fields_at(field: Hyperfield, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the sampled fields at points of their shape, interpolated up to the surface, where they are 1.

    Returns
    -------
    fields
        ``(n_points, n_rho)``.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> field = spem.sweep(disk, rho=[2, 4])
    >>> bool(np.allclose(fields_at(field, disk.points), field.fields(), atol=1e-6))
    True
    """
    shape, coefficients = field.shape, field.coefficients()
    level = surface_level(shape)
    index = ((points - np.asarray(shape.origin)) / np.asarray(shape.spacing)).T
    # The columns make the deficit 1 - v, which is 0 on the surface.
    grids = (extend_values(shape, column, level, boundary=0.0) for column in field.basis.T)
    at = np.stack([map_coordinates(grid, index, order=1, mode="nearest") for grid in grids], axis=1)
    return np.asarray(coefficients[0] + at @ coefficients[1:])


def depth_at(shape: Shape, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of points of a shape to its surface.

    Examples
    --------
    >>> depth_at(Shape.from_mask([1, 1, 1]), np.array([[0.0], [1.0]])).tolist()
    [0.5, 1.5]
    """
    index = ((points - np.asarray(shape.origin)) / np.asarray(shape.spacing)).T
    return np.asarray(map_coordinates(signed_distance(shape), index, order=1, mode="nearest"))


def load_poses(data: Data, *, n_inside: int = 1500, n_marks: int = 400) -> list[Poses]:
    """Return the sets of poses that are there, or one creature where there is none.

    Parameters
    ----------
    data
        Where real shapes are, and the size of the experiment: a quick one takes three poses of a set.
    n_inside, n_marks
        Numbers of corresponding points; `n_marks` is even.

    Examples
    --------
    >>> [poses] = load_poses(Data(quick=True), n_inside=40, n_marks=20)
    >>> poses.name, len(poses.shapes), poses.nodes.shape
    ('human', 3, (3, 20))
    """
    rng = np.random.default_rng(_SEED)
    found = [
        _mesh_poses(name, folder, data.quick, n_inside, n_marks, rng)
        for name in COLLECTIONS
        if (folder := data.find(name)) is not None
    ]
    return found or [_creature(data.quick, max(n_inside, n_marks), n_marks, rng)]


def absences(data: Data, sets: Sequence[Poses]) -> str:
    """Say which of the real sets are absent, for the note of a claim; nothing where all are there.

    Examples
    --------
    >>> absences(Data(), [])[:31]
    'no folder of shapes was given; '
    """
    there = {poses.collection for poses in sets}
    return "; ".join(data.absent(name) for name in COLLECTIONS if name not in there)


def carried(
    points: NDArray[np.float64],
    vertices: NDArray[np.float64],
    moved: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Carry points by the motion of the vertices around them, as rigidly as possible.

    Each point moves with the rotation and translation that fit its nearest vertices best, weighted by the
    area they stand for over the fourth power of their distance (moving least squares).

    Parameters
    ----------
    points
        ``(n, d)`` in the pose of `vertices`.
    vertices, moved
        ``(m, d)`` the vertices in both poses.
    weights
        ``(m,)`` area that each vertex stands for.

    Examples
    --------
    >>> square = np.array([[0.0, 0], [0, 1], [1, 0], [1, 1]])
    >>> turned = square[:, ::-1] * [1, -1] + [5, 0]
    >>> carried(np.array([[0.25, 0.5]]), square, turned, np.ones(4)).round(9).tolist()
    [[5.5, -0.25]]
    """
    distance, near = KDTree(vertices).query(points, k=min(_AROUND, len(vertices)))
    share = weights[near] / np.maximum(distance, 1e-9 * distance.max()) ** _POWER
    share /= share.sum(axis=1, keepdims=True)
    before, after = (np.einsum("nk,nkd->nd", share, v[near]) for v in (vertices, moved))
    spread = np.einsum(
        "nk,nki,nkj->nij",
        share,
        vertices[near] - before[:, None],
        moved[near] - after[:, None],
        optimize=True,
    )
    left, _, right = np.linalg.svd(spread)
    left[:, :, -1] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.asarray(after + np.einsum("ni,nij->nj", points - before, left @ right))


def _mesh_poses(
    collection: str, folder: Path, quick: bool, n_inside: int, n_marks: int, rng: np.random.Generator
) -> Poses:
    """Read the poses of one mesh; the pose at rest tells the mirror, and carries the points inside."""
    name, first, pattern = _MESHES[collection]
    files = [folder / first, *sorted(folder.glob(pattern), key=lambda path: (len(path.stem), path.stem))]
    files = files[:QUICK_POSES] if quick else files
    voxels = QUICK_VOXELS if quick else VOXELS
    shapes = tuple(read(file, voxels=voxels) for file in files)
    meshes = [trimesh.load(file, process=False) for file in files]
    vertices = [np.asarray(mesh.vertices, np.float64) for mesh in meshes]
    faces = np.asarray(meshes[0].faces)
    area = Surface(vertices[0], faces).vertex_areas
    side = rng.choice(len(area), n_marks // 2, replace=False, p=area / area.sum())
    chosen = np.concatenate([side, _mirror_images(vertices[0])[side]])
    half = np.arange(n_marks // 2)
    inside = _spread(shapes[0], n_inside, rng)
    return Poses(
        f"{name}s",
        collection,
        f"{len(files)} poses of one {name}, whose vertices correspond, at {voxels} voxels each.",
        shapes,
        read(files[0], voxels=round(FINER * voxels)),
        np.stack([inside, *(carried(inside, vertices[0], moved, area) for moved in vertices[1:])]),
        np.stack([_below(s, v, faces, chosen) for s, v in zip(shapes, vertices, strict=True)]),
        np.concatenate([half + half.size, half]),
    )


def _spread(shape: Shape, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw points evenly from the volume: off the nodes, so that all poses are interpolated alike."""
    nodes = rng.choice(shape.n_nodes, 2 * count)
    points = shape.points[nodes] + rng.uniform(-0.5, 0.5, (2 * count, shape.ndim)) * shape.spacing
    return points[depth_at(shape, points) > 0][:count]


def _below(
    shape: Shape, vertices: NDArray[np.float64], faces: NDArray[np.int64], chosen: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return where inside the shape the values for some vertices are read."""
    _, place, samples = sample_points(shape, vertices, faces)
    return samples[place[chosen]]


def _creature(quick: bool, n_points: int, n_marks: int, rng: np.random.Generator) -> Poses:
    """Pose a creature: the silhouette of a human, or its body in space."""
    ndim, voxels, count = (2, QUICK_VOXELS, QUICK_POSES) if quick else (3, VOXELS, 5)
    made = creature_poses("human", count, ndim=ndim, voxels=voxels, n_points=n_points, rng=rng)
    again = np.random.default_rng(_SEED)
    finer = creature_poses("human", 1, ndim=ndim, voxels=round(FINER * voxels), n_points=2, rng=again)
    half = n_marks // 2
    pairs = np.concatenate([np.arange(half), made.mirror[:half]])
    return Poses(
        "human",
        "",
        f"{count} poses of a creature made here, whose points move with its bones.",
        made.shapes,
        finer.shapes[0],
        made.points,
        made.points[:, pairs],
        np.concatenate([np.arange(half) + half, np.arange(half)]),
    )


def _mirror_images(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Vertex nearest to the mirror image of each, in the middle plane across the axis that serves best."""
    best, least = np.arange(len(vertices)), np.inf
    tree = KDTree(vertices)
    for axis in range(vertices.shape[1]):
        image = vertices.copy()
        image[:, axis] = vertices[:, axis].max() + vertices[:, axis].min() - image[:, axis]
        distance, number = tree.query(image)
        if distance.mean() < least:
            best, least = number, float(distance.mean())
    return np.asarray(best, np.int64)
