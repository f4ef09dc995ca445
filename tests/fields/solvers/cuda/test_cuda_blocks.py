"""The reduced basis on a device, against dense algebra of the host."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_runtime
from hypothesis import example, given, settings
from hypothesis import strategies as st
from simulator import SimulatedRuntime

from spem.fields.operator import System, assemble
from spem.fields.solvers.cuda.blocks import Blocks, Chunks
from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.engine import LANES, Small
from spem.shapes import synthetic
from spem.shapes.shape import Shape

DTYPES = [np.float32, np.float64]


def porous(*sides: int, spacing: tuple[float, ...] | float = 1.0) -> System:
    """A grid with a third of its voxels missing at random."""
    inside = np.random.default_rng(sum(sides)).random(sides) < 0.67
    return assemble(Shape.from_mask(inside, spacing), "surface")


class Bench:
    """Blocks of a batch on a device, filled with random columns, and the same on the host."""

    def __init__(
        self,
        device: str,
        *systems: System,
        dtype: Any = np.float64,
        n_blocks: int = 0,
        order: Any = "forward",
    ) -> None:
        self.systems, self.rng = systems, np.random.default_rng(0)
        self.runtime = use_runtime(device, order)
        self.hierarchy = Hierarchy.of(systems, self.runtime)
        self.rows = self.runtime.download(self.hierarchy.rows)
        self.blocks = Blocks(self.hierarchy, dtype, self.runtime)
        self.columns = [np.zeros((system.n_nodes, 0)) for system in systems]
        self.products: Any = None
        for _ in range(n_blocks):
            self.append()

    def small(self, *shape: int) -> Small:
        """Random numbers for each system."""
        return self.rng.normal(size=(len(self.systems), *shape))

    def vector(self, dtype: Any = np.float32) -> tuple[Any, list[np.ndarray]]:
        """A random vector on the device, and its parts on the host."""
        values = self.rng.normal(size=(self.rows.size, LANES)).astype(dtype)
        table = np.zeros(self.blocks.shape, dtype)
        table[self.rows] = values
        return self.runtime.upload(table), self.split(values)

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Parts of the systems."""
        return np.split(values, self.hierarchy.first_node[1:-1])

    def read(self, table: Any, padding: bool = True) -> list[np.ndarray]:
        """Parts of a vector of the device, whose padding and dummy row are zero."""
        found = self.runtime.download(table)
        assert not padding or not np.delete(found, self.rows, axis=0).any()
        return self.split(found[self.rows])

    def append(self) -> None:
        """Append a random block."""
        x, parts = self.vector()
        mix, remove = self.small(LANES, LANES), self.small(self.blocks.n_columns, LANES) / 10
        self.products = self.blocks.append(x, mix, remove)
        for b, part in enumerate(parts):
            new = (part @ mix[b] + self.columns[b] @ remove[b]).astype(self.blocks.dtype)
            self.columns[b] = np.hstack([self.columns[b], new])


def operator(system: System) -> tuple[Any, np.ndarray]:
    """A in units of the spacing, and the diagonal of M."""
    return system.matrix() * min(system.shape.spacing) ** 2, system.mass[:, None]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("n_blocks", [1, 2, 10])
def test_new_blocks_mix_x_and_the_basis(device: str, dtype: Any, n_blocks: int) -> None:
    """A block is x·mix + B·remove of each system, to the rounding of its precision, and zero in padding."""
    bench = Bench(device, porous(12, 13), porous(9, 5), dtype=dtype, n_blocks=n_blocks)
    for found, columns in zip(bench.read(bench.blocks.arrays[-1]), bench.columns, strict=True):
        near = 1e-5 if dtype == np.float32 else 1e-12
        assert found == pytest.approx(columns[:, -LANES:], rel=near, abs=near)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("n_blocks", [0, 1, 9])
def test_predictions_are_columns_times_coefficients(device: str, dtype: Any, n_blocks: int) -> None:
    """B·mix is what dense algebra says, and zero for a basis without columns."""
    bench = Bench(device, porous(12, 13), porous(9, 5), dtype=dtype, n_blocks=n_blocks)
    u, mix = bench.runtime.empty(bench.blocks.shape, np.float64), bench.small(n_blocks * LANES, LANES)
    bench.blocks.predict(mix, u)
    for b, found in enumerate(bench.read(u)):
        stored = np.hstack([np.zeros((found.shape[0], 0)), *(bench.read(a)[b] for a in bench.blocks.arrays)])
        assert found == pytest.approx(stored.astype(float) @ mix[b], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    "systems",
    [
        (porous(300), porous(40, spacing=0.3)),
        (porous(20, 30, spacing=(1.0, 2.5)), assemble(synthetic.disk(9.0, 1.0))),
        (porous(5, 9, 8, spacing=(0.7, 1.0, 0.4)), assemble(synthetic.ball(3.0, 1.0))),
        (porous(3, 4, 5, 4),),
    ],
    ids=["1-D", "2-D", "3-D", "4-D"],
)
def test_true_residuals_are_those_of_the_sparse_matrix(device: str, systems: tuple[System, ...]) -> None:
    """S M (1 − u) − A u and b − (A + s M) v agree with the assembled matrix, r·r too."""
    bench = Bench(device, *systems)
    shifts = np.abs(bench.small(LANES))
    vector, parts = bench.vector(np.float64)
    rhs, right = bench.vector(np.float64)
    r = bench.runtime.zeros(bench.blocks.shape, np.float32)
    bench.blocks.residual(vector, r, shifts)
    deficit = bench.read(r)
    square = bench.blocks.source_residual(rhs, vector, r, shifts)
    source = bench.read(r)
    for b, system in enumerate(systems):
        stiffness, mass = operator(system)
        left = shifts[b] * mass * (1 - parts[b]) - stiffness @ parts[b]
        assert deficit[b] == pytest.approx(left, rel=1e-6, abs=1e-6)
        left = right[b] - shifts[b] * mass * parts[b] - stiffness @ parts[b]
        assert source[b] == pytest.approx(left, rel=1e-6, abs=1e-6)
        assert square[b] == pytest.approx(np.sum(left**2, axis=0), rel=1e-13)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("n_blocks", [1, 3, 6])
