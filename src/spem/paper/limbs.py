"""Limbs of silhouettes as sets of nodes, in their order along the outline; fingers of a hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.boundary_distance import distance_to_boundary
from spem.fields.operator import assemble
from spem.paper.perturbations import limbs
from spem.shapes.shape import Shape

# Fingers of a hand; legs and tail of an animal.
CHAIN = 5


@dataclass(frozen=True, eq=False)
class Limbs:
    """Limbs of a silhouette: no field has a part in what they are.

    Parameters
    ----------
    shape
        The silhouette.
    inside
        ``(n_limbs, n_nodes)`` True at the nodes of each limb, in their order along the outline.
    places
        ``(n_limbs,)`` where each is along the outline: the middle of its stretch, as a share of the length.
    """

    shape: Shape
    inside: NDArray[np.bool_]
    places: NDArray[np.float64]

    @property
    def core(self) -> NDArray[np.bool_]:
        """``(n_nodes,)`` True at the nodes of no limb."""
        return np.asarray(~self.inside.any(axis=0))

    def tip(self, limb: int) -> int:
        """Return the node of a limb that is farthest from the middle of the core."""
        points = self.shape.points
        away = np.linalg.norm(points - points[self.core].mean(axis=0), axis=1)
        return int(np.where(self.inside[limb], away, -1.0).argmax())

    def width(self, limb: int) -> float:
        """Return the area of a limb over its length."""
        return float(self.inside[limb].sum() * np.prod(self.shape.spacing) / self.length(limb))

    def length(self, limb: int) -> float:
        """Return how far a limb reaches along the direction in which it is longest."""
        points = self.shape.points[self.inside[limb]]
        axis = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
        return float(np.ptp(points @ axis) + max(self.shape.spacing))

    def window(self, limb: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the ends, along each axis, of a box around a limb that is as high over wide as the shape."""
        points, room = self.shape.points, 2 * np.asarray(self.shape.spacing)
        mine = points[self.inside[limb]]
        low, high = mine.min(axis=0) - room, mine.max(axis=0) + room
        least, most = points.min(axis=0) - room / 4, points.max(axis=0) + room / 4
        half = (most - least) * np.max((high - low) / (most - least)) / 2
        middle = np.clip((low + high) / 2, least + half, most - half)
        (top, left), (bottom, right) = (middle - half).tolist(), (middle + half).tolist()
        return (top, bottom), (left, right)

    def touched(self, sources: Sources) -> NDArray[np.bool_]:
        """Return ``(n_limbs, n_sources)`` True for the sources beside the nodes of each limb."""
        node, _ = sources.system.domain.boundary_edges
        found = np.zeros((len(self.inside), sources.n_sources), bool)
        for row, limb in zip(found, self.inside, strict=True):
            row[sources.edge_source[limb[node]]] = True
        return found


def main_labels(labels: NDArray[np.integer], members: NDArray[np.bool_]) -> list[int]:
    """Return the label that most members of each limb have; -1 where most have none.

    Parameters
    ----------
    labels
        ``(n,)`` a part for each node or source, -1 for none.
    members
        ``(n_limbs, n)`` which of them belong to each limb.

    Examples
    --------
    >>> main_labels(np.array([0, 0, 2, 2, 2]), np.array([[1, 1, 1, 0, 0], [0, 0, 0, 1, 1]], bool))
    [0, 2]
    """
    return [int(np.bincount(labels[limb] + 1).argmax()) - 1 for limb in members]


def core_labels(labels: NDArray[np.integer], limbs: Limbs) -> list[int]:
    """Return the labels of nodes that lie for the most part in no limb."""
    found = np.unique(labels[labels >= 0])
    return [int(label) for label in found if np.mean(limbs.core[labels == label]) > 0.5]


def find_limbs(shape: Shape) -> Limbs:
    """Find the limbs of a silhouette: what opening takes away (`spem.paper.perturbations.limbs`).

    Examples
    --------
    >>> cross = np.zeros((30, 30))
    >>> cross[10:20, 10:20] = cross[13:17] = cross[:, 13:17] = 1
    >>> find_limbs(Shape.from_mask(cross)).inside.shape[0]
    4
    """
    masks = [limb[shape.mask] for limb in limbs(shape.mask)]
    inside = np.array(masks, bool).reshape(len(masks), shape.n_nodes)
    places = _places(shape, inside)
    order = np.argsort(places)
    return Limbs(shape, inside[order], places[order])


def fingers(shape: Shape) -> Limbs:
    """Return the five fingers of a hand, the little finger first and the thumb last.

    They are the thinnest limbs, for a forearm may be one. The wrist is the longest stretch of outline from
    one finger to the next; of the two beside it, the thumb is the one farther from its other neighbour.

    Raises
    ------
    ParameterError
        If there are fewer than five limbs.
    """
    found = find_limbs(shape)
    depth = distance_to_boundary(shape)
    chain = _chain(found, np.array([depth[limb].max() for limb in found.inside]))
    gaps = np.diff(chain.places) % 1
    return chain if gaps[-1] > gaps[0] else Limbs(shape, chain.inside[::-1], chain.places[::-1])


def legs_and_tail(shape: Shape) -> Limbs:
    """Return the five largest limbs of an animal seen from the side, those that head and back lie between.

    Raises
    ------
    ParameterError
        If there are fewer than five limbs.
    """
    found = find_limbs(shape)
    return _chain(found, -found.inside.sum(axis=1))


def _chain(found: Limbs, rank: NDArray[np.floating | np.integer]) -> Limbs:
    """Keep the five limbs of least rank, in their order from the longest stretch of outline without one."""
    name, count = found.shape.name, len(found.inside)
    if count < CHAIN:
        msg = f"{name}: opening finds {count} limbs; expected a silhouette with {CHAIN} or more apart"
        raise ParameterError(msg)
    kept = np.sort(np.argsort(rank, kind="stable")[:CHAIN])
    places = found.places[kept]
    gaps = np.diff(places, append=places[0] + 1)
    order = kept[(np.arange(CHAIN) + gaps.argmax() + 1) % CHAIN]
    return Limbs(found.shape, found.inside[order], found.places[order])


def _places(shape: Shape, inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the middle of each limb's stretch of the outer contour, as a share of its length."""
    points = point_sources(assemble(shape, "voxel"))
    outer = points.contour == 0
    beside = Limbs(shape, inside, np.zeros(len(inside))).touched(points) & outer
    turn = np.exp(2j * np.pi * np.arange(points.n_sources) / np.count_nonzero(outer))
    return np.asarray(np.angle(beside @ turn) / (2 * np.pi) % 1)
