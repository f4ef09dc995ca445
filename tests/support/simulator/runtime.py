"""The simulator's runtime: launches with checks, guarded memory."""

from __future__ import annotations

import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from simulator import arrays
from simulator.arrays import DeviceArray
from simulator.compiler import Library, build
from simulator.memory import FaultError, Guarded, poison
from spem.fields.solvers.cuda.programs import read_source

Order = Literal["forward", "backward", "shuffled"]
ORDERS = ("forward", "backward", "shuffled")


class DeviceMemoryError(Exception):
    """The simulated device has no memory left."""


@dataclass(frozen=True)
class SimulatedProgram:
    """A compiled source, for one runtime."""

    runtime: SimulatedRuntime
    library: Library

    def launch(self, kernel: str, n_blocks: int, *arguments: Any) -> None:
        """Run a kernel, then look at the guards of the arrays that it could reach."""
        self.bind(kernel, n_blocks, *arguments)()

    def bind(self, kernel: str, n_blocks: int, *arguments: Any) -> Callable[[], None]:
        """Check a launch once, and return what runs it."""
        if kernel not in self.library.kernels:
            msg = f"no kernel {kernel}; the source has {', '.join(self.library.kernels)}"
            raise TypeError(msg)
        self.library.kernels[kernel].check(arguments)
        return partial(self._run, kernel, n_blocks, arguments)

    def _run(self, kernel: str, n_blocks: int, arguments: tuple[Any, ...]) -> None:
        """Run a kernel with arguments that were checked."""
        if n_blocks == 0:
            return
        held = [_place(argument) for argument in arguments]
        fault = self.library.run(
            kernel, n_blocks, [place.ctypes.data for place in held], *self.runtime.next_order()
        )
        if fault:
            raise FaultError(fault)
        self.runtime.check_guards(f"kernel {kernel}", arguments)


class SimulatedRuntime:
    """A device of the simulator.

    Parameters
    ----------
    order
        In which threads run between barriers, and blocks of a grid: a result that depends on it is a race.
    sanitize
        Compile kernels with the sanitizers of the compiler, which end the process where a kernel does wrong;
        it must have been started with them, see `spawn_sanitized` of the compiler.
    memory
        Bytes of the device, over which allocations fail.
    """

    memory_errors = (DeviceMemoryError,)
    xp = arrays
    name = "the simulator"

    def __init__(self, order: Order = "forward", sanitize: bool = False, memory: int | None = None) -> None:
        self._order = ORDERS.index(order)
        self._sanitize = sanitize
        self._memory = memory if memory is not None else 1 << 33
        self._used = 0
        self._launches = 0
        self._tabled: weakref.WeakSet[Guarded] = weakref.WeakSet()

    def program(self, source: str, **macros: int) -> SimulatedProgram:
        """Compile a source of a package."""
        return self.compile(read_source(source), macros)

    def compile(self, text: str, macros: Mapping[str, int] | None = None) -> SimulatedProgram:
        """Compile a text."""
        return SimulatedProgram(self, build(text, macros or {}, self._sanitize))

    def upload(self, values: NDArray[Any]) -> DeviceArray:
        """Copy a host array."""
        if not isinstance(values, np.ndarray):
            msg = f"upload takes a host array, got {type(values).__name__}"
            raise TypeError(msg)
        array = self._allocate(values.shape, values.dtype)
        array.values[...] = values
        return array

    def download(self, array: DeviceArray) -> NDArray[Any]:
        """Copy to the host, once no guard is found broken."""
        if not isinstance(array, DeviceArray):
            msg = f"download takes a device array, got {type(array).__name__}"
            raise TypeError(msg)
        self.synchronize()
        return array.values.copy()

    def zeros(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> DeviceArray:
        """Make an array of zeros."""
        array = self._allocate(shape, dtype)
        array.values[...] = 0
        return array

    def empty(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> DeviceArray:
        """Make an array of poison."""
        return self._allocate(shape, dtype)

    def address(self, array: DeviceArray) -> int:
        """Return where an array starts; its guards are looked at after every launch from now on."""
        self._tabled.add(array.owner)
        return int(array.values.ctypes.data)

    def free_bytes(self) -> int:
        """Return the bytes left."""
        return self._memory - self._used

    def release(self) -> None:
        """Do nothing: what is not used is given back at once."""

    def synchronize(self) -> None:
        """Look at all guards."""
        for guarded in list(Guarded.live):
            guarded.require_whole("a kernel", "an array")

    def mark(self) -> float:
        """Return the time."""
        return time.perf_counter()

    def elapsed(self, start: float, end: float) -> float:
        """Return the seconds between."""
        return end - start

    def next_order(self) -> tuple[int, int]:
        """Order of the next launch, and the seed of its shuffling."""
        self._launches += 1
        return self._order, self._launches

    def check_guards(self, culprit: str, arguments: tuple[Any, ...]) -> None:
        """Raise a FaultError if guards of the arguments, or of arrays in tables, were written to."""
        for number, argument in enumerate(arguments):
            if isinstance(argument, DeviceArray):
                argument.owner.require_whole(culprit, f"argument {number}")
        for guarded in list(self._tabled):
            guarded.require_whole(culprit, "an array of a table")

    def _allocate(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> DeviceArray:
        """Make a poisoned array between guards."""
        shape = (shape,) if isinstance(shape, int | np.integer) else tuple(shape)
        n_bytes = int(np.prod(shape, dtype=np.int64)) * np.dtype(dtype).itemsize
        if n_bytes > self._memory - self._used:
            msg = f"{n_bytes} bytes asked for, {self._memory - self._used} left"
            raise DeviceMemoryError(msg)
        guarded = Guarded(n_bytes)
        values = guarded.values.view(dtype).reshape(shape)
        poison(values)
        if self._sanitize:
            guarded.seal()
        self._used += n_bytes
        weakref.finalize(guarded, self._give_back, n_bytes)
        return DeviceArray(values, guarded)

    def _give_back(self, n_bytes: int) -> None:
        """Count memory as free."""
        self._used -= n_bytes


def _place(argument: Any) -> NDArray[Any]:
    """What a kernel's argument is read from: a pointer, or a number."""
    if argument is None:
        return np.zeros(1, np.int64)
    if isinstance(argument, DeviceArray):
        return np.array([argument.values.ctypes.data], np.int64)
    return np.array([argument])
