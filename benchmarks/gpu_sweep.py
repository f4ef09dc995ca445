"""64 fields and 6 maps on the processor and on a GPU, side by side: ``python benchmarks/gpu_sweep.py``.

A run starts at a shape that is voxelised: operator, upload, levels, sweep, then all fields and all maps, left
where they were computed; copying them from a device is timed apart. Medians over rounds and over several
shapes of a size, after one run that does not count. Where there is no CUDA device the rows are the
processor's, and the reason is told. ``--only SECTION`` runs a part; one that fails ends no other.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cached_property

import numpy as np

import spem
from _gpu_pictures import draw
from _memory import available
from _replay import Recorder, Replay
from _shapes import comb, meshed
from _shrec import shrec
from _sides import Device, Processor, Side, find_device, measure, run
from _sides_accuracy import CODE_LIMIT, FIELD_LIMIT, errors, small_model
from _table import Benchmark, Row, compile_kernels, timed
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.sweep import Sweep
from spem.shapes.creatures import creature, creature_mesh
from spem.shapes.shape import Shape

SECTIONS = ("bandwidth", "accuracy", "nodes", "rho", "batch", "host", "shrec")
N_RHO = 64
COPY_BYTES, QUICK_COPY = 2 << 30, 16 << 20
SIZES, QUICK_SIZES = (15_000, 60_000, 250_000, 1_000_000, 10_000_000), (2_000, 6_000)
ALONE_LIMIT, BATCH_LIMIT, LARGE_LIMIT, SHARE_LIMIT = 0.040, 10.0, 1.0, 0.5
RHOS, RHO_NODES = (8, 64, 256), 60_000
# Nodes of a shape -> shapes at once; the processor takes one after the other, so one batch shows it all.
BATCHES = {15_000: (1, 8, 64, 600), 250_000: (1, 8, 64)}
QUICK_BATCHES = {2_000: (1, 3)}
PROCESSOR_BATCH = 8
HOST_BATCHES, HOST_KINDS = (6, 60, 600), 6
# What a node takes on the host: the shape, its operator, vectors and columns, and 64 fields.
BYTES_A_NODE = 900
# Several inputs of one size, so that none is favoured; of large ones there is one.
INPUTS, LARGE = 3, 1_000_000
# Stages of the engine on a device, as rows of a table; the last is held against the copy bandwidth.
KERNELS = {
    "levels": ("hierarchy",),
    "cycle": ("cycle",),
    "CG": ("krylov",),
    "basis": ("blocks",),
    "projection": ("project",),
    "cycle, CG and basis": ("cycle", "krylov", "blocks"),
}


class Study:
    """The sections, over the sides that there are."""

    def __init__(self, benchmark: Benchmark, device: Device | None) -> None:
        self.benchmark, self.device, self.quick = benchmark, device, benchmark.quick
        self.sides: list[Side] = [Processor(), *([device] if device is not None else [])]
        self.rounds = 1 if self.quick else 5

    @cached_property
    def copy_rate(self) -> dict[str, float]:
        """Bytes a second, read and written, of a large copy on each side."""
        size, rounds = (QUICK_COPY, 2) if self.quick else (COPY_BYTES, 9)
        return {side.name: side.copy_bandwidth(size, rounds) for side in self.sides}

    def bandwidth(self) -> None:
        """Measure what a copy reaches."""
        size = (QUICK_COPY if self.quick else COPY_BYTES) / 2**30
        rows: list[Row] = [
            {"side": name, "GiB copied": size, "GB/s, read and written": rate / 1e9}
            for name, rate in self.copy_rate.items()
        ]
        self.benchmark.table("copy bandwidth", rows)

    def accuracy(self) -> None:
        """Compare fields, maps and codes with double precision."""
        models = {ndim: small_model(ndim) for ndim in ((2,) if self.quick else (2, 3))}
        shapes = {"disk, 1k": spem.synthetic.disk(18.0, 1.0, offset=0.31)}
        if not self.quick:
            shapes["comb, 2k"] = comb()
            shapes["ball, 3k"] = spem.synthetic.ball(1.0, 0.11)
            for size in (15_000, 60_000):
                shapes |= {f"{name}, {size // 1000}k": make(name, size) for name in ("ball", "ant")}
        rows = [
            errors(side, name, shape, models[shape.ndim])
            for name, shape in shapes.items()
            for side in self.sides
        ]
        self.benchmark.table("worst relative errors", rows)
        for side in self.sides:
            own = [row for row in rows if row["side"] == side.name]
            self.benchmark.target(f"{side.name}: field", max(row["field"] for row in own), FIELD_LIMIT)
            self.benchmark.target(f"{side.name}: code", max(row["code"] for row in own), CODE_LIMIT)

    def nodes(self) -> None:
        """Time one shape alone, from small to large."""
        rows: list[Row] = []
        for name in ("ball",) if self.quick else ("ball", "ant"):
            for size in QUICK_SIZES if self.quick else SIZES:
                if self._fits(f"nodes: {name} of {size:,} nodes", size):
                    rows += self._side_by_side(name, size, N_RHO, 1)
        self.benchmark.table("one shape alone: 64 fields and 6 maps", rows)
        self._hold("250k nodes alone, seconds", rows, 250_000, "seconds", ALONE_LIMIT)
        self._hold("10M nodes, seconds", rows, 10_000_000, "seconds", LARGE_LIMIT)
        if self.device is not None:
            sizes = QUICK_SIZES if self.quick else SIZES[2:]
            self._kernels("alone", self.device, [self._shapes("ball", size, 1) for size in sizes])

    def rho(self) -> None:
        """Time one shape for few ρ and many."""
        size = QUICK_SIZES[0] if self.quick else RHO_NODES
        rows = [row for count in RHOS for row in self._side_by_side("ant", size, count, 1)]
        self.benchmark.table(f"{size // 1000}k nodes, number of rho", rows)

    def batch(self) -> None:
        """Time several shapes at once."""
        rows: list[Row] = []
        chosen = QUICK_BATCHES if self.quick else BATCHES
        for size, counts in chosen.items():
            for count in counts:
                if self._fits(f"batch: {count} shapes of {size:,} nodes", size * count):
                    rows += self._side_by_side("ant", size, N_RHO, count)
        self.benchmark.table("shapes at once: 64 fields and 6 maps of each", rows)
        largest = [row for row in rows if row["batch"] == max(BATCHES[250_000])]
        self._hold("250k nodes in batches, ms a shape", largest, 250_000, "ms a shape", BATCH_LIMIT)
        if self.device is not None:
            last = {size: max(counts) for size, counts in chosen.items()}
            self._kernels("in batches", self.device, [self._shapes("ant", *each) for each in last.items()])

    def host(self) -> None:
        """Time what a sweep does on the host beside its kernels: poles, Galerkin solves, compression."""
        kinds = ["ant", "hand", "fish"] * (HOST_KINDS // 3)
        chance = np.random.default_rng
        shapes = [creature(kind, ndim=3, voxels=2_000, rng=chance(i)) for i, kind in enumerate(kinds)]
        systems = [assemble(shape) for shape in shapes]
        samples = [sample_rho(shape.size, count=N_RHO) for shape in shapes]
        recorder, rows = Recorder(), []
        with Sweep(device=recorder).batch(systems, samples):
            answers = list(recorder.answers)
        for times in (1, 4) if self.quick else [count // HOST_KINDS for count in HOST_BATCHES]:
            sweep = Sweep(device=Replay(answers, times))
            seconds = [
                timed(lambda: sweep.batch(systems * times, samples * times))[0]  # noqa: B023 - called at once
                for _ in range(self.rounds + 1)
            ]
            count, middle = times * HOST_KINDS, float(np.median(seconds[1:]))
            rows.append({"systems": count, "seconds": middle, "ms a system": 1e3 * middle / count})
        self.benchmark.table("small algebra of a sweep on the host, no kernel in it", rows)

    def shrec(self) -> None:
        """Time codes of SHREC'11."""
        shrec(self.benchmark, self.sides)

    def _side_by_side(self, name: str, size: int, n_rho: int, count: int) -> list[Row]:
        """Measure both sides on the same shapes."""
        inputs = [self._shapes(name, size, count, seed) for seed in range(self._inputs(size * count))]
        rows: list[Row] = []
        for side in self.sides:
            host = isinstance(side, Processor)
            if host and count > PROCESSOR_BATCH:
                continue
            rounds = 1 if host and size * count >= LARGE else self.rounds
            rows.append({"shape": name} | measure(side, inputs, n_rho, rounds, warm=size < LARGE or not host))
        return rows

    def _inputs(self, total: int) -> int:
        """Return how many input sets of so many nodes there are."""
        return 1 if self.quick or total >= LARGE else INPUTS

    def _shapes(self, name: str, size: int, count: int, seed: int = 0) -> list[Shape]:
        """Return shapes of a size, each another one; of many the first few again and again."""
        made = [make(name, size, seed * 101 + k) for k in range(min(count, 8))]
        return [made[k % len(made)] for k in range(count)]

    def _fits(self, what: str, total: int) -> bool:
        """Tell whether the host has the memory, and say so where it has not."""
        free = available()
        if free is None or total * BYTES_A_NODE < free:
            return True
        wanted = total * BYTES_A_NODE / 2**30
        self.benchmark.skip(f"{what}: about {wanted:.0f} GiB on the host, {free / 2**30:.0f} GiB are free")
        return False

    def _hold(self, what: str, rows: Sequence[Row], size: int, key: str, limit: float) -> None:
        """Hold the worst of the GPU's rows of a size against a target."""
        found = [row for row in rows if 0.8 * size < row["nodes"] < 1.25 * size and row["side"] != "CPU"]
        if found:
            self.benchmark.target(what, max(row[key] for row in found), limit)

    def _kernels(self, how: str, device: Device, batches: Sequence[Sequence[Shape]]) -> None:
        """Hold the bytes that the kernels have to move, over their time, against a copy."""
        rows, copy = [], self.copy_rate[device.name]
        for shapes in batches:
            run(device, shapes, N_RHO, profile=True)
            found = run(device, shapes, N_RHO, profile=True)
            seconds, moved = dict(found.kernel_seconds), dict(found.kernel_bytes)
            for name, stages in KERNELS.items():
                time = sum(seconds.get(stage, 0.0) for stage in stages)
                size = sum(moved.get(stage, 0.0) for stage in stages)
                row: Row = {"nodes": shapes[0].n_nodes, "batch": len(shapes), "stage": name}
                row |= {"seconds": time, "GB": size / 1e9}
                rows.append(row | {"share of the copy": size / time / copy if time else 0.0})
            if not self.quick:
                what = f"share of the copy bandwidth, {len(shapes)} x {shapes[0].n_nodes} nodes"
                self.benchmark.target(what, rows[-1]["share of the copy"], SHARE_LIMIT, at_least=True)
        self.benchmark.table(f"kernels of the GPU, {how}", rows)


def make(name: str, size: int, seed: int = 0) -> Shape:
    """Return a bulky or a thin shape of about so many nodes, another one for each seed."""
    chance = np.random.default_rng(seed)
    if name == "ball":
        return spem.synthetic.ball(1.0, (4 / 3 * np.pi / size) ** (1 / 3), offset=tuple(chance.random(3)))
    return meshed(*creature_mesh(name, chance), size, name)


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("gpu_sweep", str(__doc__).splitlines()[0], argv, SECTIONS)
    device, reason = find_device()
    if device is None:
        benchmark.skip(f"GPU: {reason}; every row is the processor's, and no target of the GPU is held")
    benchmark.fact("GPU", f"{device.name}, {device.versions}" if device is not None else f"none: {reason}")
    benchmark.fact("seconds to compile and warm up", compile_kernels((2, 3)))
    study = Study(benchmark, device)
    for name in SECTIONS:
        benchmark.section(name, getattr(study, name))
    draw(benchmark)
    benchmark.write()
    sys.exit(1 if benchmark.failed else 0)


if __name__ == "__main__":
    main()
