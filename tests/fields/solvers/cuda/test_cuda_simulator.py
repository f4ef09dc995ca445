"""The simulator finds what a device would punish or hide."""

from __future__ import annotations

import platform
import re
from pathlib import Path

import numpy as np
import pytest
from backends import needs_simulator
from simulator import SimulatedRuntime, arrays
from simulator.compiler import find_sanitizer, spawn_sanitized
from simulator.memory import FaultError

from spem.fields.solvers.cuda.programs import kernels, read_source
from spem.fields.solvers.cuda.runtime import THREADS, TILE, Runtime
from spem.fields.solvers.engine import LANES

pytestmark = needs_simulator

ZEROS = np.zeros(THREADS, np.float32)
ORDERS = ("forward", "backward", "shuffled")
KERNELS = Path(__file__).with_name("planted.cu").read_text()
SOURCE = read_source("common.cuh") + KERNELS


def launch(kernel: str, n_blocks: int, *arguments: object, order: str = "forward") -> np.ndarray:
    """Run a kernel of the planted source; return its first argument."""
    runtime = SimulatedRuntime(order)
    held = [runtime.upload(one) if isinstance(one, np.ndarray) else one for one in arguments]
    runtime.compile(SOURCE).launch(kernel, n_blocks, *held)
    return runtime.download(held[0])


def test_constants_of_the_kernels_are_those_of_python() -> None:
    """Tile, lanes and threads are the same numbers on both sides."""
    text = read_source("common.cuh")
    for name, value in (("THREADS", THREADS), ("TILE", TILE), ("LANES", LANES)):
        assert f"#define {name} {value}\n" in text


@pytest.mark.parametrize("order", ORDERS)
def test_sums_and_extremes_of_a_tile(order: str) -> None:
    """A tile's sums and maxima by lane are NumPy's, bit by bit the same in every order."""
    rows = np.random.default_rng(1).standard_normal((3 * TILE, LANES)).astype(np.float32)
    found = launch("reduce_tiles", 3, np.zeros((3, 2, LANES)), rows, order=order)
    tiles = rows.reshape(3, TILE, LANES).astype(np.float64)
    assert np.allclose(found[:, 0], tiles.sum(1), rtol=0, atol=1e-12)
    assert np.array_equal(found[:, 1], tiles.max(1))
    assert np.array_equal(found, launch("reduce_tiles", 3, np.zeros((3, 2, LANES)), rows))


@pytest.mark.parametrize("order", ORDERS)
def test_sum_of_a_block(order: str) -> None:
    """A block's sum is in thread 0, and atomics add up."""
    assert launch("sum_block", 2, np.zeros(2), order=order).tolist() == [THREADS * (THREADS - 1) / 2] * 2
    assert launch("count_threads", 5, np.zeros(1, np.int32), order=order).tolist() == [5 * THREADS]


@pytest.mark.parametrize("order", ORDERS)
def test_exchanges_of_a_warp(order: str) -> None:
    """Shuffles, votes and the barrier of a warp are CUDA's."""
    found = launch("warp_words", 1, np.zeros((THREADS, 8), np.int32), order=order)
    thread = np.arange(THREADS)
    lane, base = thread % 32, thread // 32 * 32
    assert np.array_equal(found[:, 0], base + 3)
    assert np.array_equal(found[:, 1], thread ^ 5)
    assert np.array_equal(found[:, 2], np.where(lane < 2, thread, thread - 2))
    assert np.array_equal(found[:, 3], np.where(lane % 8 > 5, thread, thread + 2))
    assert np.array_equal(found[:, 4], np.full(THREADS, sum(1 << bit for bit in range(0, 32, 3))))
    assert np.array_equal(found[:, 5], base == 32)
    assert np.array_equal(found[:, 6], base != 32)
    assert np.array_equal(found[:, 7], thread ^ 1)


def test_parts_of_warps_are_refused() -> None:
    """What is not simulated is said, not guessed."""
    with pytest.raises(FaultError, match=r":\d+: a shuffle of a part of a warp is not simulated"):
        launch("half_warp", 1, np.zeros(THREADS, np.int32))


def test_orders_show_a_race() -> None:
    """A kernel that lacks a barrier answers differently in different orders; with it, it does not."""
    answers = {barrier: [launch("reverse", 1, np.zeros(THREADS, np.int32), np.int32(barrier), order=order)
                         for order in ORDERS] for barrier in (0, 1)}  # fmt: skip
    assert all(np.array_equal(one, np.arange(THREADS)[::-1]) for one in answers[1])
    assert not np.array_equal(answers[0][0], answers[0][1])


def test_blocks_run_in_the_order_too() -> None:
    """A kernel whose blocks depend on each other answers differently in different orders."""
    last = {order: int(launch("last_block", 7, np.zeros(1, np.int32), order=order)[0]) for order in ORDERS}
    assert last["forward"] == 6
    assert last["backward"] == 0


