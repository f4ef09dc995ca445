"""Error against closed forms, and its order: ``python benchmarks/convergence.py``.

ρ is 0.3 of the radius (of the half length, for the interval). Each figure is the mean over random
placements of the grid under the shape, since a single placement may be lucky: the ball's mesh is turned
and shifted, the disk's centre is moved between pixels, the made shapes are shifted.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

import spem
from _shapes import meshed, round_mesh
from _table import Benchmark, Row, slope
from spem.shapes.closed_forms import ball_field
from spem.shapes.shape import Shape
from spem.shapes.voxelize import Lattice, lattice_around, voxelize

RHO = 0.3
MEAN_LIMIT, ORDER_LIMIT = 1.0e-3, 1.9
# Deep enough that the mesh is nearer to the sphere than the field's error: within 2e-5 of the radius.
SUBDIVISIONS = 6
# Points of a pixel's row at which the covered part of a column is measured: finer than 8 bits can tell.
SAMPLES = 256

Placed = tuple[Shape, np.ndarray, float]  # a ball with its centre and radius
Maker = Callable[[int, np.random.Generator], Placed]


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("convergence", str(__doc__).splitlines()[0], argv)
    placements = 2 if benchmark.quick else 16
    budgets = [1000, 4000, 8000] if benchmark.quick else [1000 * 2**k for k in range(7)]
    vertices, faces = round_mesh(4 if benchmark.quick else SUBDIVISIONS)
    centres = vertices[faces].mean(axis=1)
    benchmark.fact("mesh of the ball, faces", len(faces))
    benchmark.fact("mesh of the ball, volume", "scaled to the ball's")
    radii = np.concatenate([np.linalg.norm(p, axis=1) for p in (vertices, centres)])
    benchmark.fact("mesh of the ball, largest distance from the sphere", float(np.abs(radii - 1).max()))
    as_read(benchmark, vertices, faces)
    with tempfile.TemporaryDirectory() as folder:
        makers: dict[str, tuple[Maker, list[int]]] = {
            "ball from a mesh": (mesh_maker(vertices, faces), budgets),
            "disk from an anti-aliased image": (image_maker(Path(folder)), budgets),
            "interval": (made_maker(1), [b // 50 for b in budgets]),
            "4-ball": (made_maker(4), budgets),
        }
        for title, (maker, sizes) in makers.items():
            for boundary in ("surface", "voxel"):
                study(benchmark, title, boundary, maker, sizes, placements)
    benchmark.write()


def study(
    benchmark: Benchmark, title: str, boundary: str, maker: Maker, sizes: list[int], placements: int
) -> None:
    """Measure one shape over its sizes, and hold surface boundaries against the targets."""
    rng = np.random.default_rng(7)
    rows: list[Row] = []
    spacings, means, worsts = [], [], []
    for size in sizes:
        runs = [errors(maker(size, rng), boundary) for _ in range(placements)]
        spacing, mean, worst = (float(np.mean(column)) for column in zip(*runs, strict=True))
        spacings.append(spacing)
        means.append(mean)
        worsts.append(worst)
        deviation = float(np.std([run[1] for run in runs], ddof=1)) / math.sqrt(placements)
        rows.append({"voxels": size, "spacing": spacing, "mean error": mean, "max error": worst})
        rows[-1] |= {"standard error": deviation}
        if len(means) > 1:
            rows[-1]["order of mean"] = slope(spacings[-2:], means[-2:])
            rows[-1]["order of max"] = slope(spacings[-2:], worsts[-2:])
    name = f"{title}, boundary {boundary}"
    benchmark.table(name, rows)
    order = slope(spacings, means)
    if boundary == "voxel":
        benchmark.fact(f"{name}, order of the mean error", order)
        return
    benchmark.fact(f"{name}, order of the max error", slope(spacings, worsts))
    benchmark.target(f"{name}, order of the mean error", order, ORDER_LIMIT, at_least=True)
    if title == "ball from a mesh":
        benchmark.target(f"{name}, mean error at 8k", means[sizes.index(8000)], MEAN_LIMIT)


def as_read(benchmark: Benchmark, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Measure the ball at 8k voxels where the reader places the grid: centred on the bounding box."""
    _, mean, worst = errors((meshed(vertices, faces, 8000, "ball"), np.zeros(3), 1.0), "surface")
    benchmark.fact("ball from a mesh at 8k, grid as the reader places it, mean error", mean)
    benchmark.fact("ball from a mesh at 8k, grid as the reader places it, max error", worst)


def errors(placed: Placed, boundary: str) -> tuple[float, float, float]:
    """Return spacing in radii, and mean and largest error of the field of a ball."""
    shape, centre, radius = placed
    v = spem.field(shape, RHO * radius, boundary=boundary)
    difference = np.abs(v - ball_field(shape.points - centre, radius, RHO * radius))
    return shape.spacing[0] / radius, float(difference.mean()), float(difference.max())


def mesh_maker(vertices: np.ndarray, faces: np.ndarray) -> Maker:
    """Make the ball from its mesh, turned at random on a grid shifted at random."""

    def make(voxels: int, rng: np.random.Generator) -> Placed:
        turn = Rotation.random(random_state=rng).as_matrix()
        turned = vertices @ turn.T
        steps = ((4 / 3 * np.pi / voxels) ** (1 / 3),) * 3
        centred = lattice_around(turned, steps)
        # readers centre the grid on the bounding box; one more layer makes room to shift it
        origin = np.array(centred.origin) - rng.uniform(size=3) * steps
        x, y, z = (count + 1 for count in centred.shape)
        lattice = Lattice(tuple(origin.tolist()), steps, (x, y, z))
        filling = voxelize(turned, faces, lattice)
        shape = Shape.from_mask(filling.mask, steps, origin=lattice.origin, name="ball", cuts=filling.cuts)
        return shape, np.zeros(3), 1.0

    return make


def made_maker(ndim: int) -> Maker:
    """Make the unit ball with exact cuts on a grid shifted at random."""
    volume = {1: 2.0, 4: np.pi**2 / 2}[ndim]

    def make(voxels: int, rng: np.random.Generator) -> Placed:
        spacing = (volume / voxels) ** (1 / ndim)
        shape = spem.synthetic.n_ball(1.0, spacing, ndim, offset=tuple(rng.uniform(size=ndim)))
        return shape, np.zeros(ndim), 1.0

    return make


def image_maker(folder: Path) -> Maker:
    """Make the disk by reading an 8-bit image of its exact area coverage, its centre between pixels."""

    def make(voxels: int, rng: np.random.Generator) -> Placed:
        radius = float(np.sqrt(voxels / np.pi))
        centre = radius + 3 + rng.uniform(size=2)
        side = int(2 * radius + 8)
        path = folder / "disk.png"
        Image.fromarray(np.rint(255 * coverage(radius, centre, side)).astype(np.uint8)).save(path)
        return spem.read(path), centre, radius

    return make


def coverage(radius: float, centre: np.ndarray, side: int) -> np.ndarray:
    """Return the share of each pixel's area that lies in the disk; pixel (0, 0) is centred at 0."""
    row = (np.arange(side * SAMPLES) + 0.5) / SAMPLES - 0.5 - centre[0]
    half = np.sqrt(np.maximum(radius**2 - row**2, 0.0))[:, None]  # (rows * samples, 1)
    edge = np.arange(side + 1) - 0.5 - centre[1]
    covered = np.diff(np.clip(edge, -half, half), axis=1)
    return np.asarray(covered.reshape(side, SAMPLES, side).mean(axis=1))


if __name__ == "__main__":
    main()
