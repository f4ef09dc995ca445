"""Measurements of interaction vectors: centred log-fields (4.1), and clipped, non-negative ones (4.2)."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.superposition.fields import SourceFields, require_fields

Centre = Literal["mean", "median"]
Over = Literal["region", "boundary"]
CENTRES = ("mean", "median")
OVERS = ("region", "boundary")


def centred_logs(
    fields: SourceFields, centre: Centre = "mean", *, over: Over = "region"
) -> NDArray[np.float64]:
    """Return the log-fields less their mean or median, V of (4.1).

    Over the region, each node is measured against the sources that reach it, as in (4.1). Over the boundary,
    where samples are sources, each source is measured against the nodes that it reaches: the strength of a
    source, its length or 1/θ, then cancels.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    centre
        ``"mean"``, which makes V zero on average, or ``"median"``, which makes half of it positive (Fig. 7).
    over
        ``"region"`` to centre each node over the sources, ``"boundary"`` each source over the nodes.

    Returns
    -------
    centred
        ``(n_sources, n_nodes)``; -inf where a source does not reach a node, never NaN.

    Raises
    ------
    ParameterError
        When `centre` or `over` is another word.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(3)), "voxel"))
    >>> centred_logs(solve_sources(sources, np.inf)).round(2)[0]
    array([ 0.55,  0.  , -0.55])
    """
    require_fields(fields)
    _check_word("centre", centre, CENTRES)
    _check_word("over", over, OVERS)
    log = fields.log
    axis = 0 if over == "region" else 1
    level = _level(log, centre, axis)
    return log - np.expand_dims(level, axis)


def measurements(
    fields: SourceFields, centre: Centre = "mean", *, over: Over = "region"
) -> NDArray[np.float64]:
    """Return the non-negative measurements Y of (4.3): centred log-fields with zeros where they are negative.

    A source that does not reach a node counts there as the weakest that reaches any, so that components of a
    shape that lie apart fall into different parts.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    centre
        ``"mean"`` or ``"median"``.
    over
        ``"region"`` for parts of the region (4.1), ``"boundary"`` for parts of the boundary (5.2), whose
        samples are the rows.

    Returns
    -------
    Y
        ``(n_sources, n_nodes)``, finite, at least 0; 0 where a source does not reach a node.

    Raises
    ------
    ParameterError
        When `centre` or `over` is another word.
    """
    require_fields(fields)
    unreached = np.isneginf(fields.log)
    if unreached.any():
        weakest = fields.log.min(where=~unreached, initial=0.0)
        fields = replace(fields, log=np.where(unreached, weakest, fields.log))
    centred = centred_logs(fields, centre, over=over)
    return np.maximum(centred, 0.0, out=centred)


def _level(log: NDArray[np.float64], centre: Centre, axis: int) -> NDArray[np.float64]:
    """Mean or median of the finite entries along an axis; 0 where there is none."""
    unreached = np.isneginf(log)
    if not unreached.any():
        return np.asarray(log.mean(axis) if centre == "mean" else np.median(log, axis))
    count = np.count_nonzero(~unreached, axis=axis)
    if centre == "mean":
        return np.asarray(np.where(unreached, 0.0, log).sum(axis) / np.maximum(count, 1))
    # -inf sorts first, so the finite entries are the last `count` of each line
    ordered = np.sort(np.moveaxis(log, axis, 0), axis=0)
    size, line = len(ordered), np.arange(count.size)
    low, high = size - count + (count - 1) // 2, size - count + count // 2
    inner = np.clip(np.stack([low, high]), 0, size - 1)
    level = (ordered[inner[0], line] + ordered[inner[1], line]) / 2
    return np.asarray(np.where(count > 0, level, 0.0))


def _check_word(name: str, value: str, words: tuple[str, ...]) -> None:
    if value not in words:
        msg = f"{name}={value!r}: expected {' or '.join(map(repr, words))}"
        raise ParameterError(msg)
