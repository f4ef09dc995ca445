"""Boundary parts of an animal against its legs and tail, in one pose and from pose to pose (Fig. 12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.parts import Parts
from spem.paper.limbs import legs_and_tail, main_labels


@dataclass(frozen=True, eq=False)
class Segments:
    """Where the boundary parts of one pose lie.

    Parameters
    ----------
    labels
        ``(5,)`` the part of legs and tail, in their order along the outline.
    places
        ``(k,)`` the limb that most of each part lies on, -1 for the trunk; -2 where the pose lacks the part.
    intensity
        ``(k,)`` of each part, in units of the mean.
    """

    labels: list[int]
    places: NDArray[np.int64]
    intensity: NDArray[np.float64]

    @classmethod
    def of(cls, parts: Parts) -> Segments:
        """Look up the parts of a silhouette."""
        limbs = legs_and_tail(parts.shape).touched(parts.sources)
        where = np.where(limbs.any(axis=0), limbs.argmax(axis=0), -1)
        places = np.full(parts.n_parts, -2)
        for part in np.unique(parts.source_labels[parts.source_labels >= 0]):
            places[part] = _most(where[parts.source_labels == part])
        labels = main_labels(parts.source_labels, limbs)
        return cls(labels, places, parts.intensity * parts.n_parts)

    @property
    def own(self) -> int:
        """How many limbs have a part of their own, most of which lies on them."""
        return sum(self.places[label] == limb for limb, label in enumerate(self.labels))

    @property
    def on_trunk(self) -> int:
        """How many parts lie on no limb."""
        return int(np.count_nonzero(self.places == -1))


def agreement(several: Sequence[Segments]) -> float:
    """Return the share of limbs that have the number that most poses give them, over all poses."""
    table = np.array([segments.labels for segments in several])
    return float(np.mean(table == [_most(column) for column in table.T]))


def odd_segments(several: Sequence[Segments]) -> list[float]:
    """Return the intensities of the segments that lie elsewhere than in most poses."""
    places = np.array([segments.places for segments in several])
    usual = np.array([_most(column[column > -2]) for column in places.T])
    return [float(several[i].intensity[j]) for i, j in np.argwhere((places != usual) & (places > -2))]


def _most(values: NDArray[np.int64]) -> int:
    """Return the most frequent of some numbers from -1."""
    return int(np.bincount(values + 1).argmax()) - 1
