"""A CUDA device that a CPU plays: the package's own kernels made by a C++ compiler, over strict arrays."""

from simulator.backend import Simulated
from simulator.runtime import SimulatedRuntime

__all__ = ["Simulated", "SimulatedRuntime"]
