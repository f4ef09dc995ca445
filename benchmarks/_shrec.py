"""The 600 shapes of SHREC'11 from fields to codes, on each side, with a model that was learnt before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from _sides import Processor, Side
from _sides_accuracy import CODE_LIMIT, code_error, codes
from _table import Benchmark, Row, data_root, timed
from spem.codes.bands import Bands
from spem.codes.batches import features_of
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.workers import run_all
from spem.fields.solvers.team import usable_threads
from spem.shapes.read import read
from spem.shapes.shape import Shape

N_SHAPES, QUICK_SHAPES, VOXELS = 600, 4, 15_000
SECONDS_LIMIT = 5.0
OFF = "worst code from the CPU's"


def shrec(benchmark: Benchmark, sides: Sequence[Side]) -> None:
    """Time codes of the collection; nothing is told of shapes that were not read."""
    root = data_root()
    files = [] if root is None else sorted((root / "shrec11").glob("T*.obj"))
    if not files:
        benchmark.skip("shrec: no shrec11/T*.obj under SPEM_DATA")
        return
    took, shapes = timed(lambda: voxelised(files[:QUICK_SHAPES] if benchmark.quick else files))
    benchmark.fact(f"shrec11: seconds to voxelise {len(shapes)} shapes, {usable_threads()} processes", took)
    settings = Settings(features="spem", voxels=VOXELS)
    learnt: list[Bands] = []
    for side in sides:
        backend = side.backend(profile=False)
        features_of(shapes[:QUICK_SHAPES], settings, device=backend)
        took, learnt = timed(lambda backend=backend: features_of(shapes, settings, device=backend))
        benchmark.fact(f"shrec11: seconds from shapes to features, {side.name}", took)
    took, model = timed(lambda: Model.fit(settings, learnt, 3))
    benchmark.fact("shrec11: seconds to learn the model from the features, CPU", took)
    learnt.clear()
    found = [_timed(side, shapes, model) for side in sides]
    rows = [row | {OFF: code_error(made, found[0][1])} for row, made in found]
    benchmark.table("shrec11, fields to codes", rows)
    if len(sides) > 1 and len(shapes) == N_SHAPES:
        seconds = rows[1]["seconds"]
        benchmark.target("600 shapes of SHREC'11, fields to codes, seconds", seconds, SECONDS_LIMIT)
        benchmark.target("worst code of SHREC'11 against the CPU's", rows[1][OFF], CODE_LIMIT)


def _timed(side: Side, shapes: Sequence[Shape], model: Model) -> tuple[Row, np.ndarray]:
    """Return the median time of all codes, and the codes; the first run on a device does not count."""
    host = isinstance(side, Processor)
    if not host:
        codes(side, shapes, model)
    found = [timed(lambda: codes(side, shapes, model)) for _ in range(1 if host else 3)]
    seconds = float(np.median([each[0] for each in found]))
    row: Row = {"side": side.name, "shapes": len(shapes), "runs": len(found)}
    return row | {"seconds": seconds, "ms a shape": 1e3 * seconds / len(shapes)}, found[-1][1]


def voxelised(files: Sequence[Path]) -> list[Shape]:
    """Read and voxelise meshes in as many processes as there are processors, in the order of the files."""
    found = {}
    for file, shape, reason in run_all(_read, files, usable_threads()):
        if shape is None:
            msg = f"{file}: {reason}"
            raise RuntimeError(msg)
        found[file] = shape
    return [found[file] for file in files]


def _read(file: Path) -> Shape:
    """Voxelise one mesh."""
    return read(file, voxels=VOXELS)
