"""Limbs of silhouettes as sets of nodes, in their order along the outline; fingers of a hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.paper.perturbations import limbs
from spem.shapes.distance import signed_distance
from spem.shapes.shape import Shape

FINGERS = 5


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
    if len(found.inside) < FINGERS:
        msg = f"{shape.name}: opening finds {len(found.inside)} limbs; expected a hand with fingers apart"
        raise ParameterError(msg)
    depth = node_depth(shape)
    widths = [depth[limb].max() for limb in found.inside]
    thin = np.sort(np.argsort(widths, kind="stable")[:FINGERS])
    places = found.places[thin]
    gaps = np.diff(places, append=places[0] + 1)
    order = (np.arange(FINGERS) + gaps.argmax() + 1) % FINGERS
    first, last = gaps[order[0]], gaps[order[-2]]
    order = thin[order if last > first else order[::-1]]
    return Limbs(shape, found.inside[order], found.places[order])


def node_depth(shape: Shape) -> NDArray[np.float64]:
    """Return the distance of each node to the boundary, finer than a voxel.

    Examples
    --------
    >>> node_depth(Shape.from_mask(np.ones(3)))
    array([0.5, 1.5, 0.5])
    """
    return np.asarray(signed_distance(shape)[shape.mask])


def _places(shape: Shape, inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the middle of each limb's stretch of the outer contour, as a share of its length."""
    points = point_sources(assemble(shape, "voxel"))
    node, _ = points.system.domain.boundary_edges
    outer = points.contour == 0
    middle = np.empty(len(inside))
    for i, limb in enumerate(inside):
        mine = np.zeros(points.n_sources, bool)
        mine[points.edge_source[limb[node]]] = True
        turn = 2 * np.pi * np.flatnonzero(mine & outer) / np.count_nonzero(outer)
        middle[i] = np.angle(np.exp(1j * turn).sum()) / (2 * np.pi) % 1
    return middle
