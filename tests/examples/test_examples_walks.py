"""The walk behind the field, its transform and its way to rest, in a reduced size."""

from __future__ import annotations

import numpy as np
import pytest

from spem.paper.catalogue import choose
from spem.paper.data import Data
from spem.paper.findings import Finding


def _verdicts(finding: Finding) -> list[str]:
    return [claim.verdict for claim in finding.claims]


def test_walks_agree_with_the_solver_on_ten_shapes():
    """All intervals of ten shapes hold v at once, and those of single sources their fields."""
    (item,) = choose(["walk"])
    finding = item.make(Data(quick=True))
    counted = finding.numbers["intervals"]
    assert counted["held together"] == counted["intervals"] == 200
    assert counted["shapes held"] == 10
    assert finding.numbers["sources held"] == 200
    assert _verdicts(finding) == ["holds", "holds", "holds", "differs"]


def test_the_transform_is_an_identity_and_its_bias_falls_with_rho():
    """(3.3) to rounding; no walk is killed; the mean time to arrive falls with ρ, as counted too."""
    (item,) = choose(["transform"])
    finding = item.make(Data(quick=True))
    assert _verdicts(finding) == ["holds"] * 5
    assert finding.numbers["identity"] < 1e-13
    assert finding.numbers["falls"] == 1.0
    mean, error = finding.numbers["counted"].T
    assert (np.abs(mean - finding.numbers["time"]) < 4 * error).all()


def test_the_transient_field_settles_at_the_lowest_rate():
    """And the kernel of the transformed walk gives it, once it is summed over time."""
    (item,) = choose(["transient"])
    finding = item.make(Data(quick=True))
    assert _verdicts(finding) == ["holds", "differs", "holds", "holds", "differs"]
    for rho, rate in finding.numbers["rate"].items():
        assert finding.numbers["measured rate"][rho] == pytest.approx(rate, rel=0.01)
    assert finding.numbers["kernel"] < 1e-12
    assert finding.numbers["time"] < 1e-8
