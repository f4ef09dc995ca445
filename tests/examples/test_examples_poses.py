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
