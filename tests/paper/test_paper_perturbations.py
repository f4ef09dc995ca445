"""Altered silhouettes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from spem.errors import ShapeError
from spem.paper.data import Data
from spem.paper.perturbations import conditions, instances, limbs, noisy, protruded, shortened, without


@pytest.fixture(scope="module")
def hand() -> np.ndarray:
    return np.pad(Data().silhouettes("hand", 2, inner_radius=10).shapes[1].mask, 30)


def test_a_hand_has_five_limbs_largest_first(hand):
    """They are disjoint parts of the hand, each in one piece."""
    found = limbs(hand)
    assert len(found) == 5
    assert np.sum(found, axis=0).max() == 1
    assert all((limb <= hand).all() and ndimage.label(limb)[1] == 1 for limb in found)
    assert sorted((int(limb.sum()) for limb in found), reverse=True) == [int(limb.sum()) for limb in found]


def test_a_limb_is_taken_off_whole_or_shortened(hand):
    """What is left is in one piece; a shortened limb keeps its root."""
    finger = limbs(hand)[0]
    assert not (without(hand, finger) & finger).any()
    short = shortened(hand, [finger])
    assert 0.2 < (short & finger).sum() / finger.sum() < 0.9
    assert ndimage.label(short)[1] == 1


def test_protrusions_are_added_and_nothing_else(hand):
    """The hand is as it was, and two pieces stick out."""
    grown = protruded(hand, 2, np.random.default_rng(0))
    assert (grown >= hand).all()
    assert ndimage.label(grown & ~hand)[1] == 2


def test_noise_moves_the_boundary_alone(hand):
    """Pixels deep inside and far outside stay."""
    altered = noisy(hand, 0.04, np.random.default_rng(0))
    changed = altered ^ hand
    level = ndimage.distance_transform_edt(hand) + ndimage.distance_transform_edt(~hand)
    assert changed.any()
    assert level[changed].max() < 4


def test_instances_and_conditions_follow_from_the_seed(hand):
    """The same state of chance alters a hand in the same way."""
    for make in (instances, conditions):
        once, again = (make(hand, np.random.default_rng(7)) for _ in range(2))
        assert all((once[name] == again[name]).all() for name in once)


def test_a_disk_has_no_limbs_to_alter():
    """So it has no instances of a hand."""
    y, x = np.mgrid[:40, :40]
    with pytest.raises(ShapeError, match="without limbs"):
        instances((y - 20) ** 2 + (x - 20) ** 2 < 150, np.random.default_rng(0))
