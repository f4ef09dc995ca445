"""Figures of the fields in a reduced size, on shapes made here."""

from __future__ import annotations

import numpy as np

from spem.paper.catalogue import choose
from spem.paper.data import Data
from spem.paper.findings import Finding


def made(name: str) -> Finding:
    """Make an item in its reduced size."""
    (item,) = choose([name])
    return item.make(Data(quick=True))


def verdicts(finding: Finding) -> list[str]:
    """Verdicts of all claims."""
    return [claim.verdict for claim in finding.claims]


def test_fig1_field_grows_with_rho():
    """At every node; and a larger ρ draws on boundary that is farther away."""
    finding = made("fig1")
    assert verdicts(finding) == ["holds"] * 3
    assert finding.numbers["grows"] == 1.0
    assert (np.diff(finding.numbers["far_share"]) > 0).all()
    assert finding.numbers["middle"][0] < 0.01


def test_fig2_equally_deep_nodes_have_different_profiles():
    """Ten times more different than their distances explain, and a fifth of a pixel apart at most."""
    numbers = made("fig2").numbers
    assert numbers["times_what_distance_explains"] > 10
    assert abs(np.diff(numbers["depth"][[3, 4]])[0]) < 0.2


def test_fig3_spread_at_equal_distance_is_no_matter_of_the_band():
    """On a hand at every ρ, on a disk at none; along the exact curve too."""
    numbers = made("fig3").numbers
    for kind in ("sub-voxel", "pixel"):
        assert numbers["hand"][kind].min() > 2
        assert numbers["disk"][kind].max() < numbers["hand"][kind].min()
    assert numbers["disk"]["sub-voxel"].max() < 1.05
    assert numbers["exact"]["hand 2"] > 10 * numbers["exact"]["disk"]


def test_fig4_sum_of_both_ends_is_the_whole():
    """To rounding, and near the closed form."""
    numbers = made("fig4").numbers
    assert numbers["sum_minus_whole"].max() < 1e-13
    assert numbers["sum_minus_exact"].max() < 5e-3


def test_fig5_field_falls_along_fingers():
    """At about the rate π over the width, and twice as fast as over the palm."""
    finding = made("fig5")
    assert verdicts(finding) == ["holds"] * 3
    numbers = finding.numbers
    assert 0.7 < numbers["slope_times_width_over_pi"] < 1.4
    assert numbers["slope"]["from finger"] > 2 * numbers["slope"]["from palm"]


def test_fig6_sources_add_up_at_every_rho():
    """To rounding, for both boundary models and the Laplace equation among them."""
    finding = made("fig6")
    assert max(error.max() for error in finding.numbers["error"].values()) < 1e-12
    assert finding.numbers["rho"][-1] == np.inf


def test_fig7_measurements_keep_to_the_finger():
    """Positive on the source's own finger alone; what is ignored is far, unlike the paper says."""
    finding = made("fig7")
    assert verdicts(finding) == ["holds", "differs", "holds"]
    assert finding.numbers["positive_in_fingers"][1:] == [0.0] * 4
    assert abs(finding.numbers["positive"]["median"] - 0.5) < 1e-3


def test_speed_counts_fields_of_a_small_shape():
    """A field takes far less than the paper's two seconds, but a small shape is no test of that."""
    finding = made("speed")
    assert verdicts(finding) == ["not tested"] * 2
    assert finding.numbers["per_field"] < 1.0
