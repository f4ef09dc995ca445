"""The runtime by CuPy: what it asks of CuPy, over a CuPy of our own where there is no device."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from backends import use_backend

from spem.fields.solvers.cuda.cupy_runtime import CupyProgram, CupyRuntime
from spem.fields.solvers.cuda.runtime import THREADS

# What the runtime takes of CuPy.
USED = """
RawModule.get_function ndarray.get ndarray.data get_default_memory_pool
get_default_pinned_memory_pool asarray zeros empty cuda.Device.use cuda.Device.id
cuda.Device.mem_info cuda.Device.synchronize cuda.Event.record cuda.Event.synchronize
cuda.get_elapsed_time cuda.MemoryPool.get_limit cuda.MemoryPool.used_bytes
cuda.MemoryPool.free_bytes cuda.MemoryPool.free_all_blocks cuda.PinnedMemoryPool.free_all_blocks
cuda.MemoryPointer.ptr cuda.driver.CUDADriverError cuda.runtime.CUDARuntimeError
cuda.runtime.driverGetVersion cuda.runtime.runtimeGetVersion cuda.runtime.getDeviceCount
cuda.runtime.getDeviceProperties cuda.nvrtc.getVersion
"""


class FakeDriverError(RuntimeError):
    """What CuPy raises when a launch fails."""

    def __init__(self, status: int) -> None:
        super().__init__(f"status {status}")
        self.status = status


class Module:
    """A compiled source that keeps what is launched."""

    def __init__(self, **options: Any) -> None:
        self.options = options
        self.calls: list[tuple[Any, ...]] = []
        self.fault: Exception | None = None

    def get_function(self, name: str) -> Any:
        """Return a kernel that is not run."""

        def call(*arguments: Any) -> None:
            if self.fault:
                raise self.fault
            self.calls.append((name, *arguments))

        return call


@pytest.fixture
def program() -> tuple[CupyProgram, Module]:
    """Return a program of the package over a CuPy that compiles nothing, and its module."""
    made: list[Module] = []

    def compile_module(**options: Any) -> Module:
        made.append(Module(**options))
        return made[0]

    driver = SimpleNamespace(CUDADriverError=FakeDriverError)
    cupy = SimpleNamespace(RawModule=compile_module, cuda=SimpleNamespace(driver=driver))
    device = SimpleNamespace(use=lambda: None)
    return CupyProgram(cupy, device, "krylov.cu", ("-DDIM=2",)), made[0]


def arguments_of(program: CupyProgram, kernel: str) -> list[Any]:
    """Arguments that a kernel takes: no arrays, and zeros."""
    return [
        None if one.pointer else next(iter(one.dtypes)).type(0) for one in program._kernels[kernel].parameters
    ]


def test_sources_go_to_cupy_with_their_macros(program: tuple[CupyProgram, Module]) -> None:
    """CuPy's own compiler gets the whole text and the options."""
    _, module = program
    assert module.options["options"] == ("-std=c++17", "-DDIM=2")
    assert module.options["backend"] == "nvrtc"
    assert '#include "' not in module.options["code"]
    assert "struct Quad" in module.options["code"]


def test_launches(program: tuple[CupyProgram, Module]) -> None:
    """Kernels run on blocks of all threads; none, unknown kernels and wrong arguments are not launched."""
    made, module = program
    kernel = next(iter(made._kernels))
    arguments = arguments_of(made, kernel)
    made.launch(kernel, 7, *arguments)
    made.launch(kernel, 0, *arguments)
    passed = tuple(np.int64(0) if one is None else one for one in arguments)
    assert module.calls == [(kernel, (7,), (THREADS,), passed)]
    with pytest.raises(TypeError, match=f"kernel {kernel}: expected {len(arguments)} arguments, got"):
        made.launch(kernel, 1, *arguments, None)
    with pytest.raises(TypeError, match=r"krylov\.cu has no kernel nothing; it has "):
        made.launch("nothing", 1)


def test_bound_launches(program: tuple[CupyProgram, Module]) -> None:
    """What is bound is checked at once, run as often as it is called, and never on no blocks."""
    made, module = program
    kernel = next(iter(made._kernels))
    arguments = arguments_of(made, kernel)
    run, idle = made.bind(kernel, 7, *arguments), made.bind(kernel, 0, *arguments)
    assert module.calls == []
    for launch in (run, idle, run):
        launch()
    passed = tuple(np.int64(0) if one is None else one for one in arguments)
    assert module.calls == [(kernel, (7,), (THREADS,), passed)] * 2
    with pytest.raises(TypeError, match=f"kernel {kernel}: expected {len(arguments)} arguments, got"):
        made.bind(kernel, 1, *arguments, None)


def test_a_launch_without_memory(program: tuple[CupyProgram, Module]) -> None:
    """A driver without memory is an error of memory; any other failure stays what it is."""
    made, module = program
    kernel = next(iter(made._kernels))
    module.fault = FakeDriverError(2)
    with pytest.raises(CupyRuntime.memory_errors, match=f"no memory left to launch {kernel}"):
        made.launch(kernel, 1, *arguments_of(made, kernel))
    module.fault = FakeDriverError(700)
    with pytest.raises(FakeDriverError, match="status 700"):
        made.launch(kernel, 1, *arguments_of(made, kernel))


def test_cupy_has_what_is_used() -> None:
    """Every attribute of CuPy that the runtime takes is there."""
    cupy = pytest.importorskip("cupy", reason="CuPy is not installed")
    for path in USED.split():
        found = cupy
        for name in path.split("."):
            found = getattr(found, name)
    assert issubclass(cupy.cuda.memory.OutOfMemoryError, CupyRuntime.memory_errors)


@pytest.mark.cuda
def test_a_device_runs_kernels_and_moves_arrays() -> None:
    """Upload, events, addresses, compilation and download work on a device."""
    use_backend("cuda")
    runtime = CupyRuntime()
    values = np.arange(THREADS, dtype=np.float32)
    held = runtime.upload(values)
    table = runtime.upload(np.array([runtime.address(held)]))
    start = runtime.mark()
    assert runtime.download(runtime.xp.sum(held)) == values.sum()
    assert runtime.elapsed(start, runtime.mark()) >= 0
    assert table.dtype == np.int64
    assert np.array_equal(runtime.download(held), values)
    assert runtime.program("krylov.cu", DIM=2) is runtime.program("krylov.cu", DIM=2)
    assert runtime.free_bytes() > 0
    assert runtime.name
    runtime.synchronize()
    runtime.release()
