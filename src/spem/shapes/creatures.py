"""Collections of articulated creatures in random poses, as silhouettes, volumes and meshes."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import igl
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from skimage.measure import marching_cubes

from spem.errors import ParameterError
from spem.shapes.capsules import Capsules
from spem.shapes.implicit import implicit_shape, sample_level
from spem.shapes.poses import random_pose
from spem.shapes.shape import Shape
from spem.shapes.skeletons import skeleton_kinds

# Nodes of a creature where nothing is asked for.
VOXELS = {2: 6000, 3: 15000}
# Cells along the longest side of the grid on which a size is measured before the real one is made.
MEASURED = {2: 96, 3: 40}
# A body with all its limbs cannot be told with fewer triangles.
MIN_FACES = 100
# Pixels along a side of a silhouette, and free pixels around it.
PIXELS = 160
MARGIN = 8


def creature_kinds() -> tuple[str, ...]:
    """Return the kinds of creature there are.

    Examples
    --------
    >>> creature_kinds()[:4]
    ('human', 'dog', 'giraffe', 'hand')
    """
    return skeleton_kinds()


def creature(
    kind: str,
    *,
    ndim: int = 2,
    voxels: int | None = None,
    spacing: float | None = None,
    rng: np.random.Generator,
    name: str | None = None,
) -> Shape:
    """Return a creature in a random pose.

    Parameters
    ----------
    kind
        One of `creature_kinds`.
    ndim
        2 for the silhouette, axes (row, column), or 3 for the body, axes (x, y, z).
    voxels
        Number of nodes, met to a few per cent; 6000 in 2-D and 15000 in 3-D by default. Far below
        that, thin limbs fall between the voxel centres.
    spacing
        Distance between voxel centres, in place of `voxels`. Creatures are about 2 long.
    rng
        Source of chance: one state, one creature, whatever the resolution.
    name
        Short name; the kind by default.

    Raises
    ------
    ParameterError
        If there is no such kind, `ndim` is neither 2 nor 3, or both sizes are given.

    Examples
    --------
    >>> creature("dog", spacing=0.02, rng=np.random.default_rng(0)).ndim
    2
    """
    return body_shape(random_pose(kind, ndim, rng), voxels, spacing, name=name or kind)


def body_shape(
    body: Capsules, voxels: int | None = None, spacing: float | None = None, *, name: str = "creature"
) -> Shape:
    """Return the shape of a body: of about so many nodes, or of a given spacing.

    Parameters
    ----------
    body
        Capsules in 2 or 3 dimensions.
    voxels, spacing, name
        As for `creature`.

    Raises
    ------
    ParameterError
        If both sizes are given, or there is to be no node.

    Examples
    --------
    >>> body_shape(random_pose("ant", 2, np.random.default_rng(0)), spacing=0.02).ndim
    2
    """
    if voxels is not None and spacing is not None:
        msg = f"voxels = {voxels} and spacing = {spacing} are both given; give one"
        raise ParameterError(msg)
    low, high = body.bounds()
    if spacing is None:
        budget = VOXELS[low.size] if voxels is None else voxels
        if budget < 1:
            msg = f"voxels must be at least 1, not {budget}"
            raise ParameterError(msg)
        spacing = (_volume(body) / budget) ** (1 / low.size)
    step = spacing
    return implicit_shape(lambda x: body.level(x, 2 * step), low, high, step, name=name)


def creature_mesh(
    kind: str, rng: np.random.Generator, *, faces: int = 2500
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the surface of a creature in a random pose: closed, oriented outward.

    Parameters
    ----------
    kind
        One of `creature_kinds`.
    rng
        Source of chance.
    faces
        Number of triangles, or one less.

    Returns
    -------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` indices of vertices, counter-clockwise seen from outside.

    Raises
    ------
    ParameterError
        If there is no such kind, or `faces` is below `MIN_FACES`.

    Examples
    --------
    >>> vertices, faces = creature_mesh("starfish", np.random.default_rng(0), faces=600)
    >>> vertices.shape[1], faces.shape[1]
    (3, 3)
    """
    if faces < MIN_FACES:
        msg = f"faces must be at least {MIN_FACES}, not {faces}"
        raise ParameterError(msg)
    body = random_pose(kind, 3, rng)
    step = _measuring_step(body)
    _, triangles = _surface(body, step)
    # A surface has as many triangles as its area has cells. Twice the number asked for, and a cell
    # no wider than the thinnest limb, keep it in one piece before it is thinned out.
    step = min(step * float(np.sqrt(len(triangles) / (2 * faces))), float(body.radius.min()))
    vertices, triangles = _surface(body, step)
    vertices, triangles, _, _ = igl.qslim(vertices, triangles, faces)
    return vertices, triangles.astype(np.int64)


