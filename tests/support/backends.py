"""Where the tests of the sweep run: on the host, in the simulator, on a device where there is one."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import pytest
from simulator import Simulated, SimulatedRuntime
from simulator.compiler import find_compiler
from simulator.runtime import Order

from spem.errors import SpemError
from spem.fields.solvers.cuda.device import Cuda
from spem.fields.solvers.cuda.runtime import Runtime
from spem.fields.solvers.engine import Backend

BACKENDS: dict[str, Backend | None] = {"host": None, "simulated": Simulated(), "cuda": Cuda()}

#: For ``pytest.mark.parametrize``: names of all backends, and of those that run kernels.
ALL = [pytest.param(name, marks=pytest.mark.cuda if name == "cuda" else ()) for name in BACKENDS]
DEVICES = ALL[1:]


def use_backend(name: str) -> Backend | None:
    """Return a backend by name, or skip the test with the reason why it cannot run here."""
    reason = missing(name)
    if reason:
        pytest.skip(reason)
    return BACKENDS[name]


def use_device(name: str, order: Order = "forward") -> Backend:
    """Return a backend that runs kernels, in an order of threads where it can be chosen, or skip the test."""
    use_backend(name)
    return Simulated(order) if name == "simulated" else Cuda()


def use_runtime(name: str, order: Order = "forward") -> Runtime:
    """Return the runtime of such a backend, or skip the test."""
    use_backend(name)
    return SimulatedRuntime(order) if name == "simulated" else Cuda().runtime()


@contextmanager
def with_memory(name: str, n_bytes: int) -> Iterator[Backend]:
    """Give a backend that has so many bytes left, or skip the test."""
    use_backend(name)
    if name == "simulated":
        yield Simulated(memory=n_bytes)
        return
    gc.collect()
    runtime = Cuda().runtime()
    runtime.release()
    pool = runtime.xp.get_default_memory_pool()
    before = pool.get_limit()
    pool.set_limit(size=pool.used_bytes() + n_bytes)
    try:
        yield Cuda()
    finally:
        pool.set_limit(size=before)


@cache
def missing(name: str) -> str | None:
    """Return why a backend cannot run here; None when it can."""
    if name == "simulated" and find_compiler() is None:
        return "the simulator needs g++ or clang++ on Linux"
    if name == "cuda":
        try:
            Cuda().runtime()
        except SpemError as error:
            return f"no CUDA device: {error}"
    return None


#: For tests that run kernels in the simulator by themselves.
needs_simulator = pytest.mark.skipif(missing("simulated") is not None, reason=str(missing("simulated")))
