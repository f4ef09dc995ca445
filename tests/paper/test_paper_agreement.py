"""Agreement of components, their rivals, and errors of matches."""

from __future__ import annotations

import numpy as np
import pytest

from spem.paper.agreement import agreement, beyond, own_partners
from spem.paper.correspondence import Errors
from spem.paper.reductions import METHODS, centred_components, probabilistic_components


@pytest.fixture
def components() -> np.ndarray:
    """Return independent columns."""
    return np.random.default_rng(0).normal(size=(400, 4))


def test_signs_and_scales_do_not_count(components):
    """Correlations are absolute."""
    found = agreement([components, components * [-1, 5, -0.1, 1]])
    np.testing.assert_allclose(found.means, 1)
    assert found.n_same == 4


def test_order_and_rotation_are_told_apart(components):
    """A permutation hurts only the first of the three, a rotation all but the last."""
    permuted = agreement([components, components[:, [1, 2, 3, 0]]])
    assert permuted.ordered.max() < 0.2
    np.testing.assert_allclose(permuted.matched, 1)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0]
    turned = agreement([components, components @ turn])
    assert turned.matched.mean() < 0.95
    np.testing.assert_allclose(turned.spanned, 1)


def test_partners_are_counted_over_pairs(components):
    """Two of three poses with swapped columns: a third of the ordered pairs agree."""
    swapped = components[:, [1, 0, 2, 3]]
    np.testing.assert_allclose(own_partners([components, components, swapped]), [1 / 3, 1 / 3, 1, 1])


def test_beyond_depth_nothing_is_left_of_its_functions():
    """What is constant at each depth goes, what is not stays."""
    depth = np.repeat(np.arange(5.0), 20)
    other = np.tile([-1.0, 1.0], 50)
    left = beyond(np.stack([np.exp(depth), other], axis=1), depth, 5)
    np.testing.assert_allclose(left, np.stack([0 * depth, other], axis=1), atol=1e-12)


@pytest.mark.parametrize("name", METHODS)
def test_methods_place_new_rows_among_those_they_learnt_from(name):
    """A row that was learnt from gets the same place as one that is asked for, and near rows near ones."""
    rows = np.sort(np.random.default_rng(2).uniform(size=300))[:, None] ** np.arange(1, 9)
    found = METHODS[name](rows, rows[::3], 2, np.random.default_rng(0))
    assert found.shape == (100, 2)
    assert np.isfinite(found).all()


def test_probabilistic_components_span_the_principal_ones():
    """At the maximum of likelihood, up to a rotation."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(500, 6)) * [9, 6, 4, 0.2, 0.2, 0.2]
    pair = [method(rows, rows, 3, rng) for method in (centred_components, probabilistic_components)]
    assert agreement(pair).spanned.min() > 1 - 1e-6


def test_swaps_are_matches_nearer_to_the_mirror_image():
    """Of four matches one is on the wrong side."""
    errors = Errors(np.array([0.0, 0.1, 0.9, 0.2]), np.array([0.0, 0.1, 0.05, 0.2]))
    assert errors.swapped == 0.25
    np.testing.assert_allclose(errors.within(np.array([0.1, 1.0]), exact=True), [0.5, 1.0])
    np.testing.assert_allclose(errors.within(np.array([0.1, 1.0]), exact=False), [0.75, 1.0])