def collection(
    *,
    n_per_class: int,
    kinds: Sequence[str] | None = None,
    ndim: int = 2,
    voxels: int | None = None,
    rng: np.random.Generator,
) -> list[tuple[Shape, str]]:
    """Return creatures of several kinds with their labels, class by class.

    Parameters
    ----------
    n_per_class
        Number of creatures of each kind.
    kinds
        Some of `creature_kinds`; all by default.
    ndim
        2 or 3.
    voxels
        Number of nodes of each.
    rng
        Source of chance.

    Examples
    --------
    >>> pair = collection(n_per_class=2, kinds=["ant"], voxels=900, rng=np.random.default_rng(0))
    >>> [(shape.name, label) for shape, label in pair]
    [('ant_01', 'ant'), ('ant_02', 'ant')]
    """
    return [
        (creature(kind, ndim=ndim, voxels=voxels, rng=rng, name=name), kind)
        for kind, name in _names(kinds, n_per_class)
    ]


def write_collection(
    folder: str | Path,
    *,
    n_per_class: int,
    kinds: Sequence[str] | None = None,
    rng: np.random.Generator,
    images: bool = True,
    meshes: bool = True,
) -> list[Path]:
    """Write creatures as files with their labels: silhouettes to ``images/``, surfaces to ``meshes/``.

    Silhouettes are white on black, smoothed at the outline; each folder has its ``labels.csv``.

    Parameters
    ----------
    folder
        Where to; made if absent.
    n_per_class
        Number of creatures of each kind.
    kinds
        Some of `creature_kinds`; all by default.
    rng
        Source of chance.
    images, meshes
        What to write.

    Returns
    -------
    list of pathlib.Path
        The folders written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     rng = np.random.default_rng(0)
    ...     images, = write_collection(folder, n_per_class=1, kinds=["fish"], rng=rng, meshes=False)
    ...     sorted(path.name for path in images.iterdir())
    ['fish_01.png', 'labels.csv']
    """
    written = []
    names = _names(kinds, n_per_class)
    for wanted, where, ending in ((images, "images", ".png"), (meshes, "meshes", ".obj")):
        if not wanted:
            continue
        target = Path(folder) / where
        target.mkdir(parents=True, exist_ok=True)
        for kind, name in names:
            if ending == ".png":
                Image.fromarray(silhouette(random_pose(kind, 2, rng))).save(target / (name + ending))
            else:
                _write_obj(target / (name + ending), *creature_mesh(kind, rng))
        with (target / "labels.csv").open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(["file", "label"])
            rows.writerows((name + ending, kind) for kind, name in names)
        written.append(target)
    return written


def silhouette(body: Capsules, pixels: int = PIXELS) -> NDArray[np.uint8]:
    """Return a grey picture of a flat body, white on black, smoothed at the outline.

    Parameters
    ----------
    body
        Capsules in 2-D.
    pixels
        Side of the picture.

    Examples
    --------
    >>> picture = silhouette(random_pose("fish", 2, np.random.default_rng(0)))
    >>> picture.shape, int(picture.min()), int(picture.max())
    ((160, 160), 0, 255)
    """
    low, high = body.bounds()
    step = float((high - low).max()) / (pixels - 2 * MARGIN)
    start = (low + high) / 2 - step * (pixels - 1) / 2
    level = sample_level(lambda x: body.level(x, 2 * step), start, np.full(2, step), (pixels, pixels))
    return np.asarray(np.rint(255 * np.clip(0.5 + level / step, 0, 1)), np.uint8)


def _names(kinds: Sequence[str] | None, n_per_class: int) -> list[tuple[str, str]]:
    """Return kinds and names of a collection."""
    if n_per_class < 1:
        msg = f"n_per_class must be at least 1, not {n_per_class}"
        raise ParameterError(msg)
    width = max(2, len(str(n_per_class)))
    chosen = creature_kinds() if kinds is None else kinds
    return [(kind, f"{kind}_{i:0{width}d}") for kind in chosen for i in range(1, n_per_class + 1)]


def _measuring_step(body: Capsules) -> float:
    """Return the spacing of a coarse grid around a body."""
    low, high = body.bounds()
    return float((high - low).max()) / MEASURED[low.size]


def _sampled(body: Capsules, step: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return depths on a grid around a body, and the coordinates of its first point."""
    low, high = body.bounds()
    counts = tuple((np.ceil((high - low) / step).astype(int) + 3).tolist())
    start = low - step
    return sample_level(lambda x: body.level(x, 2 * step), start, np.full(low.size, step), counts), start


def _volume(body: Capsules) -> float:
    """Measure a body on a coarse grid; the part of a cell on its border is taken from the depth."""
    step = _measuring_step(body)
    depth, start = _sampled(body, step)
    return float(np.clip(0.5 + depth / step, 0, 1).sum() * step**start.size)


def _surface(body: Capsules, step: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the surface of a body by marching cubes."""
    depth, start = _sampled(body, step)
    vertices, triangles, _, _ = marching_cubes(depth, 0.0, gradient_direction="ascent")
    return start + step * vertices.astype(float), triangles.astype(np.int64)


def _write_obj(path: Path, vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> None:
    """Write a mesh as Wavefront OBJ."""
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
