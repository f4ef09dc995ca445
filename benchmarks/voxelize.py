"""Time and exactness of mesh filling: ``python benchmarks/voxelize.py [folder of real shapes]``.

Prints, for balls of growing face and voxel counts, the time of the fill alone, and how far the
volume between its cuts is from the mesh's. With a folder it reads the real meshes in it as well.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from spem.shapes.mesh_files import load_mesh
from spem.shapes.meshes import read_mesh
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.voxelize import Filling, Lattice, lattice_around, voxelize


def best_time(call: Callable[[], Any], rounds: int = 5) -> float:
    """Return the shortest of a few wall-clock times in milliseconds."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)


def line_volumes(filled: Filling | Shape, spacing: tuple[float, ...]) -> np.ndarray:
    """Return the volume between the cuts as summed along the lines of each axis."""
    length = [
        np.count_nonzero(filled.mask) + (filled.cuts.fraction[filled.cuts.direction // 2 == axis] - 0.5).sum()
        for axis in range(3)
    ]
    return np.array(length) * np.prod(spacing)


def balls() -> None:
    print("ball        faces   voxels   fill ms   volume error")
    for subdivisions in (2, 3, 4, 5):
        ball = trimesh.creation.icosphere(subdivisions)
        surface = Surface(np.array(ball.vertices), np.array(ball.faces, np.int64))
        for voxels in (15_000, 250_000, 1_000_000):
            lattice: Lattice = lattice_around(surface.vertices, ((surface.volume / voxels) ** (1 / 3),) * 3)
            filling = voxelize(surface.vertices, surface.faces, lattice)
            elapsed = best_time(lambda s=surface, g=lattice: voxelize(s.vertices, s.faces, g))
            error = line_volumes(filling, lattice.spacing).mean() / surface.volume - 1
            print(f"{'':8}{len(surface.faces):9}{filling.mask.sum():9}{elapsed:10.2f}{error:15.1e}")


def real(folder: Path) -> None:
    print("set           meshes   ms each   nodes off %   volume off %: median, worst, name   scanline")
    for name, pattern in (("shrec11", "T*.obj"), ("horse_poses", "*.obj"), ("tosca_cats", "*.off")):
        rows = []
        for path in sorted((folder / name).glob(pattern)):
            start = time.perf_counter()
            shape = read_mesh(path, components="all")
            elapsed = time.perf_counter() - start
            volume = Surface(*load_mesh(path)).volume
            off = line_volumes(shape, shape.spacing) / volume - 1
            nearest = off[np.abs(off).argmin()]
            rows.append((elapsed, shape.volume / volume - 1, nearest, path.stem, shape.report.watertight))
        if not rows:
            continue
        worst = max(rows, key=lambda row: abs(row[2]))
        milliseconds = 1e3 * np.median([row[0] for row in rows])
        nodes, between = (100 * np.abs([row[i] for row in rows]) for i in (1, 2))
        print(
            f"{name:14}{len(rows):6}{milliseconds:10.1f}{nodes.max():14.2f}{np.median(between):16.3f}"
            f"{between.max():10.3f}  {worst[3]:14}{sum(bool(row[4]) for row in rows):6}"
        )


if __name__ == "__main__":
    balls()
    if len(sys.argv) > 1:
        real(Path(sys.argv[1]))
