"""The same parts in all poses of one mesh: ``python benchmarks/pose_consistency.py``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from sklearn.metrics import adjusted_rand_score

import spem
from _table import Benchmark, Row, data_root, timed
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.joint import joint_parts
from spem.decomposition.matching import match_parts
from spem.decomposition.parts import Parts
from spem.decomposition.transfer import vertex_labels
from spem.fields.boundary.patches import patch_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources

LIMIT = 0.80
VOXELS, PATCHES, N_PARTS = 15_000, 200, 8
HELD = "joint, region"


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("pose_consistency", str(__doc__).splitlines()[0], argv)
    root = data_root()
    for name, folder, pattern in (
        ("horses", "horse_poses", "[0-9]*.obj"),
        ("cats", "tosca_cats", "cat*.off"),
    ):
        files = sorted((root / folder).glob(pattern)) if root else []
        if not files:
            benchmark.skip(f"{name}: {folder} is absent")
            continue
        poses(benchmark, name, files[:3] if benchmark.quick else files)
    benchmark.write()


def poses(benchmark: Benchmark, name: str, files: Sequence[Path]) -> None:
    """Divide all poses in several ways and compare the labels of their vertices."""
    voxels, patches = (4_000, 100) if benchmark.quick else (VOXELS, PATCHES)
    seconds, fields = timed(lambda: [solved(file, voxels, patches) for file in files])
    benchmark.fact(f"{name}: seconds to read and solve {len(files)} poses", seconds)
    maps = [spem.maps(spem.sweep(f.sources.system.shape)).values for f in fields]
    ways = {
        "alone, region": lambda: match_parts([region_parts(f, N_PARTS) for f in fields], maps).parts,
        "alone, boundary": lambda: match_parts([boundary_parts(f, N_PARTS) for f in fields], maps).parts,
        HELD: lambda: joint_parts(fields, N_PARTS).parts,
        "joint, boundary": lambda: joint_parts(fields, N_PARTS, over="boundary").parts,
        "joint, region, 12 parts": lambda: joint_parts(fields, 12).parts,
    }
    rows: list[Row] = []
    for way, divide in ways.items():
        seconds, parts = timed(divide)
        row: Row = {"fit": way, **consistency(parts, files), "seconds": seconds}
        rows.append(row)
        if way == HELD and not benchmark.quick:
            benchmark.target(f"{name}: mean adjusted Rand index", row["mean ARI"], LIMIT, at_least=True)
    benchmark.table(f"{name}: {len(files)} poses, {voxels} voxels, {patches} patches, {N_PARTS} parts", rows)


def solved(file: Path, voxels: int, patches: int) -> SourceFields:
    """Solve for the patches of one mesh at ρ = inf."""
    return solve_sources(patch_sources(assemble(spem.read(file, voxels=voxels)), patches), np.inf)


def consistency(parts: Sequence[Parts], files: Sequence[Path]) -> Row:
    """Compare the vertex labels of every two poses, as partitions and one by one."""
    labels = [on_vertices(p, file) for p, file in zip(parts, files, strict=True)]
    pairs = list(itertools.combinations(range(len(files)), 2))
    rand = [adjusted_rand_score(labels[i], labels[j]) for i, j in pairs]
    worst = pairs[int(np.argmin(rand))]
    return {
        "mean ARI": float(np.mean(rand)),
        "worst ARI": float(np.min(rand)),
        "worst pair": f"{files[worst[0]].stem} {files[worst[1]].stem}",
        "same label": float(np.mean([np.mean(labels[i] == labels[j]) for i, j in pairs])),
        "unexplained": float(np.mean([p.unexplained for p in parts])),
    }


def on_vertices(parts: Parts, file: Path) -> NDArray[np.int32]:
    """Label the vertices of the file by the nodes of its shape."""
    mesh = trimesh.load(file, process=False)
    return vertex_labels(parts.shape, parts.node_labels, mesh.vertices, mesh.faces)


if __name__ == "__main__":
    main()