@pytest.mark.skipif(platform.machine() != "x86_64", reason="denormals are flushed on x86-64 alone")
@pytest.mark.parametrize("kernel", ["halve", "halve_later"])
def test_denormals_are_flushed(kernel: str) -> None:
    """As in kernels that CuPy compiles, numbers below the least normal one are zero; NumPy's are not."""
    least = np.finfo(np.float32).tiny
    values = np.resize([4 * least, least], THREADS).astype(np.float32)
    assert np.array_equal(launch(kernel, 1, values)[:2], [2 * least, 0])
    assert least / 2 > 0


def test_shared_memory_is_poisoned_before_each_block() -> None:
    """What a block leaves in shared memory does not reach the next."""
    assert np.isnan(launch("stale_shared", 3, np.zeros(3, np.float32))).all()


@pytest.mark.parametrize(
    ("kernel", "words"), [("early_return", "never come"), ("two_barriers", "different barriers")]
)
def test_divergent_barriers_are_errors(kernel: str, words: str) -> None:
    """Threads that part from their block at a barrier are named, and the next launch works."""
    with pytest.raises(
        FaultError, match=rf"kernel {kernel}, block 0: threads .*{words}.*thread \d+ at .*:\d+"
    ):
        launch(kernel, 2, ZEROS)
    assert launch("sum_block", 1, np.zeros(1)).size == 1


@pytest.mark.parametrize("shift", [-1, 1])
def test_writes_out_of_bounds_are_errors(shift: int) -> None:
    """A write just before or after an array names the kernel and the argument."""
    with pytest.raises(FaultError, match="kernel shifted wrote outside argument 0, an array of 1024 bytes"):
        launch("shifted", 1, ZEROS, np.int32(shift))


def test_writes_out_of_bounds_through_a_table_are_errors() -> None:
    """Arrays whose address was taken are watched although no kernel is given them."""
    runtime = SimulatedRuntime()
    held = runtime.zeros(THREADS - 2, np.float32)
    table = runtime.upload(np.array([runtime.address(held)]))
    with pytest.raises(FaultError, match="kernel through_table wrote outside an array of a table"):
        runtime.compile(SOURCE).launch("through_table", 1, table)


def test_reads_out_of_bounds_and_of_unset_memory_give_no_number() -> None:
    """Guards and empty arrays hold what spoils a result."""
    runtime = SimulatedRuntime()
    assert np.isnan(runtime.download(runtime.empty((3, 8), np.float32))).all()
    assert (runtime.download(runtime.empty(3, np.int32)) < 0).all()
    found = launch("shifted_read", 1, ZEROS, np.ones(THREADS, np.float32), np.int32(1))
    assert np.isnan(found[-1])
    assert (found[:-1] == 1).all()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            [np.zeros(THREADS, np.float64), np.int32(0)],
            "argument v: expected a contiguous device array of float32",
        ),
        ([ZEROS, 0], "argument shift: expected a scalar int32, got int"),
        (
            [ZEROS, np.int64(0)],
            "argument shift: expected a scalar int32, got numpy.int64",
        ),
        ([ZEROS], "expected 2 arguments, got 1"),
    ],
)
def test_arguments_of_wrong_types_are_refused(arguments: list[object], words: str) -> None:
    """Number and types of arguments are those of the kernel's parameters."""
    with pytest.raises(TypeError, match=words):
        launch("shifted", 1, *arguments)


def test_host_and_strided_arrays_are_refused() -> None:
    """Only contiguous arrays of the device reach a kernel."""
    runtime = SimulatedRuntime()
    program = runtime.compile(SOURCE)
    with pytest.raises(TypeError, match=r"got numpy\.ndarray of float32"):
        program.launch("shifted", 1, ZEROS, np.int32(0))
    with pytest.raises(TypeError, match=r"got non-contiguous simulator\.DeviceArray of float32"):
        program.launch("shifted", 1, runtime.zeros((THREADS, 2), np.float32)[:, 0], np.int32(0))
    with pytest.raises(TypeError, match="no kernel nothing; the source has"):
        program.launch("nothing", 1)


def test_no_blocks_launch_nothing() -> None:
    """A grid of no blocks is allowed."""
    assert launch("sum_block", 0, np.ones(1)).tolist() == [1]


def test_memory_runs_out() -> None:
    """An allocation over the device's memory fails, and memory is had again once an array is gone."""
    runtime: Runtime = SimulatedRuntime(memory=1000)
    held = runtime.zeros(200, np.float32)
    assert runtime.free_bytes() == 200
    with pytest.raises(runtime.memory_errors, match="400 bytes asked for, 200 left"):
        runtime.zeros(100, np.float32)
    del held
    assert runtime.free_bytes() == 1000


