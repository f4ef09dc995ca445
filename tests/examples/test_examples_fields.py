"""Figures of the fields in a reduced size, on shapes made here."""

from __future__ import annotations

from spem.paper.catalogue import choose
from spem.paper.data import Data


def test_fig1_field_grows_with_rho():
    """At every node, so that a larger ρ carries the boundary further inward."""
    (item,) = choose(["fig1"])
    finding = item.make(Data(quick=True))
    assert [claim.verdict for claim in finding.claims] == ["holds"]
    assert (finding.numbers["least"][1:] > finding.numbers["least"][:-1]).all()
