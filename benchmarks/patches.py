"""Boundary patches: time, equality, compactness; and measured areas: ``python benchmarks/patches.py``."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import spem
from _table import Benchmark, Row, data_root, timed
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.points import boundary_points, point_graph
from spem.fields.boundary.sources import Sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape

LIMIT = 1.3  # largest patch over the mean, with ten points to a patch and more


def figures(patches: Sources) -> Row:
    """Return how equal, connected and compact patches are; a spread of 1 is that of flat disks."""
    points, area, group = patches.points, patches.measure, patches.group
    graph = point_graph(patches.system, points.edge_point).tocoo()
    same = group[graph.row] == group[graph.col]
    within = coo_array((graph.data[same], (graph.row[same], graph.col[same])), shape=graph.shape)
    sums = [np.bincount(group, points.measure * x) / area for x in points.position.T]
    apart = np.square(points.position - np.stack(sums, axis=1)[group]).sum(axis=1)
    return {
        "largest / mean": float(area.max() / area.mean()),
        "smallest / mean": float(area.min() / area.mean()),
        "spread": float(2 * np.pi * (points.measure @ apart) / np.square(area).sum()),
        "split patches": connected_components(within)[0] - patches.n_sources,
    }


def shapes(benchmark: Benchmark) -> dict[str, Shape]:
    """Return the shapes: a ball, and of the horse a small and a large grid."""
    found = {"ball, 15k": spem.synthetic.ball(1.0, 0.065, offset=0.31)}
    root = data_root()
    if root is None or not (root / "horse_poses" / "1.obj").is_file():
        benchmark.skip("horse: horse_poses/1.obj is absent")
        return found
    for voxels in (15_000,) if benchmark.quick else (60_000, 250_000):
        found[f"horse, {voxels // 1000}k"] = spem.read(root / "horse_poses" / "1.obj", voxels=voxels)
    return found


def divided(benchmark: Benchmark) -> list[Row]:
    """Divide every boundary into different numbers of patches."""
    patch_sources(assemble(spem.synthetic.ball(1.0, 0.3)), 10)  # compiles
    rows: list[Row] = []
    for name, shape in shapes(benchmark).items():
        for boundary in ("surface", "voxel"):
            system = assemble(shape, boundary)
            for count in (20, 200) if benchmark.quick else (20, 200, 2000):
                seconds, patches = timed(lambda s=system, m=count: patch_sources(s, m))
                points = patches.points
                size = {"points": points.n_points, "pieces": points.n_contours, "m": count}
                which = {"shape": name, "boundary": boundary}
                rows.append(which | size | {"seconds": seconds} | figures(patches))
    return rows


def measured(benchmark: Benchmark) -> list[Row]:
    """Measure circles and spheres on finer and finer grids, the worst of several placements."""
    rows: list[Row] = []
    for across in (10, 20) if benchmark.quick else (10, 20, 40, 80):
        errors = {}
        for name, make, truth in (
            ("circle", spem.synthetic.disk, 2 * np.pi),
            ("sphere", spem.synthetic.ball, 4 * np.pi),
        ):
            totals = [
                boundary_points(assemble(make(1.0, 2 / across, offset=offset))).measure.sum()
                for offset in (0.0, 0.31, 0.5)
            ]
            errors[name] = float(np.abs(np.array(totals) / truth - 1).max())
        rows.append({"voxels across": across} | errors)
    return rows


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("patches", str(__doc__).splitlines()[0], argv)
    benchmark.table("relative error of the measured boundary, worst of 3 placements", measured(benchmark))
    rows = divided(benchmark)
    benchmark.table("patches", rows)
    # a cavity of one voxel is a patch of its own, however small
    fair = [row["largest / mean"] for row in rows if row["points"] >= 10 * row["m"] and row["pieces"] == 1]
    benchmark.target("largest patch over the mean, one piece, ten points to a patch", max(fair), LIMIT)
    benchmark.target("patches that are not connected", max(row["split patches"] for row in rows), 0)
    benchmark.write()


if __name__ == "__main__":
    main()
