"""The runtime of a GPU, by CuPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from spem.errors import MissingExtraError, ParameterError
from spem.fields.solvers.cuda.programs import kernels, options, read_source
from spem.fields.solvers.cuda.runtime import THREADS, Array

# Oldest CUDA that there is an extra of spem for.
_OLDEST_EXTRA = 12
# cudaErrorMemoryAllocation and CUDA_ERROR_OUT_OF_MEMORY
_OUT_OF_MEMORY = 2


def load_cupy(index: int) -> Any:
    """Import CuPy and make sure that it can use a device.

    Raises
    ------
    MissingExtraError
        When CuPy is not installed, made for a later CUDA than the driver's, or without its compiler.
    ParameterError
        When there is no driver, no device, or none of this number.
    """
    try:
        cupy = import_module("cupy")
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError) and error.name == "cupy"
        state = "not installed" if missing else f"installed but cannot be imported ({error})"
        msg = f"CuPy is {state}; it comes with pip install 'spem[cuda]'"
        raise MissingExtraError(msg) from error
    require_driver(cupy.cuda.runtime, index)
    require_compiler(cupy.cuda.nvrtc)
    return cupy


def require_compiler(nvrtc: Any) -> None:
    """Raise a one-line error, as `load_cupy` does, unless ``cupy.cuda.nvrtc`` finds its library."""
    try:
        nvrtc.getVersion()
    except (ImportError, OSError, RuntimeError) as error:
        msg = "CuPy finds no compiler (NVRTC); it comes with pip install 'spem[cuda]' or 'spem[cuda12]'"
        raise MissingExtraError(msg) from error


def require_driver(driver: Any, index: int) -> None:
    """Raise a one-line error, as `load_cupy` does, unless ``cupy.cuda.runtime`` can use a device."""
    version, wanted = driver.driverGetVersion(), driver.runtimeGetVersion()
    if version == 0:
        msg = "no NVIDIA driver here: install one, give a container its GPUs, or take no device"
        raise ParameterError(msg)
    if version // 1000 < wanted // 1000:
        major, minor = version // 1000, version % 1000 // 10
        msg = f"CuPy is for CUDA {wanted // 1000}, the driver for CUDA {major}.{minor}: update the driver"
        if major >= _OLDEST_EXTRA:
            old = f"cupy-cuda{wanted // 1000}x"
            msg += f", or pip uninstall {old} and pip install 'spem[cuda{major}]'"
        raise MissingExtraError(msg)
    try:
        count = driver.getDeviceCount()
    except driver.CUDARuntimeError as error:
        msg = f"no CUDA device can be used: {error}; take no device"
        raise ParameterError(msg) from error
    if not 0 <= index < count:
        names = [driver.getDeviceProperties(number)["name"].decode() for number in range(count)]
        listing = ", ".join(f"{number} {name}" for number, name in enumerate(names)) or "none"
        msg = f"no CUDA device {index}; there are: {listing}"
        raise ParameterError(msg)


class CupyProgram:
    """A source compiled by CuPy for a device, when a kernel of it is first launched.

    Parameters
    ----------
    cupy
        The module.
    device
        Its device.
    source
        Name of the source.
    settings
        The compiler's options for macros.
    """

    def __init__(self, cupy: Any, device: Any, source: str, settings: tuple[str, ...]) -> None:
        text = read_source(source)
        self._cupy, self._device, self._source = cupy, device, source
        self._kernels = kernels(text)
        self._module = cupy.RawModule(code=text, options=("-std=c++17", *settings), backend="nvrtc")
        self._functions: dict[str, Any] = {}

    def launch(self, kernel: str, n_blocks: int, *arguments: Any) -> None:
        """Run a kernel, see `spem.fields.solvers.cuda.runtime.Program`."""
        self.bind(kernel, n_blocks, *arguments)()

    def bind(self, kernel: str, n_blocks: int, *arguments: Any) -> Callable[[], None]:
        """Check a launch once, see `spem.fields.solvers.cuda.runtime.Program`."""
        if kernel not in self._kernels:
            msg = f"{self._source} has no kernel {kernel}; it has {', '.join(self._kernels)}"
            raise TypeError(msg)
        self._kernels[kernel].check(arguments)
        # CuPy passes None as no argument at all, which the driver reads; the null pointer is a number.
        passed = tuple(np.int64(0) if argument is None else argument for argument in arguments)
        return partial(self._run, kernel, int(n_blocks), passed)

    def _run(self, kernel: str, n_blocks: int, passed: tuple[Any, ...]) -> None:
        """Run a kernel with arguments that were checked."""
        if n_blocks == 0:
            return
        self._device.use()
        try:
            self._function(kernel)((n_blocks,), (THREADS,), passed)
        except self._cupy.cuda.driver.CUDADriverError as error:
            if error.status != _OUT_OF_MEMORY:
                raise
            msg = f"no memory left to launch {kernel}"
            raise MemoryError(msg) from error

    def _function(self, kernel: str) -> Any:
        """Kernel as CuPy has it."""
        if kernel not in self._functions:
            self._functions[kernel] = self._module.get_function(kernel)
        return self._functions[kernel]


class CupyRuntime:
    """A CUDA device; it becomes the current device of CuPy in the thread that uses it.

    Parameters
    ----------
    index
        Number of the device.

    Raises
    ------
    MissingExtraError, ParameterError
        When it cannot be used: see `load_cupy`.
    """

    # CuPy's own error of its pool is one.
    memory_errors: tuple[type[BaseException], ...] = (MemoryError,)

    def __init__(self, index: int = 0) -> None:
        self._cupy = load_cupy(index)
        self._device = self._cupy.cuda.Device(index)
        self._name = self._cupy.cuda.runtime.getDeviceProperties(index)["name"].decode()

    @property
    def xp(self) -> Any:
        """CuPy."""
        self._device.use()
        return self._cupy

    @property
    def name(self) -> str:
        """Name of the device."""
        return str(self._name)

    def program(self, source: str, **macros: int) -> CupyProgram:
        """Compile a source, or find it compiled."""
        return _program(int(self._device.id), source, options(macros))

    def upload(self, values: NDArray[Any]) -> Array:
        """Copy to the device, by way of page-locked memory that CuPy keeps for it."""
        return self.xp.asarray(np.ascontiguousarray(values))

    def download(self, array: Array) -> NDArray[Any]:
        """Copy to the host."""
        self._device.use()
        return np.asarray(array.get())

    def zeros(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
        """Make an array of zeros."""
        return self.xp.zeros(shape, dtype)

    def empty(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
        """Make an array that holds anything."""
        return self.xp.empty(shape, dtype)

    def address(self, array: Array) -> int:
        """Return where an array starts."""
        return int(array.data.ptr)

    def free_bytes(self) -> int:
        """Return the bytes free on the device and in CuPy's pool, within the pool's limit."""
        pool = self.xp.get_default_memory_pool()
        free = int(self._device.mem_info[0]) + int(pool.free_bytes())
        limit = int(pool.get_limit())
        return min(free, limit - int(pool.used_bytes())) if limit else free

    def release(self) -> None:
        """Give back what CuPy's pools hold and nobody uses."""
        self.xp.get_default_memory_pool().free_all_blocks()
        self._cupy.get_default_pinned_memory_pool().free_all_blocks()

    def synchronize(self) -> None:
        """Wait for all work."""
        self._device.synchronize()

    def mark(self) -> Any:
        """Return an event at the end of the work so far."""
        event = self.xp.cuda.Event()
        event.record()
        return event

    def elapsed(self, start: Any, end: Any) -> float:
        """Return the seconds between two events."""
        end.synchronize()
        return float(self._cupy.cuda.get_elapsed_time(start, end)) / 1e3


@cache
def _program(index: int, source: str, settings: tuple[str, ...]) -> CupyProgram:
    """Make a program once for each device."""
    cupy = import_module("cupy")
    return CupyProgram(cupy, cupy.cuda.Device(index), source, settings)
