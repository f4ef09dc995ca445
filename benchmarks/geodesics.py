"""Distances inside shapes: error and time, beside scikit-fmm: ``python benchmarks/geodesics.py``.

Ways in a U go round two corners, where their exact length is known; the nodes of a grid know where a corner
is to half a voxel, so every method is of first order there. Distances to the boundary have no such limit.
scikit-fmm starts from the exact distance in a ball of three voxels about the source, and from the exact
signed distance of the boundary; it is in the dependency group ``bench``.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import spem
from _table import Benchmark, Row, alternating, slope
from spem.fields.geodesics import source_distances
from spem.paper.geodesics import Way, u_way
from spem.shapes.shape import Shape

Array = NDArray[np.float64]
BALL = 3.0  # voxels about a source that scikit-fmm is given
ERROR_LIMIT, BOUNDARY_LIMIT, ORDER_LIMIT = 0.6, 0.1, 1.8


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("geodesics", str(__doc__).splitlines()[0], argv)
    peer = importlib.util.find_spec("skfmm") is not None
    if not peer:
        benchmark.skip("scikit-fmm: not installed; pip install scikit-fmm, which needs a C++ compiler")
    rounds = 1 if benchmark.quick else 5
    inside(benchmark, [20, 40] if benchmark.quick else [20, 40, 80, 160], rounds, peer)
    sizes = [("disk", 2, [0.05, 0.025]), ("ball", 3, [0.1, 0.05])]
    if not benchmark.quick:
        sizes = [("disk", 2, [0.04, 0.02, 0.01, 0.005]), ("ball", 3, [0.1, 0.05, 0.025])]
    for name, ndim, steps in sizes:
        to_boundary(benchmark, name, ndim, steps, rounds, peer)
    benchmark.write()


def inside(benchmark: Benchmark, cells: list[int], rounds: int, peer: bool) -> None:
    """Lengths of ways in a U, from the end of one arm."""
    rows: list[Row] = []
    for n in cells:
        way, _ = u_way(n)
        calls: dict[str, Callable[[], Array]] = {
            "spem, order 2": lambda w=way: source_distances(w.sources)[0],
            "spem, order 1": lambda w=way: source_distances(w.sources, order=1)[0],
        }
        if peer:
            calls["scikit-fmm, order 2"] = lambda w=way: peer_ways(w, 2)
            calls["scikit-fmm, order 1"] = lambda w=way: peer_ways(w, 1)
        errors = {name: np.abs(call() - way.distance) * n for name, call in calls.items()}
        seconds = alternating(calls, rounds)
        rows += [
            {
                "method": name,
                "nodes": way.shape.n_nodes,
                "mean error, voxels": error.mean(),
                "largest": error.max(),
                "ms": 1000 * seconds[name],
            }
            for name, error in errors.items()
        ]
    benchmark.table("ways round two corners", rows)
    own = [row["mean error, voxels"] for row in rows if row["method"] == "spem, order 2"]
    benchmark.target("mean error of ways in a U, voxels", max(own), ERROR_LIMIT)


def to_boundary(
    benchmark: Benchmark, name: str, ndim: int, steps: list[float], rounds: int, peer: bool
) -> None:
    """Distances to the boundary of a ball of radius 1."""
    rows: list[Row] = []
    for h in steps:
        shape = spem.synthetic.n_ball(1.0, h, ndim, offset=0.31)
        exact = 1 - np.linalg.norm(shape.points, axis=1)
        calls: dict[str, Callable[[], Array]] = {
            "spem": lambda s=shape: spem.distance_to_boundary(s),
            "Euclidean transform less half a voxel": lambda s=shape: transformed(s),
        }
        if peer:
            calls["scikit-fmm, order 2"] = lambda s=shape: peer_boundary(s)
        errors = {method: np.abs(call() - exact) / h for method, call in calls.items()}
        seconds = alternating(calls, rounds)
        rows += [
            {
                "method": method,
                "spacing": h,
                "nodes": shape.n_nodes,
                "mean error, voxels": error.mean(),
                "largest": error.max(),
                "ms": 1000 * seconds[method],
            }
            for method, error in errors.items()
        ]
    benchmark.table(f"distance to the boundary of a {name}", rows)
    own = [row["largest"] * row["spacing"] for row in rows if row["method"] == "spem"]
    benchmark.target(f"largest error on the finest {name}, voxels", own[-1] / steps[-1], BOUNDARY_LIMIT)
    order = float(slope(steps, own))
    if benchmark.quick:
        benchmark.fact(f"order of the largest error on a {name}", order)
    else:
        benchmark.target(f"order of the largest error on a {name}", order, ORDER_LIMIT, at_least=True)


def transformed(shape: Shape) -> Array:
    """Distance of the nodes to the nearest voxel outside, less half a voxel."""
    grid = ndimage.distance_transform_edt(shape.mask, shape.spacing) - shape.spacing[0] / 2
    return np.asarray(grid.ravel()[shape.voxels])


def peer_ways(way: Way, order: int) -> Array:
    """Lengths of ways by scikit-fmm, from a ball about the source."""
    shape = way.shape
    h = shape.spacing[0]
    from_source = np.linalg.norm(shape.points - way.sources.position[0], axis=1)
    front = np.ma.MaskedArray(shape.to_grid(from_source - BALL * h, fill=1.0), ~shape.mask)
    grid = importlib.import_module("skfmm").distance(front, dx=h, order=order)
    return np.asarray(grid.filled(np.inf).ravel()[shape.voxels] + BALL * h)


def peer_boundary(shape: Shape) -> Array:
    """Distance to the boundary of a ball by scikit-fmm, from the exact signed distance of all voxels."""
    index = np.stack(np.meshgrid(*shape.axes, indexing="ij"))
    level = 1 - np.sqrt(np.square(index).sum(axis=0))
    grid = importlib.import_module("skfmm").distance(level, dx=list(shape.spacing), order=2)
    return np.asarray(grid.ravel()[shape.voxels])


if __name__ == "__main__":
    main()
