"""Collections from their files: ``python benchmarks/collection.py``.

Sweep and maps of the silhouettes of tari1000 in two processes, and ``spem encode`` of the meshes of shrec11
with two jobs into a fresh file. What compilation costs is told from a few meshes, encoded with a new, empty
cache of Numba and then again.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import joblib

import spem
from _table import Benchmark, Row, compile_kernels, data_root, timed

JOBS = 2
MAPS_LIMIT, ENCODE_LIMIT = 60.0, 90.0
N_SILHOUETTES, N_MESHES = 1000, 600
QUICK_SILHOUETTES, QUICK_MESHES = 20, 6


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("collection", str(__doc__).splitlines()[0], argv)
    root = data_root()
    for measure, folder, pattern in ((silhouettes, "tari1000", "obj*.png"), (meshes, "shrec11", "T*.obj")):
        files = [] if root is None else sorted((root / folder).glob(pattern))
        if files:
            measure(benchmark, files)
        else:
            benchmark.skip(f"{folder}: no {pattern} under SPEM_DATA")
    benchmark.write()


def silhouettes(benchmark: Benchmark, files: list[Path]) -> None:
    """Time sweep and maps of all silhouettes."""
    files = files[:QUICK_SILHOUETTES] if benchmark.quick else files
    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        pool = joblib.Parallel(n_jobs=JOBS)
        warm, _ = timed(lambda: pool(joblib.delayed(compile_kernels)((2,)) for _ in range(JOBS)))
        seconds, nodes = timed(lambda: pool(joblib.delayed(maps_of)(file) for file in files))
    row: Row = {"shapes": len(nodes), "mean nodes": sum(nodes) / len(nodes), "processes": JOBS}
    row |= {"seconds to start and compile": warm, "seconds": seconds}
    row["milliseconds a shape and core"] = 1e3 * JOBS * seconds / len(nodes)
    benchmark.table("sweep and maps of tari1000 from files", [row])
    if len(files) == N_SILHOUETTES:
        benchmark.target("sweep and maps of 1000 silhouettes, seconds", seconds, MAPS_LIMIT)


def maps_of(file: Path) -> int:
    """Read a shape and take its maps; return its number of nodes, so that nothing large is sent back."""
    return spem.maps(spem.read(file)).shape.n_nodes


def meshes(benchmark: Benchmark, files: list[Path]) -> None:
    """Time the command that encodes a collection, with and without compilation."""
    files = files[:QUICK_MESHES] if benchmark.quick else files
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        cache = {"NUMBA_CACHE_DIR": str(Path(folder, "numba"))}
        few = files[:QUICK_MESHES]
        for label, some in (("few, nothing compiled", few), ("few, compiled", few), ("all, compiled", files)):
            output = Path(folder, f"{len(rows)}.spem")
            seconds = encode(some, output, cache)
            rows.append({"run": label, "shapes": len(some), "jobs": JOBS, "seconds": seconds})
    benchmark.table("spem encode of shrec11 from files", rows)
    benchmark.fact("seconds of compilation, once for a machine", rows[0]["seconds"] - rows[1]["seconds"])
    if len(files) == N_MESHES:
        benchmark.target("encode 600 meshes, seconds", rows[2]["seconds"], ENCODE_LIMIT)
        total = rows[2]["seconds"] + rows[0]["seconds"] - rows[1]["seconds"]
        benchmark.fact("encode 600 meshes with nothing compiled, seconds", total)


def encode(files: list[Path], output: Path, environment: dict[str, str]) -> float:
    """Return the seconds that the command takes."""
    code = "from spem.cli import main; main()"
    command = [sys.executable, "-c", code, "encode", *map(str, files), "-o", str(output), "-j", str(JOBS)]
    settings = {"env": os.environ | environment, "capture_output": True, "text": True}
    seconds, done = timed(lambda: subprocess.run(command, check=False, **settings))
    if done.returncode != 0 or not output.exists():
        msg = f"spem encode ended with {done.returncode}: {done.stderr.strip()[-500:]}"
        raise RuntimeError(msg)
    return seconds


if __name__ == "__main__":
    main()
