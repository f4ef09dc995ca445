"""Left and right of solids: exchanged numbers are put back, and nothing else is touched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spem.decomposition.handedness import settle_hands
from spem.decomposition.parts import Parts
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape

TRUNK, HEAD, FRONT_LEFT, FRONT_RIGHT, HIND_LEFT, HIND_RIGHT = range(6)


def animal(lift: int = 0, *, turned: int = 0) -> Parts:
    """A trunk, a head and four legs, the front ones moved by some voxels; turned about the upright axis."""
    labels = np.full((40, 24, 30), -1)
    labels[4:32, 6:18, 12:22] = TRUNK
    labels[32:38, 9:15, 18:28] = HEAD
    legs = {FRONT_LEFT: (26 + lift, 6), FRONT_RIGHT: (26 - lift, 14), HIND_LEFT: (5, 6), HIND_RIGHT: (5, 14)}
    for part, (x, y) in legs.items():
        labels[x : x + 4, y : y + 4, 2:12] = part
    labels = np.rot90(labels, turned)
    system = assemble(Shape.from_mask(labels >= 0), "voxel")
    sources, node_labels = point_sources(system), labels[labels >= 0].astype(np.int32)
    nothing = np.zeros((6, sources.n_sources)), np.full(sources.n_sources, -1, np.int32)
    components = np.zeros((6, system.n_nodes))
    return Parts(sources, np.inf, "region", components, nothing[0], node_labels, nothing[1], np.ones(6))


def mixed(parts: Parts, *pairs: tuple[int, int]) -> Parts:
    """The same parts with the numbers of some pairs exchanged."""
    order = np.arange(6)
    for i, j in pairs:
        order[[i, j]] = order[[j, i]]
    return parts.relabelled(order)


FRONT, HIND = (FRONT_LEFT, FRONT_RIGHT), (HIND_LEFT, HIND_RIGHT)


@pytest.mark.parametrize("pairs", [(), (FRONT,), (HIND,), (FRONT, HIND)])
@pytest.mark.parametrize("turned", [0, 1, 2, 3])
def test_exchanged_legs_are_put_back(pairs, turned):
    """Whichever pairs were exchanged, and whichever way the animal looks, its legs keep their sides."""
    walking = animal(2, turned=turned)
    settled = settle_hands([animal(), mixed(walking, *pairs)], 0)
    assert np.array_equal(settled[1].node_labels, walking.node_labels)


def test_the_reference_keeps_its_numbers():
    """The sides that count are those of the reference."""
    odd = mixed(animal(), FRONT)
    settled = settle_hands([odd, animal(1)], 0)
    assert settled[0] is odd
    assert np.array_equal(settled[1].node_labels, mixed(animal(1), FRONT).node_labels)


def test_parts_that_are_no_pair_are_left_alone():
    """A head and a trunk with exchanged numbers are another mistake, and none that a mirror mends."""
    wrong = mixed(animal(), (TRUNK, HEAD))
    assert np.array_equal(settle_hands([animal(), wrong], 0)[1].node_labels, wrong.node_labels)


def test_missing_parts_do_no_harm():
    """A pose without a part, and one alone, come back as they are."""
    lame = replace(
        animal(), node_labels=np.where(animal().node_labels == HIND_LEFT, -1, animal().node_labels)
    )
    assert np.array_equal(settle_hands([animal(), lame], 0)[1].node_labels, lame.node_labels)
    assert settle_hands([lame], 0) == (lame,)


def test_silhouettes_may_be_seen_from_either_side():
    """In two dimensions nothing is exchanged."""
    mask = np.zeros((20, 30), bool)
    mask[8:12, 4:26] = mask[2:8, 6:9] = mask[12:18, 6:9] = True
    labels = np.zeros(mask.shape, np.int32)
    labels[2:8, 6:9], labels[12:18, 6:9] = 1, 2
    sources = point_sources(assemble(Shape.from_mask(mask), "voxel"))
    nothing = np.zeros((3, sources.n_sources)), np.full(sources.n_sources, -1, np.int32)
    one = Parts(
        sources, np.inf, "region", np.zeros((3, mask.sum())), nothing[0], labels[mask], nothing[1], np.ones(3)
    )
    other = one.relabelled([0, 2, 1])
    assert settle_hands([one, other], 0)[1] is other
