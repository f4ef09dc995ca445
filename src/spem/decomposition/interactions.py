"""Correlations of interaction vectors: between nodes, between boundary sources, and between both (4.1).

The interaction vector of a node holds log v^{p_i} at it for every source i; that of a source, at every node.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.superposition.fields import SourceFields, require_fields

# Two vectors need this many shared entries for a correlation to mean anything.
_FEWEST = 3
# A vector of logs whose deviations are shorter than this is constant to rounding.
_CONSTANT = 1e-9
# Sums of squares that lose more than this share to the mean are rounding.
_CANCELLED = 1e-12
# Numbers of one block of vectors: 32 MiB.
_BLOCK = 2**22

_Vectors = Callable[[NDArray[np.int64]], NDArray[np.float64]]


def node_correlation(
    fields: SourceFields, nodes: ArrayLike, others: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Correlate the interaction vectors of interior nodes over the sources.

    Centring the log-field by (4.1) changes nothing here. Sources that do not reach both nodes are left out;
    where fewer than three reach both, as between components, or a vector is constant, the correlation is 0.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    nodes
        One node or an array of them.
    others
        Nodes to correlate them with; all by default, in blocks, so that one node gives a map on the shape.

    Returns
    -------
    correlation
        ``nodes.shape + others.shape``, from -1 to 1; for one node and no others ``(n_nodes,)``.

    Raises
    ------
    ParameterError
        If there is no such node.

    Examples
    --------
    >>> import spem
    >>> fields = spem.source_fields(spem.sources(spem.Shape.from_mask(np.ones((2, 9)))), np.inf)
    >>> node_correlation(fields, 0, [0, 3, 8]).round(2)
    array([ 1.  ,  0.57, -0.98])
    """
    require_fields(fields)
    count = fields.log.shape[1]
    return _correlate(
        _node_vectors(fields),
        _numbers(fields, "node", nodes, count),
        _node_vectors(fields),
        _numbers(fields, "node", others, count),
    )


