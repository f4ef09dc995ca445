"""Nodal domains, their moments and classification in a reduced size, on creatures."""

from __future__ import annotations

import pytest

from spem.paper.catalogue import choose
from spem.paper.data import Data
from spem.paper.findings import Finding


def found(name: str) -> Finding:
    (item,) = choose([name])
    return item.make(Data(quick=True))


def test_fig16_clusters_have_one_near_zero():
    """Between a negative and a positive one, for every projection but the first."""
    finding = found("fig16")
    clusters = finding.numbers["clusters"][1:]
    assert (clusters[:, 0] < 0).all()
    assert (clusters[:, 2] > 0).all()
    assert finding.numbers["middle"].max() < 0.15
    assert len(finding.pictures[0].figure.axes) == 7 * 5


def test_fig17_nodal_domains_tell_more_than_silhouettes():
    """Moments of nine projections classify better than those of the silhouette, and than the first alone."""
    finding = found("fig17")
    curves = finding.numbers["all"]
    nine = curves["stacked"][-1][0]
    assert nine > curves["binary"][0] + 5
    assert nine > curves["single"][0][0]
    assert len(curves["single"]) == len(curves["stacked"]) == 9
    assert {claim.verdict for claim in finding.claims} == {"not tested"}


def test_classification_by_codes_and_moments():
    """Creatures are told apart, silhouettes and meshes; no claim on a collection is judged."""
    finding = found("classification")
    assert finding.numbers["codes and moments"]["mean"] > 85
    assert finding.numbers["meshes, 10 for training"]["mean"] > 85
    assert {claim.verdict for claim in finding.claims} == {"not tested"}
    assert all("--data" in claim.note for claim in finding.claims)


@pytest.mark.data
def test_fig17_on_some_real_silhouettes(data_dir):
    """The reduced size on real shapes says that it is one."""
    (item,) = choose(["fig17"])
    finding = item.make(Data(data_dir, quick=True))
    assert finding.numbers["all"]["stacked"][-1][0] > finding.numbers["all"]["binary"][0]
    assert {claim.note for claim in finding.claims} == {"A reduced size; run it in full."}
