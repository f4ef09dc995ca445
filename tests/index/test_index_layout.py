"""Tests of the map of a collection."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.index import layout
from spem.index.layout import lay_out


def _classes(count: int, each: int, width: float = 0.2) -> np.ndarray:
    """Return codes of classes wide apart."""
    rng = np.random.default_rng(3)
    means = rng.standard_normal((count, 32)).repeat(each, axis=0)
    return np.asarray(means + width * rng.standard_normal(means.shape))


def _own_class(places: np.ndarray, each: int) -> float:
    """Return the share of codes whose nearest place is of their class."""
    apart = np.linalg.norm(places[:, None] - places, axis=-1) + np.diag(np.full(len(places), np.inf))
    return float((apart.argmin(axis=1) // each == np.arange(len(places)) // each).mean())


def test_like_codes_lie_side_by_side() -> None:
    """Classes of codes are groups of the map, which fills the square around the origin."""
    places = lay_out(_classes(6, 15), np.random.default_rng(0))
    assert _own_class(places, 15) == 1
    assert np.abs(places).max() == pytest.approx(1)
    assert np.allclose(places.max(axis=0), -places.min(axis=0))


def test_the_map_is_the_same_again() -> None:
    """Equal codes and generators give equal maps; the codes are left as they were."""
    codes = _classes(3, 15)
    kept = codes.copy()
    assert np.array_equal(lay_out(codes, np.random.default_rng(1)), lay_out(codes, np.random.default_rng(1)))
    assert np.array_equal(codes, kept)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 4, 5])
def test_few_codes(n: int) -> None:
    """Any number of codes has places, different ones where there is more than one."""
    places = lay_out(_classes(5, 1)[:n], np.random.default_rng(0))
    assert places.shape == (n, 2)
    assert np.isfinite(places).all()
    assert len(np.unique(places.round(6), axis=0)) == n


def test_equal_and_constant_codes() -> None:
    """Codes that do not differ lie at one place."""
    for codes in (np.ones((6, 4)), np.tile(np.arange(8.0), (5, 1)), np.zeros((3, 0))):
        assert not lay_out(codes, np.random.default_rng(0)).any()


def test_landmarks_place_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the number of landmarks the other codes lie amid those of their class."""
    monkeypatch.setattr(layout, "LANDMARKS", 80)
    places = lay_out(_classes(4, 50), np.random.default_rng(0))
    assert places.shape == (200, 2)
    assert _own_class(places, 50) > 0.95


def test_codes_that_are_none() -> None:
    """What is no matrix of finite numbers is refused."""
    with pytest.raises(ParameterError, match="expected a matrix of finite numbers"):
        lay_out(np.full((3, 3), np.nan), np.random.default_rng(0))
    with pytest.raises(ParameterError, match=r"codes of shape \(3,\)"):
        lay_out(np.ones(3), np.random.default_rng(0))