def test_products_are_those_of_dense_algebra(device: str, dtype: Any, n_blocks: int) -> None:
    """BᵀC, BᵀAC, BᵀMC, sums and BᵀX are products in double precision of what is stored."""
    bench = Bench(device, porous(30, 50, spacing=(1.0, 0.6)), porous(9, 5), dtype=dtype, n_blocks=n_blocks)
    x, parts = bench.vector()
    overlaps = bench.blocks.overlaps(x)
    for b, system in enumerate(bench.systems):
        stored = np.hstack([bench.read(a)[b] for a in bench.blocks.arrays]).astype(float)
        new, (stiffness, mass) = stored[:, -LANES:], operator(system)
        near = {"rel": 1e-11, "abs": 1e-11 * float(np.abs(stored.T).sum(axis=1).max())}
        assert bench.products.gram[b] == pytest.approx(stored.T @ new, **near)
        assert bench.products.stiffness[b] == pytest.approx(stored.T @ (stiffness @ new), **near)
        assert bench.products.mass[b] == pytest.approx(stored.T @ (mass * new), **near)
        assert bench.products.sums[b] == pytest.approx(new.sum(axis=0), **near)
        assert bench.products.source[b] == pytest.approx((mass * new).sum(axis=0), **near)
        part = parts[b].astype(float)
        assert overlaps[b] == pytest.approx(np.hstack([stored, part]).T @ part, **near)


@pytest.mark.parametrize("device", DEVICES)
@settings(max_examples=4, deadline=None)
@example(64, np.float32, 1)
@example(6, np.float32, 2)
@example(12, np.float64, 1)
@given(
    st.integers(1, 64),
    st.sampled_from([np.float32, np.float64]),
    st.integers(0, 2),
)
def test_projections_of_any_width_are_constant_plus_columns(
    device: str, width: int, dtype: Any, n_blocks: int
) -> None:
    """Tables of fields or maps agree with dense algebra to single precision, for all systems at once."""
    bench = Bench(device, porous(12, 13), porous(9, 5), dtype=dtype, n_blocks=n_blocks)
    constant, mix = bench.small(width), bench.small(n_blocks * LANES, width)
    single = bench.read(bench.blocks.project(constant, mix), padding=False)
    columns = bench.split(bench.runtime.download(bench.blocks.columns(mix)))
    near = {"rel": 1e-6, "abs": 1e-6} if dtype == np.float32 else {"rel": 1e-12, "abs": 1e-12}
    for b in range(2):
        stored = np.hstack([np.zeros((len(single[b]), 0)), *(bench.read(a)[b] for a in bench.blocks.arrays)])
        expected = stored.astype(float) @ mix[b]
        assert single[b].dtype == np.float32
        assert single[b] == pytest.approx(constant[b] + expected, rel=1e-6, abs=1e-6)
        assert columns[b].dtype == dtype
        assert columns[b] == pytest.approx(expected, **near)


@pytest.mark.parametrize("device", DEVICES)
def test_systems_that_are_not_active_are_left_alone(device: str) -> None:
    """Their rows keep what they hold, their new columns and products are zero."""
    bench = Bench(device, porous(12, 13), porous(9, 5), n_blocks=1)
    bench.blocks.select(np.array([False, True]))
    u = bench.runtime.upload(np.full(bench.blocks.shape, 7.0))
    bench.blocks.predict(bench.small(LANES, LANES), u)
    x, _ = bench.vector()
    products = bench.blocks.append(x, bench.small(LANES, LANES), bench.small(LANES, LANES))
    overlaps = bench.blocks.overlaps(x)
    assert (bench.split(bench.runtime.download(u)[bench.rows])[0] == 7.0).all()
    assert not bench.read(bench.blocks.arrays[-1])[0].any()
    for found in (*products, overlaps):
        assert not found[0].any()
        assert found[1].any()


@needs_simulator
@pytest.mark.parametrize("order", ["backward", "shuffled"])
def test_the_order_of_threads_changes_nothing(order: Any) -> None:
    """Kernels have no races: products are the same bit by bit in every order."""
    systems = porous(30, 50), porous(9, 5)
    first, other = (
        Bench("simulated", *systems, dtype=np.float32, n_blocks=3, order=each) for each in ("forward", order)
    )
    for one, two in zip(first.products, other.products, strict=True):
        assert np.array_equal(one, two)


@needs_simulator
def test_chunks_of_a_system_do_not_depend_on_its_batch() -> None:
    """Chunks cover the tiles of each system, no more than 1024 and none of fewer than eight but the last."""
    runtime = SimulatedRuntime()
    counts = np.array([[1, 1], [128 * 8, 128 * 9], [128 * 60_000, 128 * 60_001]])
    layout = Layout.of(counts, runtime)
    chunks = Chunks.of(layout, runtime)
    tile = runtime.download(chunks.tile)
    assert np.diff(chunks.first).tolist() == [1, 3, 1017]
    assert tile[chunks.first].tolist() == layout.first_tile.tolist()
    assert (np.diff(tile)[chunks.first[2] : -1] == 118).all()
    assert chunks.of_systems(np.array([True, False, True]))[:2].tolist() == [0, 4]
    alone = Chunks.of(Layout.of(counts[1:2], runtime), runtime)
    assert np.array_equal(runtime.download(alone.tile), tile[1:5] - tile[1])
