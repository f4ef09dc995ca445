"""The shapes that solvers are measured on: small and large, thin and bulky, made and real."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

import spem
from _table import Benchmark, data_root
from spem.shapes.creatures import creature
from spem.shapes.meshes import mesh_shape
from spem.shapes.shape import Shape

# Of shrec11: many thin legs; a coiled tube; a compact body.
THIN, TUBE, BULKY = "T1", "T0", "T13"
NAMES = {THIN: "ant", TUBE: "snake", BULKY: "gorilla"}

Factories = dict[str, Callable[[], Shape]]


def made(quick: bool) -> Factories:
    """Return shapes that need no data, by name."""
    chance = np.random.default_rng
    shapes: Factories = {
        "disk, 1k": lambda: spem.synthetic.disk(18.0, 1.0, offset=0.31),
        "comb, 2k": comb,
    }
    if quick:
        return shapes
    return shapes | {
        "ant 2-D, 6k": lambda: creature("ant", voxels=6000, rng=chance(1)),
        "ball, 15k": lambda: ball(15_000),
        "ant 3-D, 15k": lambda: creature("ant", ndim=3, voxels=15_000, rng=chance(2)),
        "ball, 250k": lambda: ball(250_000),
    }


def real(benchmark: Benchmark) -> Factories:
    """Return shapes of the data folder, by name; what is absent is skipped with a word."""
    root = data_root()
    if root is None:
        benchmark.skip("real shapes: SPEM_DATA names no folder")
        return {}
    files: dict[str, tuple[str, int | None]] = {
        "cat of tari1000": ("tari1000/obj9_1.png", None),
        "bone of kimia216": ("kimia216/Bone01.png", None),
    }
    for size in (15_000,) if benchmark.quick else (15_000, 250_000):
        for mesh in (THIN, TUBE, BULKY):
            files[f"{NAMES[mesh]} {mesh} of shrec11, {size // 1000}k"] = (f"shrec11/{mesh}.obj", size)
    found: Factories = {}
    for name, (file, voxels) in files.items():
        if (root / file).is_file():
            found[name] = partial(spem.read, root / file, voxels=voxels)
        else:
            benchmark.skip(f"{name}: {file} is absent")
    return found


def ball(voxels: int) -> Shape:
    """Return the unit ball on a grid at no lucky place."""
    return spem.synthetic.ball(1.0, (4 / 3 * np.pi / voxels) ** (1 / 3), offset=(0.31, 0.17, 0.73))


def comb() -> Shape:
    """Return a comb: a block with twelve teeth of three pixels."""
    mask = np.zeros((60, 72), bool)
    mask[40:] = True
    mask[:40, np.arange(72) % 6 < 3] = True
    return Shape.from_mask(mask, name="comb")


def round_mesh(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a triangulated unit sphere, scaled so that it encloses the volume of the ball."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions)
    scale = (4 / 3 * np.pi / mesh.volume) ** (1 / 3)
    return np.array(mesh.vertices) * scale, np.array(mesh.faces, np.int64)


def meshed(vertices: np.ndarray, faces: np.ndarray, voxels: int, name: str) -> Shape:
    """Fill a mesh at a voxel budget."""
    return mesh_shape(vertices, faces, voxels=voxels, name=name)
