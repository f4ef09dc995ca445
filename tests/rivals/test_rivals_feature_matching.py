"""Counting matching features."""

from __future__ import annotations

import numpy as np
import pytest

import spem.rivals.feature_matching as matching
from spem.rivals.feature_matching import count_matches


def _features(n: int, rng: np.random.Generator) -> np.ndarray:
    """Return random unit vectors."""
    rows = rng.normal(size=(n, 20)).astype(np.float32)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _slow(one: np.ndarray, two: np.ndarray, ratio: float) -> int:
    """Count by the definition."""
    angles = np.arccos(np.clip(one @ two.T, -1, 1))
    count = 0
    for i, row in enumerate(angles):
        j = int(np.argmin(row))
        column = angles[:, j]
        mutual = np.argmin(column) == i
        clear = row[j] < ratio * np.sort(row)[1] and column[i] < ratio * np.sort(column)[1]
        count += bool(mutual and clear)
    return count


def test_counts_follow_the_definition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts are those of the definition, whatever the size of the blocks."""
    rng = np.random.default_rng(0)
    base = _features(12, rng)
    shapes = [base, base[4:] + 0.1 * _features(8, rng), _features(9, rng), np.empty((0, 20), np.float32)]
    shapes = [rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9) for rows in shapes]
    counts = count_matches(shapes, 0.8)
    assert (counts == counts.T).all()
    assert counts[0, 1] == _slow(shapes[0], shapes[1], 0.8) == 8
    assert counts[0, 2] == _slow(shapes[0], shapes[2], 0.8)
    assert not counts[3].any()
    monkeypatch.setattr(matching, "_BLOCK", 100)
    assert (count_matches(shapes, 0.8) == counts).all()


def test_repeated_features_do_not_match() -> None:
    """A feature whose two nearest are equally near is ambiguous and does not count."""
    rng = np.random.default_rng(1)
    base = _features(5, rng)
    assert count_matches([base, np.concatenate([base, base])], 0.8)[0, 1] == 0
