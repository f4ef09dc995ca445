"""Node values on their way into a picture: their number, their scale, and what can be drawn at all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from spem.errors import ParameterError, ShapeError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape


def require_drawable(shape: Shape) -> None:
    """Raise a `ShapeError` unless the shape has one, two or three dimensions.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> require_drawable(Shape.from_mask(np.ones((2, 2))))
    """
    if shape.ndim > 3:
        msg = (
            f"{shape.name}: shapes of 1, 2 and 3 dimensions can be drawn, this one has {shape.ndim};"
            " draw a section of it, Shape.from_mask(shape.mask[..., k])"
        )
        raise ShapeError(msg)


def node_values(shape: Shape, values: ArrayLike) -> NDArray[np.float64]:
    """Return values as an array, one a node.

    Raises
    ------
    ParameterError
        If there is not one value for each node.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> node_values(Shape.from_mask([1, 1]), [1, 2])
    array([1., 2.])
    """
    nodal = np.asarray(values, np.float64)
    if nodal.shape != (shape.n_nodes,):
        msg = f"{shape.name}: values must be ({shape.n_nodes},), one a node, not {nodal.shape}"
        raise ParameterError(msg)
    return nodal


def value_limits(values: ArrayLike, *, symmetric: bool) -> tuple[float, float]:
    """Return the values at the ends of the colour map; about zero where `symmetric`.

    Examples
    --------
    >>> value_limits([-1.0, 3.0], symmetric=True)
    (-3.0, 3.0)
    """
    finite = np.asarray(values, np.float64)
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    if symmetric:
        reach = max(abs(low), abs(high)) or 1.0
        return -reach, reach
    return low, high if high > low else low + 1.0


def node_columns(shape: Shape, values: ArrayLike) -> NDArray[np.float64]:
    """Return values as ``(n_nodes, n_columns)``.

    Raises
    ------
    ShapeError
        If the shape has too many dimensions to be drawn.
    ParameterError
        If there is not one row for each node.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> node_columns(Shape.from_mask([1, 1]), [1, 2]).shape
    (2, 1)
    """
    require_drawable(shape)
    array = np.asarray(values, np.float64)
    array = array[:, None] if array.ndim == 1 else array
    if array.ndim != 2 or len(array) != shape.n_nodes:
        msg = f"{shape.name}: values must be ({shape.n_nodes}, k), a row for each node, not {array.shape}"
        raise ParameterError(msg)
    return array
