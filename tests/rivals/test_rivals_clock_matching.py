"""Clock matching: distances of views under the symmetries of the axes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from spem.rivals.clock_matching import ViewHistograms, clock_distances, count_words
from spem.rivals.view_sphere import view_permutations

N_VIEWS, N_WORDS = 66, 12


def sparse(dense: NDArray[np.int64]) -> ViewHistograms:
    """Histograms of views from their counts ``(n_views, n_words)``."""
    words = np.concatenate([np.repeat(np.arange(N_WORDS), row) for row in dense])
    return count_words(words, np.concatenate([[0], np.cumsum(dense.sum(axis=1))]))


def brute(one: NDArray[np.int64], other: NDArray[np.int64], mirrored: NDArray[np.int64]) -> float:
    """The definition, over all 48 symmetries and 66 views."""
    found = []
    for symmetry, order in enumerate(view_permutations()):
        seen = (other if symmetry < 24 else mirrored)[order]
        common, most = np.minimum(one, seen).sum(axis=1), np.maximum(one.sum(axis=1), seen.sum(axis=1))
        found.append(np.mean(1 - common / np.maximum(most, 1) - (most == 0)))
    return float(min(found))


def draw(seed: int) -> NDArray[np.int64]:
    """Counts of a few words in each view; some views have none."""
    return np.random.default_rng(seed).poisson(0.3, (N_VIEWS, N_WORDS))


def test_words_are_counted_in_each_view() -> None:
    """Dense counts come back from the sparse ones, views without words being empty."""
    dense = draw(0)
    dense[[0, 5, 65]] = 0
    found, back = sparse(dense), np.zeros_like(dense)
    view = np.repeat(np.arange(N_VIEWS), np.diff(found.starts))
    back[view, found.words] = found.counts
    assert np.array_equal(back, dense)


def test_distances_are_those_of_the_definition() -> None:
    """Sparse matching with an early end gives the least mean over all symmetries."""
    dense, mirrored = [draw(seed) for seed in range(4)], [draw(seed) for seed in range(10, 14)]
    found = clock_distances([sparse(d) for d in dense], [sparse(d) for d in mirrored], N_WORDS)
    for i in range(4):
        for j in range(i + 1, 4):
            assert found[i, j] == pytest.approx(brute(dense[i], dense[j], mirrored[j]), abs=1e-6)
    assert np.array_equal(found, found.T)
    assert not found.diagonal().any()


@pytest.mark.parametrize("symmetry", [3, 20])
def test_a_turned_shape_is_the_same(symmetry: int) -> None:
    """Views moved by a rotation of the axes are at distance zero, and without that not."""
    dense = draw(1)
    turned = np.empty_like(dense)
    turned[view_permutations()[symmetry]] = dense
    nothing = sparse(np.zeros_like(dense))
    found = clock_distances([sparse(dense), sparse(turned)], [nothing, nothing], N_WORDS)
    assert found[0, 1] == pytest.approx(0, abs=1e-6)
    swapped = dense[np.random.default_rng(2).permutation(N_VIEWS)]
    assert clock_distances([sparse(dense), sparse(swapped)], [nothing, nothing], N_WORDS)[0, 1] > 0.2


def test_a_mirrored_shape_is_the_same() -> None:
    """A reflection is found where the mirrored views of the other shape have the same words."""
    dense, mirrored = draw(3), draw(4)
    order = view_permutations()[30]
    other, mirrored_other = np.empty_like(dense), np.empty_like(dense)
    other[order], mirrored_other[order] = mirrored, dense
    found = clock_distances(
        [sparse(dense), sparse(other)], [sparse(mirrored), sparse(mirrored_other)], N_WORDS
    )
    assert found[0, 1] == pytest.approx(0, abs=1e-6)


def test_more_words_on_one_side_count_as_differences() -> None:
    """One word against two of the same is half a match."""
    once, twice = np.zeros((2, N_VIEWS, N_WORDS), np.int64)
    once[:, 0], twice[:, 0] = 1, 2
    shapes = [sparse(once), sparse(twice)]
    assert clock_distances(shapes, shapes, N_WORDS)[0, 1] == pytest.approx(0.5)
