"""Where the tests of the sweep run: on the host, in the simulator, on a device where there is one."""

from __future__ import annotations

from functools import cache

import pytest
from simulator import Simulated
from simulator.compiler import find_compiler

from spem.errors import SpemError
from spem.fields.solvers.cuda.device import Cuda
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
