"""Options of views: numbers that came over the wire, and the grid that all views of a shape share."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, ShapeError
from spem.server.views.shape_key import ShapeKey
from spem.shapes.rescale import to_voxel_budget
from spem.shapes.shape import Shape

Options: TypeAlias = Mapping[str, Any]
Reply: TypeAlias = tuple[dict[str, Any], dict[str, NDArray[Any]]]

# A body of a few megabytes, which a browser multiplies in 10 ms.
MOST_NODES = 60_000
_LIMITS = (100, 2_000_000)
# Where limbs or sheets fall between the nodes of a coarser grid, more of the volume is lost.
_VOLUME_CHANGE = 0.25


def whole_option(options: Options, name: str, default: int, least: int, most: int) -> int:
    """Return an option that is a whole number.

    Parameters
    ----------
    options
        The options by name.
    name
        Which one.
    default
        Its value where it is absent or None.
    least, most
        Its range.

    Raises
    ------
    ParameterError
        When it is no whole number of the range.

    Examples
    --------
    >>> whole_option({"k": 3}, "k", 8, 1, 12), whole_option({}, "k", 8, 1, 12)
    (3, 8)
    """
    value = options.get(name)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        msg = f"{name}={value!r}: expected a whole number from {least} to {most}"
        raise ParameterError(msg)
    return int(value)


def shown_shape(shape: Shape, options: Options) -> Shape:
    """Return the shape whose nodes all views have: a coarser one where it has more than ``max_nodes``.

    Examples
    --------
    >>> fine = Shape.from_mask(np.ones((40, 40)))
    >>> shown_shape(fine, {"max_nodes": 400}).n_nodes, shown_shape(fine, {}) is fine
    (400, True)
    """
    most = whole_option(options, "max_nodes", MOST_NODES, *_LIMITS)
    return coarser_shape(shape, most)


def coarser_shape(shape: Shape, n_nodes: int) -> Shape:
    """Return a shape of so many nodes; itself where it has no more, or would lose its thin parts.

    The last ones are kept, for several views of a shape are asked for in a row.

    Examples
    --------
    >>> coarser_shape(Shape.from_mask(np.ones((40, 40))), 400).n_nodes
    400
    """
    if shape.n_nodes <= n_nodes:
        return shape
    coarse = _resampled(ShapeKey.of(shape), n_nodes)
    return shape if coarse is None else coarse


@lru_cache(maxsize=4)
def _resampled(key: ShapeKey, n_nodes: int) -> Shape | None:
    """Return the coarser shape, None where too much of it would be lost."""
    try:
        coarse = to_voxel_budget(key.shape, n_nodes)
    except ShapeError:
        return None
    return coarse if abs(coarse.volume / key.shape.volume - 1) < _VOLUME_CHANGE else None


def plain_length(rho: float) -> float | str:
    """Return ρ as JSON has it, which has no number for infinity.

    Examples
    --------
    >>> plain_length(2.0), plain_length(np.inf)
    (2.0, 'inf')
    """
    return float(rho) if np.isfinite(rho) else "inf"


def indices(values: NDArray[Any]) -> NDArray[Any]:
    """Return whole numbers in two bytes where they fit, else in four.

    Examples
    --------
    >>> indices(np.array([-1, 7])).dtype, indices(np.array([70_000])).dtype
    (dtype('int16'), dtype('int32'))
    """
    largest = np.iinfo(np.int16).max
    return values.astype(np.int16 if not values.size or values.max() <= largest else np.int32)
