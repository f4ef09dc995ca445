"""Where one label ends and another begins: smooth, crisp, and true to the label of every node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from spem.fields.domain import surface_domain
from spem.plots.values import node_values

if TYPE_CHECKING:
    from typing import Self

    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

# Rounds of averaging with the neighbours, which take the stairs off borders.
ROUNDS = 4
# By how much the label of a node outweighs any other there after the averaging.
LEAST = 0.1


@dataclass(frozen=True, eq=False)
class Borders:
    """How much each label weighs at each node; the heaviest one rules, between nodes too.

    Parameters
    ----------
    shape
        The shape.
    values
        ``(n_labels,)`` the labels that occur, ascending.
    weights
        ``(n_nodes, n_labels)``; at a node its own label weighs most.
    """

    shape: Shape
    values: NDArray[np.int32]
    weights: NDArray[np.float64]

    @classmethod
    def of(cls, shape: Shape, node_labels: ArrayLike) -> Self:
        """Smooth the labels of the nodes along the shape, not across its gaps.

        Parameters
        ----------
        shape
            A shape of any dimension.
        node_labels
            ``(n_nodes,)`` whole numbers.

        Raises
        ------
        ParameterError
            If there is not one label for each node.

        Examples
        --------
        >>> from spem.shapes.shape import Shape
        >>> borders = Borders.of(Shape.from_mask([1, 1]), [3, 8])
        >>> borders.at([[1.4], [1.6]]).tolist()
        [3, 8]
        """
        labels = node_values(shape, node_labels).astype(np.int32)
        values, number = np.unique(labels, return_inverse=True)
        rows, number = np.arange(labels.size), number.reshape(-1)
        weights = np.zeros((labels.size, values.size))
        weights[rows, number] = 1.0
        mean = _mean_of_neighbours(shape)
        for _ in range(ROUNDS):
            weights = (weights + mean @ weights) / 2
        own = weights[rows, number].copy()
        weights[rows, number] = -np.inf
        other = weights.max(axis=1) if values.size > 1 else np.zeros(labels.size)
        weights[rows, number] = np.maximum(own, other + LEAST)
        return cls(shape, values.astype(np.int32), weights)

    def weigh(self, index: ArrayLike) -> NDArray[np.float64]:
        """Return the ``(n, n_labels)`` weights at grid indices ``(n, d)``, fractions allowed.

        Examples
        --------
        >>> from spem.shapes.shape import Shape
        >>> Borders.of(Shape.from_mask([1, 1]), [0, 0]).weigh([[1.5]]).tolist()
        [[1.0]]
        """
        weighed: NDArray[np.float64] = (
            _interpolation(self.shape, np.asarray(index, np.float64)) @ self.weights
        )
        return weighed

    def at(self, index: ArrayLike) -> NDArray[np.int32]:
        """Return the ``(n,)`` label that rules at grid indices ``(n, d)``, fractions allowed.

        Examples
        --------
        >>> from spem.shapes.shape import Shape
        >>> Borders.of(Shape.from_mask([1, 1]), [0, 5]).at([[2.7]])
        array([5], dtype=int32)
        """
        return np.asarray(self.values[self.weigh(index).argmax(axis=1)])


def _mean_of_neighbours(shape: Shape) -> csr_array:
    """Matrix that replaces each node's value by the mean of its neighbours; alone, it keeps its own."""
    n = shape.n_nodes
    neighbours = surface_domain(shape).neighbours
    node, direction = np.nonzero(neighbours < n)
    count = np.bincount(node, minlength=n)
    alone = np.flatnonzero(count == 0)
    row = np.concatenate([node, alone])
    column = np.concatenate([neighbours[node, direction], alone])
    return csr_array((1.0 / np.maximum(count, 1)[row], (row, column)), shape=(n, n))


def _interpolation(shape: Shape, index: NDArray[np.float64]) -> csr_array:
    """Matrix of multilinear interpolation from the inside nodes around a point; else the nearest node."""
    n, d = index.shape
    number = np.full(shape.mask.size, -1, np.int64)
    number[shape.voxels] = np.arange(shape.n_nodes)
    low = np.clip(np.floor(index), 0, np.array(shape.mask.shape) - 2).astype(np.int64)
    part = np.clip(index - low, 0.0, 1.0)
    node = np.empty((n, 2**d), np.int64)
    share = np.ones((n, 2**d))
    for corner in range(2**d):
        bits = (corner >> np.arange(d)) & 1
        node[:, corner] = number[np.ravel_multi_index(tuple((low + bits).T), shape.mask.shape)]
        share[:, corner] = np.prod(np.where(bits, part, 1 - part), axis=1)
    share[node < 0] = 0.0
    total = share.sum(axis=1)
    lost = np.flatnonzero(total < 1e-9)
    if lost.size:
        at = np.asarray(shape.origin) + index[lost] * np.asarray(shape.spacing)
        node[lost, 0] = KDTree(shape.points).query(at)[1]
        share[lost, 0] = total[lost] = 1.0
    row, at_corner = np.nonzero(share)
    value = share[row, at_corner] / total[row]
    return csr_array((value, (row, node[row, at_corner])), shape=(n, shape.n_nodes))