def test_parameters_are_read_from_sources() -> None:
    """Pointers, tables of pointers, vectors and aliases are what their element types are."""
    text = (
        'using Real = double; extern "C" __global__ void __launch_bounds__(256) '
        "f(const float4* __restrict__ a, float* const* b, /* c, */ Real* d, unsigned int n, long long m) {}"
    )
    found = [(one.name, one.pointer, *map(str, one.dtypes)) for one in kernels(text)["f"].parameters]
    assert found == [
        ("a", True, "float32"),
        ("b", True, "int64"),
        ("d", True, "float64"),
        ("n", False, "uint32"),
        ("m", False, "int64"),
    ]
    with pytest.raises(TypeError, match="kernel f: a parameter of type 'Thing', expected one of"):
        kernels('extern "C" __global__ void f(Thing* a) {}')


def test_device_arrays_refuse_what_a_device_would() -> None:
    """What mixes host and device, needs an order of additions, or is not CuPy's is refused."""
    device = SimulatedRuntime().upload(np.arange(4.0))
    host = np.arange(4)
    for mixed in (
        lambda: device + host,
        lambda: host * device,
        lambda: device[host],
        lambda: device[[0, 1]],
        lambda: arrays.concatenate([device, host]),
        lambda: np.concatenate([device, device]),
        lambda: np.add.reduce(device),
        lambda: np.asarray(device),
        lambda: float(device[0]),
        lambda: int(device[0]),
        lambda: bool(device[0] > 0),
        lambda: list(device),
        lambda: arrays.repeat(device, device),
        lambda: arrays.bincount(device.astype(np.int64), device),
        lambda: arrays.sum(device, where=device > 0),
    ):
        with pytest.raises(TypeError):
            mixed()


def test_device_arrays_compute() -> None:
    """What stays on the device works as NumPy does, with results of the device."""
    runtime = SimulatedRuntime()
    device = runtime.upload(np.arange(6.0).reshape(2, 3))
    order = arrays.argsort(-device.ravel())
    assert runtime.download(device.ravel()[order]).tolist() == [5, 4, 3, 2, 1, 0]
    assert runtime.download(arrays.where(device > 2, device, np.float64(0)).sum(axis=1)).tolist() == [0, 12]
    assert runtime.download((2 * device) @ device.T).tolist() == [[10, 28], [28, 100]]
    device[0] += 1
    assert runtime.download(device[0]).tolist() == [1, 2, 3]
    assert device.sum().shape == ()
    with pytest.raises(TypeError, match="written to twice"):
        device[arrays.asarray(device[0, :2] * 0).astype(np.int64)] = device


SANITIZED = """
import sys
import numpy as np
from simulator import SimulatedRuntime

runtime = SimulatedRuntime("shuffled", sanitize=True)
program = runtime.compile(sys.argv[1])
rows, sums = runtime.zeros((256, 8), np.float32), runtime.empty((2, 2, 8), np.float64)
if sys.argv[2] == "misaligned":
    program.launch("misaligned", 1, rows)
program.launch("reduce_tiles", 2, sums, rows)
program.launch("shifted_read", 1, runtime.zeros(256, np.float32), rows[:32], np.int32(sys.argv[2]))
print(runtime.download(sums).sum())
"""


@pytest.mark.skipif(find_sanitizer() is None, reason="g++ has no address sanitizer here")
def test_sanitizers_stop_what_a_device_would_not() -> None:
    """A kernel that keeps to its arrays runs; a read past them, or across an alignment, is stopped."""
    good = spawn_sanitized("-c", SANITIZED, SOURCE, "0")
    assert (good.stdout.strip(), good.stderr) == ("0.0", "")
    words = r"AddressSanitizer: use-after-poison.*READ of size 4.* in shifted_read "
    assert re.search(words, spawn_sanitized("-c", SANITIZED, SOURCE, "2000").stderr, re.DOTALL)
    assert "misaligned address" in spawn_sanitized("-c", SANITIZED, SOURCE, "misaligned").stderr


def test_xp_has_only_what_cupy_has() -> None:
    """Every name of the stand-in is CuPy's, and others are refused."""
    with pytest.raises(AttributeError, match="the simulator's xp has no ediff1d"):
        arrays.ediff1d  # noqa: B018 - the look-up is what fails
    cupy = pytest.importorskip("cupy", reason="CuPy is not installed")
    assert [name for name in arrays.FUNCTIONS | arrays.NAMES if not hasattr(cupy, name)] == []
    assert [name for name in arrays.LINALG if not hasattr(cupy.linalg, name)] == []
    assert [name for name in arrays.METHODS if not hasattr(cupy.ndarray, name)] == []
