"""Level curves, distances and geodesics of the examples in a reduced size, on shapes made here."""

from __future__ import annotations

from spem.paper.catalogue import choose
from spem.paper.data import Data


def test_levels_expansion_and_smoothing():
    """What (2.1) leaves out falls with ρ² and, without the curvature, more slowly; curves are smoothed."""
    (item,) = choose(["levels"])
    finding = item.make(Data(quick=True))
    with_term, without = finding.numbers["order"]["disk"]
    assert 1.9 < with_term < 2.4
    assert 1.0 < without < 1.4
    assert [claim.verdict for claim in finding.claims] == ["holds"] * 4


def test_distance_is_the_limit_of_small_rho():
    """The mean error falls with ρ on every shape, on a rectangle faster than on a disk."""
    (item,) = choose(["distance"])
    finding = item.make(Data(quick=True))
    assert [claim.verdict for claim in finding.claims] == ["holds"] * 3
    assert all((mean[1:] < mean[:-1]).all() for mean in finding.numbers["mean"].values())
    assert 0.9 < finding.numbers["rates"]["disk"] < 1.2 < finding.numbers["rates"]["rectangle"]


def test_geodesics_are_followed_for_small_rho_alone():
    """Values tend to the inner distance as ρ falls, and directions turn to the ways."""
    (item,) = choose(["geodesics"])
    finding = item.make(Data(quick=True))
    values, towards, _, medial = finding.claims
    assert (values.verdict, towards.verdict, medial.verdict) == ("holds", "differs", "holds")
    medians = finding.numbers["angle"]["U"][:, 0]
    assert 25 < medians[0] < 35
    assert (medians[1:] < medians[:-1]).all()
    assert finding.numbers["fast marching, voxels"] < 0.6
