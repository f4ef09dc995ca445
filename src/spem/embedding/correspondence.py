"""Corresponding nodes of two shapes, by SPEM values and what surrounds them (4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from spem.embedding.maps import Maps
from spem.errors import ParameterError, require_kind
from spem.fields.operator import assemble
from spem.fields.solvers.multifrontal import factorize
from spem.fields.spectrum import free_system
from spem.shapes.shape import Shape

# Lengths of surroundings in units of L = volume^(1/d): a limb's width, a limb, half the body.
LENGTHS = (0.1, 0.3, 0.9)


def correspond(
    source: Maps, target: Maps, nodes: ArrayLike | None = None, *, lengths: Sequence[float] = LENGTHS
) -> NDArray[np.int64]:
    """Find for nodes of one shape the nodes of another that look the same to SPEM.

    The maps of each shape are standardised and averaged over the surroundings of each node, as
    `surroundings` has it; then the nearest node in that space is taken. The maps know nothing of left and
    right: a node may be taken for its mirror image.

    Parameters
    ----------
    source, target
        Maps of the two shapes, as many of both. Ten and more separate nodes better than six do.
    nodes
        ``(n,)`` nodes of the source to match; all by default.
    lengths
        Radii ρ of the surroundings in units of each shape's size, `Shape.size`.

    Returns
    -------
    matched
        ``(n,)`` node of the target for each.

    Raises
    ------
    ParameterError
        If the numbers of maps differ, a length is not positive, or there is no such node.

    Examples
    --------
    >>> import spem
    >>> wedge = Shape.from_mask(np.tri(30)[:, :12])
    >>> maps = spem.maps(wedge, 6, rtol=1e-9)
    >>> correspond(maps, maps, [3, 200]).tolist()
    [3, 200]
    """
    for maps in (source, target):
        require_kind(maps, Maps, "make maps of both shapes: spem.maps(shape, 10)")
    features = [surroundings(maps.shape, standardised(maps.values), lengths) for maps in (source, target)]
    return match_nodes(features[0] if nodes is None else features[0][_numbers(nodes, source)], features[1])


def surroundings(shape: Shape, values: ArrayLike, lengths: Sequence[float] = LENGTHS) -> NDArray[np.float64]:
    """Average node values over the surroundings of each node, and standardise the averages.

    An average weighs a node by how likely a random walk ends there that is reflected at the boundary and
    killed at the rate 1/ρ²: (−Δ + 1/ρ²) u = f/ρ² with no flow through the boundary. A node then knows which
    part it is in, however alike two parts look from close up.

    Parameters
    ----------
    shape
        Any shape.
    values
        ``(n_nodes, n)`` values, or ``(n_nodes,)``.
    lengths
        ρ in units of the shape's size, `Shape.size`.

    Returns
    -------
    averages
        ``(n_nodes, n * len(lengths))``, each column of mean 0 and deviation 1, or 0 where it is constant.

    Raises
    ------
    ParameterError
        If there is not one finite value for each node, or a length is not positive.

    Examples
    --------
    >>> rod = Shape.from_mask(np.ones(4))
    >>> surroundings(rod, [0, 0, 0, 1], [1.0])[:, 0].round(2).tolist()
    [-1.04, -0.68, 0.16, 1.56]
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    columns = _columns(shape, values)
    if not np.size(lengths) or not all(0 < length < np.inf for length in lengths):
        msg = f"lengths={tuple(lengths)}: expected positive lengths, in units of the shape's size"
        raise ParameterError(msg)
    whole = assemble(shape)
    # M weighs nodes beside the surface less: matches across poses are then nearer than with equal weights
    system = replace(free_system(whole), mass=whole.mass)
    averages = []
    for length in lengths:
        rate = (length * shape.size) ** -2.0
        averages.append(factorize(system, rate).solve(rate * system.mass[:, None] * columns))
    return standardised(np.hstack(averages))


def standardised(values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return columns with mean 0 and deviation 1 over the nodes; those that are constant become 0.

    Examples
    --------
    >>> standardised(np.array([[1.0, 5.0], [3.0, 5.0]])).tolist()
    [[-1.0, 0.0], [1.0, 0.0]]
    """
    centred = np.asarray(values, np.float64) - values.mean(axis=0, dtype=np.float64)
    deviation = centred.std(axis=0)
    scale = np.abs(values).max(axis=0, initial=0.0)
    level = deviation > np.finfo(np.float64).eps * scale
    return np.asarray(np.where(level, centred / np.where(level, deviation, 1.0), 0.0))


def match_nodes(source: ArrayLike, target: ArrayLike) -> NDArray[np.int64]:
    """Find the row of the target that is nearest to each row of the source.

    Parameters
    ----------
    source
        ``(n, n_features)`` features of nodes of one shape.
    target
        ``(m, n_features)`` features of nodes of another.

    Returns
    -------
    matched
        ``(n,)`` rows of `target`.

    Raises
    ------
    ParameterError
        If the features are not numbers, or not as many in both.

    Examples
    --------
    >>> match_nodes([[0.1], [2.2]], [[2.0], [0.0]]).tolist()
    [1, 0]
    """
    own, other = np.asarray(source, np.float64), np.asarray(target, np.float64)
    if own.ndim != 2 or other.ndim != 2 or own.shape[1] != other.shape[1] or not other.size:
        msg = f"features of shapes {own.shape} and {other.shape}: expected (n, k) and (m, k) of one k"
        raise ParameterError(msg)
    if not (np.isfinite(own).all() and np.isfinite(other).all()):
        msg = "features hold NaN or inf; expected finite numbers for all nodes"
        raise ParameterError(msg)
    return np.asarray(KDTree(other).query(own)[1], np.int64)


def _columns(shape: Shape, values: ArrayLike) -> NDArray[np.float64]:
    """Node values as columns, one row a node."""
    nodal = np.asarray(values, np.float64)
    columns = nodal[:, None] if nodal.ndim == 1 else nodal
    if columns.ndim != 2 or len(columns) != shape.n_nodes:
        msg = f"{shape.name}: values must be ({shape.n_nodes}, n), one row a node, not {nodal.shape}"
        raise ParameterError(msg)
    if not np.isfinite(columns).all():
        msg = f"{shape.name}: values hold NaN or inf; expected finite numbers at all nodes"
        raise ParameterError(msg)
    return columns


def _numbers(nodes: ArrayLike, maps: Maps) -> NDArray[np.int64]:
    """Node numbers of a shape."""
    numbers, count = np.asarray(nodes), maps.shape.n_nodes
    if numbers.ndim != 1 or numbers.dtype.kind not in "iu" or (numbers.size and numbers.min() < 0):
        msg = f"{maps.shape.name}: nodes={nodes!r}: expected (n,) numbers of nodes"
        raise ParameterError(msg)
    if numbers.size and numbers.max() >= count:
        msg = f"{maps.shape.name}: there is no node {numbers.max()}, expected 0 to {count - 1}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)
