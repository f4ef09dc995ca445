"""The 600 shapes of SHREC'11 from fields to codes, on each side, with a model that was learnt before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from _sides import Processor, Side
from _sides_accuracy import CODE_LIMIT, CODE_RTOL, code_error, codes
from _table import Benchmark, Row, data_root, timed
from spem.codes.bands import Bands
from spem.codes.batches import features_of
from spem.codes.features import SWEEP_RTOL
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.workers import run_all
from spem.fields.solvers.team import usable_threads
from spem.shapes.read import read
from spem.shapes.shape import Shape

N_SHAPES, QUICK_SHAPES, VOXELS = 600, 4, 15_000
SECONDS_LIMIT = 5.0
# Worst distance of a code from the processor's, of the same sweep and of the tight one.
OFF, OFF_TIGHT = "worst code from the CPU's", f"from the CPU's to {CODE_RTOL:g}"


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
    rows: list[Row] = []
    made: dict[tuple[str, float], np.ndarray] = {}
    for rtol in (CODE_RTOL, SWEEP_RTOL):
        for side in sides:
            row, made[side.name, rtol] = _timed(side, shapes, model, rtol)
            for key, reference in ((OFF, rtol), (OFF_TIGHT, CODE_RTOL)):
                row[key] = code_error(made[side.name, rtol], made[sides[0].name, reference])
            rows.append(row)
    benchmark.table("shrec11, fields to codes", rows)
    if len(sides) > 1 and len(shapes) == N_SHAPES:
        tight, default = (row for row in rows if row["side"] == sides[1].name)
        benchmark.target(
            "600 shapes of SHREC'11, fields to codes, seconds", default["seconds"], SECONDS_LIMIT
        )
        what = f"worst code of SHREC'11 against the CPU's, sweep to {CODE_RTOL:g}"
        benchmark.target(what, tight[OFF], CODE_LIMIT)


def _timed(side: Side, shapes: Sequence[Shape], model: Model, rtol: float) -> tuple[Row, np.ndarray]:
    """Return the median time of all codes, and the codes; the first run on a device does not count."""
    host = isinstance(side, Processor)
    if not host:
        codes(side, shapes, model, rtol)
    found = [timed(lambda: codes(side, shapes, model, rtol)) for _ in range(1 if host else 3)]
    seconds = float(np.median([each[0] for each in found]))
    row: Row = {"side": side.name, "sweep to": rtol, "shapes": len(shapes), "runs": len(found)}
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
