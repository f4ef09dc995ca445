"""SPEM beside signatures of heat and waves, in a reduced size, on shapes made here."""

from __future__ import annotations

import numpy as np
import pytest

from spem.paper.catalogue import choose
from spem.paper.data import Collection, Data
from spem.paper.scoring import Features
from spem.paper.spectra import collect_kinds, score_kinds, shared_variance
from spem.shapes.creatures import collection


@pytest.fixture(scope="module")
def creatures():
    """Return four shapes of two classes."""
    pairs = collection(n_per_class=2, kinds=["hand", "fish"], voxels=300, rng=np.random.default_rng(0))
    shapes, labels = zip(*pairs, strict=True)
    return Collection("creatures", shapes, labels, "", real=False)


def test_spectra_scores_all_kinds():
    """Each kind finds more of the classes of creatures than chance; nothing is said of the collections."""
    (item,) = choose(["spectra"])
    finding = item.make(Data(quick=True))
    assert [claim.verdict for claim in finding.claims[1:]] == ["not tested", "not tested"]
    assert [picture.name for picture in finding.pictures] == ["signatures", "scores"]
    scores = finding.numbers["creatures"]["scores"]
    assert list(scores) == ["spem", "hks", "si-hks", "wks"]
    assert all(row["mean"]["FT"] > 50 for row in scores.values())
    assert scores["spem"]["mean"]["NN"] > 80


def test_fewer_features_are_those_of_the_kind(creatures):
    """Those of nested kinds are the first, and every kind gives as many as are asked for."""
    made = collect_kinds(creatures, (2, 4), voxels=300, n_pairs=20)
    for (kind, count), features in made.items():
        assert all(bands[0].shape[1] == count for bands in features.bands)
        if kind in ("spem", "si-hks"):
            assert np.array_equal(features.bands[0][0], made[kind, 4].bands[0][0][:, :count])


def test_rival_is_the_best_of_the_others(creatures):
    """By first tier at a number of features."""
    found = score_kinds(creatures, (2,), 1, voxels=300, n_pairs=20, n_centers=4)
    kind, best = found.rival(2)
    assert kind != "spem"
    assert best == max(tier[2] for name, tier in found.tiers.items() if name != "spem")
    label, ours, theirs = found.most_apart(kind)
    gains = [found.rows[k].scores[0].per_class() for k in (kind, "spem")]
    assert theirs - ours == max(gains[0][each]["FT"] - gains[1][each]["FT"] for each in ("hand", "fish"))
    assert label in ("hand", "fish")


def test_shared_variance_weighs_features():
    """A feature that is not explained counts as much as one that is, or by its variance; constants do not."""
    rng = np.random.default_rng(0)
    known, other = np.linspace(-1, 1, 400), rng.standard_normal(400)
    wanted = np.stack([known + 5, 0.01 * other, np.ones(400)], axis=1)
    one, two = (Features(((values,),), ("a",)) for values in (known[:, None], wanted))
    assert shared_variance(one, two, equal=True) == pytest.approx(0.5, abs=0.02)
    assert shared_variance(one, two, equal=False) == pytest.approx(1.0, abs=0.01)