def source_correlation(
    fields: SourceFields, sources: ArrayLike, others: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Correlate the interaction vectors of boundary sources over the nodes.

    They are rows of the centred log-field (4.1): without it all would be alike, since every field is low
    where the shape is thin. Nodes that either source does not reach are left out, as in `node_correlation`.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    sources
        One source or an array of them.
    others
        Sources to correlate them with; all by default.

    Returns
    -------
    correlation
        ``sources.shape + others.shape``, from -1 to 1; for one source and no others ``(n_sources,)``.

    Raises
    ------
    ParameterError
        If there is no such source.

    Examples
    --------
    >>> import spem
    >>> fields = spem.source_fields(spem.sources(spem.Shape.from_mask(np.ones(9))), np.inf)
    >>> source_correlation(fields, 0).round(3)
    array([ 1., -1.])
    """
    require_fields(fields)
    log, count = fields.log, fields.log.shape[0]
    finite = np.isfinite(log)
    reaching = np.maximum(np.count_nonzero(finite, axis=0), 1)
    level = np.sum(log, axis=0, where=finite) / reaching

    def rows(chosen: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.asarray(log[chosen] - level)

    return _correlate(
        rows, _numbers(fields, "source", sources, count), rows, _numbers(fields, "source", others, count)
    )


def source_node_correlation(
    fields: SourceFields, sources: ArrayLike, nodes: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Correlate boundary sources with interior nodes, over the sources.

    A boundary source stands for the point where it lies: its vector is `boundary_interactions`, the limit of
    the interaction vectors of nodes that approach it.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    sources
        One source or an array of them.
    nodes
        Nodes to correlate them with; all by default, in blocks.

    Returns
    -------
    correlation
        ``sources.shape + nodes.shape``, from -1 to 1; for one source and no nodes ``(n_nodes,)``.

    Raises
    ------
    ParameterError
        If there is no such source or node.

    Examples
    --------
    >>> import spem
    >>> brick = spem.Shape.from_mask(np.ones((2, 9)))
    >>> fields = spem.source_fields(spem.sources(brick), np.inf)
    >>> nearest = source_node_correlation(fields, 0).argmax()
    >>> bool(np.linalg.norm(brick.points[nearest] - fields.sources.position[0]) < 1)
    True
    """
    require_fields(fields)
    return _correlate(
        lambda chosen: boundary_interactions(fields, chosen),
        _numbers(fields, "source", sources, fields.log.shape[0]),
        _node_vectors(fields),
        _numbers(fields, "node", nodes, fields.log.shape[1]),
    )


def boundary_interactions(fields: SourceFields, sources: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the logarithm of what flows through each source of the field of every other.

    With b^{p_i} the right-hand side of source i, k_ij = b^{p_i}ᵀ v^{p_j} = Σ v^{p_j}(x)/(θ h²) over its
    boundary edges. For j ≠ i that is the slope of v^{p_j} at p_i: the limit, up to one constant,
    of the interaction vectors of nodes that approach p_i. It is symmetric.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    sources
        ``(k,)`` sources i; all by default.

    Returns
    -------
    log_k
        ``(k, n_sources)``; -inf where source j does not reach source i.

    Raises
    ------
    ParameterError
        If there is no such source.

    Examples
    --------
    >>> import spem
    >>> fields = spem.source_fields(spem.sources(spem.Shape.from_mask(np.ones(3)), boundary="voxel"), np.inf)
    >>> np.exp(boundary_interactions(fields))
    array([[0.75, 0.25],
           [0.25, 0.75]])
    """
    require_fields(fields)
    chosen = _numbers(fields, "source", sources, fields.log.shape[0]).ravel()
    rhs = fields.sources.rhs
    result = np.empty((chosen.size, fields.log.shape[0]))
    for row, source in zip(result, chosen, strict=True):
        edges = slice(rhs.indptr[source], rhs.indptr[source + 1])
        terms = fields.log[:, rhs.indices[edges]] + np.log(rhs.data[edges])
        np.logaddexp.reduce(terms, axis=1, out=row)
    return result


def _node_vectors(fields: SourceFields) -> _Vectors:
    """Give the interaction vectors of nodes as rows."""
    return lambda chosen: np.ascontiguousarray(fields.log[:, chosen].T)


def _numbers(fields: SourceFields, what: str, given: ArrayLike | None, count: int) -> NDArray[np.int64]:
    """Return numbers of nodes or of sources as an array of any shape; all for None."""
    numbers = np.arange(count) if given is None else np.asarray(given)
    if numbers.size and (numbers.dtype.kind not in "iu" or not 0 <= numbers.min() <= numbers.max() < count):
        name = fields.sources.system.shape.name
        stray = numbers if numbers.dtype.kind not in "iu" else numbers[(numbers < 0) | (numbers >= count)]
        msg = f"{name}: {what} {np.ravel(stray)[0]}, expected a whole number from 0 to {count - 1}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)


def _correlate(
    left: _Vectors, rows: NDArray[np.int64], right: _Vectors, columns: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Correlate every vector of one kind with every one of another, block by block."""
    result = np.empty((rows.size, columns.size))
    across, down = columns.ravel(), rows.ravel()
    for start in _blocks(left, down):
        first = left(down[start])
        for stop in _blocks(right, across):
            result[start, stop] = _pearson(first, right(across[stop]))
    return result.reshape(rows.shape + columns.shape)


def _blocks(vectors: _Vectors, chosen: NDArray[np.int64]) -> list[slice]:
    """Cut numbers into blocks whose vectors stay small."""
    if not chosen.size:
        return []
    step = max(1, _BLOCK // max(vectors(chosen[:1]).size, 1))
    return [slice(i, i + step) for i in range(0, chosen.size, step)]


def _pearson(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlate rows with rows over the entries that are finite in both; 0 where too few are, or constant."""
    a, share_a = _centred(a)
    b, share_b = _centred(b)
    if share_a is None and share_b is None:
        return np.clip(_unit(a) @ _unit(b).T, -1, 1)
    wa = np.ones(a.shape) if share_a is None else share_a
    wb = np.ones(b.shape) if share_b is None else share_b
    count = np.maximum(wa @ wb.T, 1)
    sum_a, sum_b = a @ wb.T, wa @ b.T
    square_a, square_b = np.square(a) @ wb.T, wa @ np.square(b).T
    spread_a, spread_b = square_a - sum_a**2 / count, square_b - sum_b**2 / count
    least_a, least_b = (np.maximum(_CANCELLED * square, _CONSTANT**2) for square in (square_a, square_b))
    kept = (count >= _FEWEST) & (spread_a > least_a) & (spread_b > least_b)
    scale = np.sqrt(np.where(kept, spread_a * spread_b, 1.0))
    return np.clip(np.where(kept, (a @ b.T - sum_a * sum_b / count) / scale, 0.0), -1, 1)


def _centred(vectors: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Take its mean from each row; entries that are not finite become 0, and a mask of 0 and 1 tells them."""
    finite = np.isfinite(vectors)
    if finite.all():
        return vectors - vectors.mean(axis=1, keepdims=True), None
    known = np.where(finite, vectors, 0.0)
    level = known.sum(axis=1, keepdims=True) / np.maximum(finite.sum(axis=1, keepdims=True), 1)
    return np.where(finite, known - level, 0.0), finite.astype(np.float64)


def _unit(centred: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale rows to length one; those too short to tell become zero."""
    length = np.linalg.norm(centred, axis=1, keepdims=True)
    enough = centred.shape[1] >= _FEWEST
    kept = (length > _CONSTANT) & enough
    return np.asarray(np.divide(centred, length, out=np.zeros_like(centred), where=kept))
