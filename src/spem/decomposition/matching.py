"""Parts of separately divided shapes, matched by what each part is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from spem.decomposition.handedness import settle_hands
from spem.decomposition.matched import MatchedParts
from spem.decomposition.part_graph import PartGraph, part_graph
from spem.decomposition.parts import Parts
from spem.errors import ParameterError

Array = NDArray[np.float64]

# Rounds of exchanging the numbers of two parts; each lowers the cost, and few are ever needed.
_ROUNDS = 50


def match_parts(
    parts: Sequence[Parts], features: Sequence[Array] | None = None, *, reference: int | None = None
) -> MatchedParts:
    """Give like parts of several shapes like numbers.

    Parts are alike when their sizes and mean features are, and when they lie to one another alike: at like
    distances inside the shape. Each shape is matched with the reference by assignment on both, then left
    and right of solids are settled by where parts lie.

    Parameters
    ----------
    parts
        Parts of each shape, of any number.
    features
        For each shape, ``(n_nodes, n_features)`` values that mean the same on all shapes, such as SPEM maps.
    reference
        Number of the shape whose numbering is kept; by default the one that the others match best.

    Returns
    -------
    MatchedParts
        Where a shape has more parts than the reference, those left over come last.

    Raises
    ------
    ParameterError
        When there are no parts, or features do not fit them.

    Examples
    --------
    >>> import spem
    >>> pin = np.zeros((12, 40))
    >>> pin[5:8] = pin[:, :12] = 1
    >>> one, other = (spem.parts(spem.Shape.from_mask(m), 2) for m in (pin, pin[:, ::-1]))
    >>> swapped = other.relabelled([1, 0])
    >>> matched = match_parts([one, swapped]).parts[1]
    >>> bool(np.array_equal(matched.node_labels, other.node_labels))
    True
    """
    _check(parts, features, reference)
    values: Sequence[Array | None] = [None] * len(parts) if features is None else features
    graphs = _on_one_scale([part_graph(p, f) for p, f in zip(parts, values, strict=True)])
    candidates = range(len(parts)) if reference is None else [reference]
    solved = {r: [_match(graphs[r], g) for g in graphs] for r in candidates}
    chosen = min(solved, key=lambda r: (sum(cost for _, cost in solved[r]), r))
    n_numbers = max(p.n_parts for p in parts)
    matches, costs = zip(*solved[chosen], strict=True)
    found = [p.relabelled(_order(m, p.n_parts, n_numbers)) for p, m in zip(parts, matches, strict=True)]
    return MatchedParts(settle_hands(found, chosen), chosen, np.array(costs))


def _on_one_scale(graphs: Sequence[PartGraph]) -> list[PartGraph]:
    """Scale each trait to variance 1 / n_traits and distances to mean square 1, over all shapes."""
    traits = np.concatenate([g.traits for g in graphs])
    spread = traits.std(axis=0)
    factor = np.where(spread > 0, 1 / np.where(spread > 0, spread, 1.0), 0.0) / np.sqrt(traits.shape[1])
    square = np.concatenate([np.square(g.distances).ravel() for g in graphs]).mean()
    unit = 1 / np.sqrt(square) if square > 0 else 1.0
    return [PartGraph(g.traits * factor, g.distances * unit) for g in graphs]


def _match(first: PartGraph, second: PartGraph) -> tuple[NDArray[np.int64], float]:
    """``(k,)`` part of the second for each of the first, -1 for none, and the cost; best of some starts."""
    if len(first.traits) > len(second.traits):
        back, cost = _match(second, first)
        match = np.full(len(first.traits), -1)
        match[back] = np.arange(back.size)
        return match, cost
    difference = np.square(first.traits[:, None] - second.traits).sum(axis=2)
    anchor = int(np.argmax(first.traits[:, 0]))
    best, least = np.empty(0, np.int64), np.inf
    for partner in range(len(second.traits)):
        known = np.square(first.distances[:, anchor, None] - second.distances[partner])
        match = linear_sum_assignment(difference + known)[1]
        match, cost = _improve(match, difference, first.distances, second.distances)
        if cost < least - 1e-12:
            best, least = match, cost
    return best, float(least)


def _improve(
    match: NDArray[np.int64], difference: Array, a: Array, b: Array
) -> tuple[NDArray[np.int64], float]:
    """Exchange partners, and take free ones, while that lowers the cost."""

    def cost_of(chosen: NDArray[np.int64]) -> float:
        pairs = np.square(a - b[np.ix_(chosen, chosen)]).mean()
        return float(difference[np.arange(chosen.size), chosen].mean() + pairs)

    cost = cost_of(match)
    # every partner, free ones last: exchanging two entries covers both moves
    line = np.concatenate([match, np.setdiff1d(np.arange(b.shape[0]), match)])
    for _ in range(_ROUNDS):
        before = cost
        for i in range(match.size):
            for j in range(i + 1, line.size):
                line[[i, j]] = line[[j, i]]
                changed = cost_of(line[: match.size])
                if changed < cost - 1e-12:
                    cost = changed
                else:
                    line[[i, j]] = line[[j, i]]
        if cost == before:
            break
    return line[: match.size], cost


def _order(match: NDArray[np.int64], n_own: int, n_numbers: int) -> NDArray[np.int64]:
    """For each new number the old one: matched parts, then those without a match, then none."""
    left = np.setdiff1d(np.arange(n_own), match)
    order = np.full(n_numbers, -1, np.int64)
    order[: match.size] = match
    order[match.size : match.size + left.size] = left
    return order


def _check(parts: Sequence[Parts], features: Sequence[Array] | None, reference: int | None) -> None:
    """Refuse what cannot be matched."""
    if not parts:
        msg = "no parts: expected the parts of one shape or several"
        raise ParameterError(msg)
    if reference is not None and not 0 <= reference < len(parts):
        msg = f"reference={reference}: expected the number of a shape, 0 to {len(parts) - 1}"
        raise ParameterError(msg)
    if features is None:
        return
    if len(features) != len(parts):
        msg = (
            f"features of {len(features)} shapes for parts of {len(parts)}: expected one array for each shape"
        )
        raise ParameterError(msg)
    width = np.shape(features[0])[-1:]
    for p, values in zip(parts, features, strict=True):
        if np.ndim(values) != 2 or np.shape(values) != (p.node_labels.size, *width):
            expected = f"({p.node_labels.size}, {', '.join(map(str, width))})"
            msg = f"{p.shape.name}: features of shape {np.shape(values)}: expected {expected}, one row a node"
            raise ParameterError(msg)
        if not np.isfinite(values).all():
            msg = f"{p.shape.name}: features must be finite; leave out or fill what is not"
            raise ParameterError(msg)
