"""The two sides of a benchmark of backends: the processor, and a CUDA device where there is one."""

from __future__ import annotations

import operator
import statistics
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from _stages import STAGES, Clock, Watch
from _table import Row
from spem.embedding.maps import compute_maps, principal_components
from spem.errors import SpemError
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.batch import Batch
from spem.fields.solvers.cuda.device import Cuda
from spem.fields.solvers.engine import Backend
from spem.fields.solvers.host import Host
from spem.fields.solvers.sweep import Sweep
from spem.fields.solvers.team import usable_threads
from spem.shapes.shape import Shape

N_MAPS = 6
Tables = tuple[list[np.ndarray], list[np.ndarray]]


@dataclass
class Outcome:
    """One run: seconds in all and by stage, what it came to."""

    total: float
    clock: Clock
    iterations: int
    rank: int
    fields: list[np.ndarray] = field(default_factory=list)
    maps: list[np.ndarray] = field(default_factory=list)
    kernel_seconds: dict[str, float] = field(default_factory=dict)
    kernel_bytes: dict[str, float] = field(default_factory=dict)


class Processor:
    """Numba kernels on all threads that the process may use."""

    name = "CPU"

    def backend(self, *, profile: bool) -> Backend:
        """Return what a sweep runs on; there is nothing to profile."""
        return Host()

    def project(self, batch: Batch, clock: Clock, _: bool) -> Tables:
        """Materialise all fields and maps."""
        fields = batch.hyperfields()
        with clock.stage("project"):
            return [each.fields() for each in fields], [compute_maps(each, N_MAPS).values for each in fields]

    def copy_bandwidth(self, n_bytes: int, rounds: int) -> float:
        """Return bytes read and written a second, of a copy by NumPy on one thread."""
        source, target = np.ones(n_bytes // 8), np.empty(n_bytes // 8)
        times = []
        for _ in range(rounds + 1):
            clock = Clock()
            np.copyto(target, source)
            times.append(clock.stop())
        return 2 * n_bytes / statistics.median(times[1:])


class Device:
    """A CUDA device, by its runtime; the versions of what runs it are told with its name."""

    def __init__(self, runtime: Any, versions: str = "") -> None:
        self.runtime, self.versions = runtime, versions
        self.name = f"GPU ({runtime.name})"

    def backend(self, *, profile: bool) -> Backend:
        """Return what a sweep runs on; with `profile` kernels are timed by events, which costs a little."""
        return _Profiled(self.runtime, profile)

    def project(self, batch: Batch, clock: Clock, fetch: bool) -> Tables:
        """Materialise all fields and maps on the device, and copy them to the host if they are asked for."""
        engine: Any = batch.engine
        with clock.stage("host algebra, maps"):
            fields, maps = mixes(batch)
        with clock.stage("project"):
            tables = [engine.project(*each) for each in (fields, maps)]
            self.runtime.synchronize()
        if not fetch:
            return [], []
        with clock.stage("download"):
            found = [engine.to_nodes(table) for table in tables]
        return found[0], found[1]

    def copy_bandwidth(self, n_bytes: int, rounds: int) -> float:
        """Return bytes read and written a second on the device, by a kernel or by the driver, the faster."""
        xp, shape = self.runtime.xp, (n_bytes // 4,)
        arrays = [self.runtime.zeros(shape, np.float32) for _ in range(2)]
        ways: list[Callable[..., object]] = [lambda target, source: operator.setitem(target, ..., source)]
        if hasattr(xp, "copyto"):
            ways.append(xp.copyto)
        times = [[self._seconds(way, *arrays) for _ in range(rounds)] for way in ways]
        arrays.clear()
        self.runtime.release()
        return 2 * n_bytes / min(statistics.median(each) for each in times)

    def _seconds(self, work: Callable[..., object], *arrays: Any) -> float:
        """Return the time of some work on the device, done once before."""
        work(*arrays)
        start = self.runtime.mark()
        work(*arrays)
        return float(self.runtime.elapsed(start, self.runtime.mark()))


@dataclass(frozen=True)
class _Profiled:
    """A backend on one runtime, so that kernels are compiled once."""

    runtime: Any
    profile: bool

    def open(self, systems: Sequence[Any], dtype: type[np.floating[Any]]) -> Any:
        """Make an engine."""
        from spem.fields.solvers.cuda.engine import CudaEngine

        return CudaEngine(systems, dtype, self.runtime, profile=self.profile)


Side = Processor | Device


def find_device() -> tuple[Device | None, str]:
    """Return the first CUDA device, or None and the reason."""
    try:
        runtime = Cuda().runtime()
    except SpemError as error:
        return None, str(error)
    cupy = runtime.xp
    driver, built = cupy.cuda.runtime.driverGetVersion(), cupy.cuda.runtime.runtimeGetVersion()
    return Device(runtime, f"CuPy {cupy.__version__} for CUDA {built}, driver for CUDA {driver}"), ""


def mixes(batch: Batch) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return constants and coefficients in the columns of the engine, of all fields and of the maps."""
    fields, maps = [], []
    for b, reduced in enumerate(batch.reduced):
        a = batch.coefficients(b)
        found = principal_components(reduced.gram, a, batch.rho[b], int(batch.engine.counts[b]), N_MAPS)
        fields.append((a[0], reduced.turn @ a[1:]))
        maps.append((found.mix[0], reduced.turn @ found.mix[1:]))
    (c, m), (d, n) = ((np.stack(part) for part in zip(*each, strict=True)) for each in (fields, maps))
    return (c, m), (d, n)


def run(
    side: Side, shapes: Sequence[Shape], n_rho: int, *, profile: bool = False, fetch: bool = False
) -> Outcome:
    """Sweep shapes together, and take all fields and maps."""
    rho = [sample_rho(shape.size, count=n_rho) for shape in shapes]
    clock = Clock()
    with clock.stage("assemble"), ThreadPoolExecutor(usable_threads()) as pool:
        systems = list(pool.map(assemble, shapes))
    sweep = Sweep(device=Watch(side.backend(profile=profile), clock))
    with sweep.batch(systems, rho) as batch:
        fields, maps = side.project(batch, clock, fetch)
        total = clock.stop() - clock.seconds["download"]
        if not fetch:
            # many runs are kept, and these are large
            fields, maps = [], []
        for b in range(len(batch)):
            batch.require(b)
        rank = max(reduced.turn.shape[1] for reduced in batch.reduced)
        engine: Any = batch.engine
        seconds, moved = getattr(engine, "seconds", {}), getattr(engine, "bytes", {})
        return Outcome(total, clock, int(batch.outcome.iterations.max()), rank, fields, maps, seconds, moved)


def measure(
    side: Side, inputs: Sequence[Sequence[Shape]], n_rho: int, rounds: int, *, warm: bool = True
) -> Row:
    """Return medians over rounds and input sets, after a run that does not count."""
    if warm:
        run(side, inputs[0], n_rho)
    runs = [run(side, shapes, n_rho) for _ in range(rounds) for shapes in inputs]
    count = len(inputs[0])
    middle = median_of(lambda each: each.total, runs)
    row: Row = {"side": side.name, "nodes": inputs[0][0].n_nodes, "rho": n_rho, "batch": count}
    row |= {"runs": len(runs), "seconds": middle, "ms a shape": 1e3 * middle / count}
    row["microseconds a node"] = 1e6 * middle / sum(shape.n_nodes for shape in inputs[0])
    for stage in (*STAGES, *(["host algebra, maps"] if isinstance(side, Device) else [])):
        row[stage] = median_of(lambda each, stage=stage: each.clock.seconds[stage], runs)
    if isinstance(side, Device):
        row["download of all"] = run(side, inputs[0], n_rho, fetch=True).clock.seconds["download"]
    row |= {"iterations": runs[-1].iterations, "rank": runs[-1].rank}
    return row


def median_of(value: Callable[[Outcome], float], runs: Sequence[Outcome]) -> float:
    """Return the median of a value over runs."""
    return statistics.median(value(each) for each in runs)
