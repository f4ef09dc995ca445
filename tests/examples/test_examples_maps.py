"""Figures of the maps in a reduced size, on shapes made here."""

from __future__ import annotations

import pytest

from spem.paper.catalogue import choose
from spem.paper.data import Data
from spem.paper.findings import Finding


def made(name: str) -> Finding:
    """Run an example in its reduced size."""
    (item,) = choose([name])
    return item.make(Data(quick=True))


def test_fig9_maps_drift_from_the_original_monotonically_with_scale():
    """On a fixed range of ρ; with ρ scaled with the shape they stay what they are."""
    finding = made("fig9")
    psnr = finding.numbers["psnr_db"]
    assert (psnr[1:] < psnr[:-1]).all()
    assert finding.numbers["psnr_db_rho_scaled"].min() > 28
    assert finding.claims[0].verdict == "holds"


def test_fig10_stars_of_one_inner_radius_have_nearly_one_basis():
    """The largest angle is 73° on one circle and below 18° after rescaling."""
    finding = made("fig10")
    assert finding.numbers["largest_angle_before_deg"].max() == pytest.approx(72.7, abs=1)
    assert finding.numbers["largest_angle_after_deg"].max() == pytest.approx(16.5, abs=1)
    assert [claim.verdict for claim in finding.claims] == ["holds", "differs", "holds"]


def test_fig13_maps_are_alike_across_poses_and_mark_what_sticks_out():
    """Closer between poses than between kinds, and each map has the character that the paper tells."""
    finding = made("fig13")
    assert (finding.numbers["within_cats"] < 0.5 * finding.numbers["cats_to_others"]).all()
    assert [claim.verdict for claim in finding.claims] == ["holds"] * 5


def test_fig14_maps_of_an_altered_hand_stay_what_they_were():
    """Away from the alteration every map correlates with that of the hand itself."""
    finding = made("fig14")
    assert min(values.min() for values in finding.numbers["hand_correlation_away"].values()) > 0.95
    assert [claim.verdict for claim in finding.claims] == ["holds", "holds"]


def test_fig15_regions_of_a_solid_are_steadier_than_those_of_its_silhouette():
    """One threshold for all poses; the claims about the horse itself are not tested without it."""
    finding = made("fig15")
    assert finding.numbers["variation_solid"] < finding.numbers["variation_silhouette"]
    assert finding.numbers["threshold"]["P₂ above"] == 0
    assert [claim.verdict for claim in finding.claims] == ["not tested"] * 2


def test_fig18_joint_histograms_are_nearer_within_a_kind_than_between_kinds():
    """Creatures of fourteen kinds; what is said of SHREC'11 is not tested without it."""
    finding = made("fig18")
    assert finding.numbers["within"] < 0.6 * finding.numbers["between"]
    assert finding.numbers["nearest_of_same_class"] > 0.75
    assert [claim.verdict for claim in finding.claims] == ["not tested"] * 3


@pytest.mark.data
def test_silhouettes_of_figures_are_in_pixels_of_the_paper(data_dir):
    """Real ones too: the spacing is 1, and the deepest node lies 20 pixels from the boundary."""
    from spem.shapes.distance import signed_distance

    (hand,) = Data(data_dir).silhouettes("hand", 1).shapes
    assert hand.spacing == (1.0, 1.0)
    assert signed_distance(hand).max() == pytest.approx(20, rel=0.02)
