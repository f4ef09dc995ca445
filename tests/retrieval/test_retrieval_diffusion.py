"""Diffusion re-ranking."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from spem.errors import ParameterError
from spem.retrieval.diffusion import rerank
from spem.retrieval.evaluation import evaluate


def _moons(rng: np.random.Generator) -> tuple[np.ndarray, list[int]]:
    """Return distances of two interleaved half circles, and which half each point is of."""
    angle = rng.uniform(0, np.pi, 60)
    upper = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([upper, [1.0, 0.35] - upper]) + 0.03 * rng.normal(size=(120, 2))
    return cdist(points, points), [0] * 60 + [1] * 60


def test_follows_manifolds() -> None:
    """Half circles that wind around each other come apart, as they do not by distance."""
    distances, labels = _moons(np.random.default_rng(0))
    assert evaluate(distances, labels).mean()["FT"] < 85
    assert evaluate(rerank(distances), labels).mean()["FT"] > 95


@given(seed=st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_permutation_equivariant(seed: int) -> None:
    """Shapes in another order have the same distances in that order."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3))
    distances, order = cdist(points, points), rng.permutation(30)
    expected = rerank(distances, n_neighbours=4)[np.ix_(order, order)]
    np.testing.assert_allclose(rerank(distances[np.ix_(order, order)], n_neighbours=4), expected, atol=1e-9)


@given(seed=st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_a_query_stays_first(seed: int) -> None:
    """The diagonal is zero, the matrix symmetric, and no other shape is nearer than the query itself."""
    distances = np.random.default_rng(seed).random((20, 20))
    reranked = rerank(distances, n_neighbours=3)
    assert not reranked.diagonal().any()
    assert (reranked >= 0).all()
    np.testing.assert_allclose(reranked, reranked.T, atol=1e-12)


def test_blocks_keep_their_order() -> None:
    """Classes far apart stay apart, and shapes of other classes keep the order they had."""
    rng = np.random.default_rng(1)
    centres = np.array([0.0, 10.0, 25.0, 45.0])
    points = (centres[:, None] + rng.random((4, 6))).reshape(-1, 1)
    distances = cdist(points, points)
    reranked = rerank(distances, n_neighbours=3)
    block = np.repeat(np.arange(4), 6)
    same = block[:, None] == block
    assert reranked[same].max() < 1 <= reranked[~same].min()
    for row, values, mine in zip(distances, reranked, same, strict=True):
        np.testing.assert_array_equal(np.argsort(values[~mine]), np.argsort(row[~mine]))


def test_copies_are_not_divided_by() -> None:
    """Shapes with more copies than neighbours are no reason for nan."""
    distances = np.ones((9, 9)) - np.kron(np.eye(3), np.ones((3, 3)))
    reranked = rerank(distances, n_neighbours=2)
    assert np.isfinite(reranked).all()
    assert reranked[0, 1] < reranked[0, 3]
    assert np.isfinite(rerank(np.zeros((4, 4)), n_neighbours=2)).all()


def test_given_distances_stay() -> None:
    """The caller's matrix is not changed."""
    distances = np.random.default_rng(2).random((8, 8))
    before = distances.copy()
    rerank(distances, n_neighbours=2)
    np.testing.assert_array_equal(distances, before)


@pytest.mark.parametrize(
    ("distances", "options", "match"),
    [
        (np.zeros((2, 3)), {}, "square"),
        (np.full((12, 12), np.nan), {}, "nan or infinity, first in row 0"),
        (np.zeros((5, 5)), {"n_neighbours": 5}, "n_neighbours 5, expected 1 to 4"),
        (np.zeros((5, 5)), {"n_neighbours": 2.5}, "n_neighbours=2.5 must be a whole number"),
        (np.zeros((12, 12)), {"weight": 1.0}, "weight 1.0"),
    ],
)
def test_bad_input_is_refused(distances: np.ndarray, options: dict[str, float], match: str) -> None:
    """Matrices and parameters out of range are named."""
    with pytest.raises(ParameterError, match=match):
        rerank(distances, **options)  # type: ignore[arg-type]
