"""The simulator as a backend of the sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from simulator.runtime import Order, SimulatedRuntime
from spem.fields.operator import System
from spem.fields.solvers.engine import SourceEngine


@dataclass(frozen=True)
class Simulated:
    """Runs the sweep's kernels on a CPU.

    Parameters
    ----------
    order
        In which threads run between barriers, and blocks of a grid.
    memory
        Bytes of the device.
    sanitize
        Run under the compiler's sanitizers; see `SimulatedRuntime`.
    """

    order: Order = "forward"
    memory: int | None = None
    sanitize: bool = False

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> SourceEngine:
        """Make an engine over the simulator."""
        from spem.fields.solvers.cuda.engine import CudaEngine

        return CudaEngine(systems, dtype, SimulatedRuntime(self.order, self.sanitize, self.memory))
