"""Sums over words on a device: those of the host, in any batch and in any order of threads."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from backends import DEVICES, use_runtime
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator.runtime import ORDERS, Order

from spem.codes.bands import Bands
from spem.codes.normalise import peak_share
from spem.codes.part import Part
from spem.codes.settings import Settings
from spem.codes.vocabulary import Residuals, sum_residuals
from spem.codes.word_sums import Rows, WordSums
from spem.errors import ParameterError
from spem.fields.solvers.cuda.layout import Layout

Counts = tuple[tuple[int, int], ...]
# Red and black nodes: two chunks, a tile of each colour, one node.
COUNTS: Counts = ((1500, 1200), (100, 90), (1, 0))


class Tables:
    """Maps of a few shapes in rows as an engine holds them, with rubbish in the rows that are no nodes."""

    def __init__(
        self, device: str, shapes: list[np.ndarray], counts: Counts, order: Order = "forward"
    ) -> None:
        self.runtime = use_runtime(device, order)
        layout = Layout.of(np.array(counts, np.int64), self.runtime)
        starts = zip(np.ravel(counts), layout.first_row.ravel(), strict=True)
        rows = np.concatenate([first + np.arange(count) for count, first in starts])
        place = self.runtime.upload(rows.astype(np.int32))
        self.hierarchy = SimpleNamespace(levels=[SimpleNamespace(layout=layout)], rows=place)
        table = np.full((layout.n_rows, shapes[0].shape[1]), 7e5, np.float32)
        table[rows] = np.concatenate(shapes)
        self.maps = self.runtime.upload(table)

    def sums(self, part: Part, kept: list[np.ndarray] | None = None) -> list[Residuals]:
        """Sum over the nodes that are kept, all by default."""
        if kept is None:
            kept = [np.ones(count, bool) for count in self.hierarchy.levels[0].layout.counts.sum(axis=1)]
        return WordSums.of(part, 0, Rows.of(self, kept), self.runtime)(self.maps)


def make_shapes(counts: Counts, n_maps: int, seed: int = 0) -> list[np.ndarray]:
    """Make maps of falling strength, the first of one sign."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** -np.arange(n_maps)
    shapes = [rng.standard_normal((sum(count), n_maps)) * scale for count in counts]
    return [np.hstack([1 + np.abs(maps[:, :1]), maps[:, 1:]]).astype(np.float32) for maps in shapes]


def fit(shapes: list[np.ndarray], **options: object) -> Part:
    chosen = Settings(features="spem", n_maps=shapes[0].shape[1], **options)
    return Part.fit(chosen, [(maps,) for maps in shapes])


def on_host(part: Part, maps: np.ndarray) -> Residuals:
    cuts = part.cuts[0] if part.cuts else np.empty(0)
    levels = np.searchsorted(cuts, peak_share(maps))
    return sum_residuals(part.normalisations[0].apply(maps), part.centers[0], levels, cuts.size + 1)


def assert_close(found: Residuals, expected: Residuals) -> None:
    np.testing.assert_array_equal(found.counts, expected.counts)
    for name in ("sums", "squares"):
        assert np.allclose(getattr(found, name), getattr(expected, name), rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    "options",
    [
        {"n_centers": 16},
        {"n_centers": 10, "levels": 1, "moments": 1, "scaling": "whiten"},
        {"n_centers": 5, "levels": 3, "scaling": "deviation"},
    ],
    ids=["default", "whiten", "deviation"],
)
@pytest.mark.parametrize("n_maps", [1, 3, 8])
def test_sums_are_those_of_the_host(device: str, n_maps: int, options: dict) -> None:
    """Counts, sums and squares of each word and level agree, for all scalings."""
    shapes = make_shapes(COUNTS, n_maps)
    part = fit(shapes, **options)
    found = Tables(device, shapes, COUNTS).sums(part)
    for residuals, maps in zip(found, shapes, strict=True):
        assert_close(residuals, on_host(part, maps))


@pytest.mark.parametrize("device", DEVICES)
@given(st.integers(0, 2**31), st.sampled_from(ORDERS))
@settings(max_examples=4, deadline=None)
def test_neither_batch_nor_order_changes_a_bit(device: str, seed: int, order: Order) -> None:
    """A shape has the same sums alone as in any place of a batch, in any order of blocks and threads."""
    shapes = make_shapes(COUNTS, 4, seed)
    part = fit(shapes, n_centers=6)
    kept = [np.random.default_rng(seed).random(len(maps)) < 0.8 for maps in shapes]
    kept[2][:] = True
    together = Tables(device, shapes[::-1], COUNTS[::-1], order).sums(part, kept[::-1])[::-1]
    for maps, count, keep, expected in zip(shapes, COUNTS, kept, together, strict=True):
        [alone] = Tables(device, [maps], (count,)).sums(part, [keep])
        for name in ("counts", "sums", "squares"):
            np.testing.assert_array_equal(getattr(alone, name), getattr(expected, name))


@pytest.mark.parametrize("device", DEVICES)
def test_nodes_that_are_left_out_count_nowhere(device: str) -> None:
    """Peaks, root mean squares and sums are those of the nodes that are kept."""
    shapes = make_shapes(COUNTS, 3)
    part = fit(shapes, n_centers=6)
    kept = [np.arange(len(maps)) % 3 == 0 for maps in shapes]
    for maps, keep in zip(shapes, kept, strict=True):
        maps[~keep] *= 50
    found = Tables(device, shapes, COUNTS).sums(part, kept)
    for residuals, maps, keep in zip(found, shapes, kept, strict=True):
        assert residuals.counts.sum() == keep.sum()
        assert_close(residuals, on_host(part, np.ascontiguousarray(maps[keep])))


@pytest.mark.parametrize("device", DEVICES)
def test_maps_that_vanish_stay_zero(device: str) -> None:
    """A map that is zero on a shape is a zero feature; of equally near words the first counts."""
    shapes = make_shapes(COUNTS, 3)
    part = fit(shapes, n_centers=4)
    part.centers[0][3] = part.centers[0][1]
    shapes[0][:, 1] = 0
    shapes[1][:] = 0
    found = Tables(device, shapes, COUNTS).sums(part)
    for residuals, maps in zip(found, shapes, strict=True):
        assert_close(residuals, on_host(part, maps))
        assert not residuals.counts[3::4].any()


def test_more_maps_than_threads_are_refused() -> None:
    """Kernels have one thread a map."""
    bands: Bands = (np.zeros((1, 257), np.float32),)
    part = SimpleNamespace(centers=bands)
    with pytest.raises(ParameterError, match="n_maps=257: a device codes at most 256; take fewer"):
        WordSums.of(part, 0, None, None)
