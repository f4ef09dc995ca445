"""Boundary parts against legs and tail."""

from __future__ import annotations

import numpy as np

from spem.decomposition.parts import Parts
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.paper.data import Data
from spem.paper.limbs import legs_and_tail
from spem.paper.segments import Segments, agreement, odd_segments
from spem.paper.silhouettes import SMALL, chosen


def divided(order: list[int], missing: int | None = None) -> Segments:
    """Parts of an animal that are its limbs, numbered in some order, and its trunk, numbered 5."""
    dog = chosen(Data(), "cat", inner_radius=SMALL).shapes[0]
    sources = point_sources(assemble(dog, "voxel"))
    limbs = legs_and_tail(dog).touched(sources)
    label = np.where(limbs.any(axis=0), np.array(order)[limbs.argmax(axis=0)], 5).astype(np.int32)
    label[label == missing] = 5
    ones = np.ones((6, sources.n_sources))
    nodes = np.zeros(dog.n_nodes, np.int32)
    intensity = np.array([0.3, 0.2, 0.2, 0.1, 0.1, 0.1])
    return Segments.of(Parts(sources, np.inf, "boundary", ones, ones, nodes, label, intensity))


def test_limbs_with_parts_of_their_own():
    """Five if each is a part, and the trunk is left; one less where two belong together."""
    whole = divided([0, 1, 2, 3, 4])
    assert (whole.own, whole.on_trunk) == (5, 1)
    assert divided([0, 1, 2, 3, 4], missing=3).own == 4


def test_agreement_counts_limbs_with_their_usual_number():
    """All of them among equals; two of fifteen are wrong where one pose swaps two."""
    usual, swapped = divided([0, 1, 2, 3, 4]), divided([1, 0, 2, 3, 4])
    assert agreement([usual, usual]) == 1
    assert agreement([usual, usual, swapped]) == 13 / 15


def test_odd_segments_tell_their_intensity():
    """Those that were swapped, in units of the mean."""
    usual, swapped = divided([0, 1, 2, 3, 4]), divided([1, 0, 2, 3, 4])
    assert odd_segments([usual, usual]) == []
    assert np.allclose(odd_segments([usual, usual, swapped]), [1.8, 1.2])
