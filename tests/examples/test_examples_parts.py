"""Figures of parts in a reduced size, on shapes made here."""

from __future__ import annotations

from spem.paper.catalogue import choose
from spem.paper.data import Data
from spem.paper.findings import Finding


def made(name: str) -> Finding:
    """Make an item in its reduced size."""
    (item,) = choose([name])
    return item.make(Data(quick=True))


def test_fig8_every_finger_has_a_component():
    """Of its own, among six and among twelve."""
    numbers = made("fig8").numbers
    assert numbers["own"]["k6"] == numbers["own"]["k12"] == 5
    assert min(within for _, within in numbers["overlap"]) > 0.5


def test_fig11_limbs_have_boundary_parts_and_regions():
    """The same part on the boundary and inside, whose points are alike."""
    finding = made("fig11")
    assert [claim.verdict for claim in finding.claims] == ["holds"] * 2
    assert finding.numbers["alike_within"] > 2 * finding.numbers["alike_between"]


def test_fig12_limbs_keep_their_numbers():
    """In three poses of an animal divided together; each has a segment of its own divided by itself."""
    numbers = made("fig12").numbers
    assert numbers["agreement"]["together"] == 1
    assert numbers["own"] == [5, 5, 5]
