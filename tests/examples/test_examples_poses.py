"""Experiments on poses with known correspondence, in a reduced size, on creatures made here."""

from __future__ import annotations

from spem.paper.catalogue import choose
from spem.paper.data import Data


def test_pca_is_more_consistent_than_ica_and_probabilistic_pca():
    """In the order in which components come; a free mixture would make up for rotations."""
    (item,) = choose(["pca"])
    finding = item.make(Data(quick=True))
    assert {claim.verdict for claim in finding.claims} == {"not tested"}
    human = finding.numbers["human"]
    own = {method: told["mean"]["own order"] for method, told in human.items()}
    assert own["PCA (SPEM)"] > 0.95
    assert own["PCA (SPEM)"] > own["ICA, own starts"] + 0.2
    assert own["PCA (SPEM)"] > own["probabilistic PCA, own starts"] + 0.2
    assert human["probabilistic PCA"]["mean"]["any mixture"] > 0.9


def test_components_are_consistent_at_the_variance_of_the_claim():
    """The last component above 1e-14 correlates from pose to pose, and each has its own as its partner."""
    (item,) = choose(["variance"])
    curves = item.make(Data(quick=True)).numbers["human"]
    above = curves["share"] >= 1e-14
    assert 8 <= above.sum() <= 12
    assert curves["between poses"][above].min() > 0.8
    assert curves["own partner"][above].min() == 1.0


def test_surroundings_make_spem_values_match():
    """At most a fifth of the error by chance, and less than without them."""
    (item,) = choose(["correspondence"])
    human = item.make(Data(quick=True)).numbers["human"]
    mean = {name: told["mean, either side"] for name, told in human.items()}
    assert mean["SPEM, surroundings"] < mean["chance"] / 5
    assert mean["SPEM, surroundings"] < mean["SPEM"] / 2
