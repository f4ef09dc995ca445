"""The maps of a collection as encoders take them: for each shape one array a band of ρ, checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError

Bands: TypeAlias = tuple[NDArray[np.floating], ...]


def as_bands(entry: Any, name: str = "shape") -> Bands:
    """Check the maps of one shape.

    Parameters
    ----------
    entry
        ``(n_nodes, n_maps)`` maps of one band, ``(n_nodes,)`` for a single map, or a tuple of
        such arrays over the same nodes, one a band.
    name
        What to call the shape in messages.

    Returns
    -------
    Bands
        For each band ``(n_nodes, n_maps)`` finite values in float32 or float64, uncopied where
        they were that already.

    Raises
    ------
    ParameterError
        When the maps are empty, not finite, complex, or differ in their nodes.

    Examples
    --------
    >>> as_bands([1, 2, 3])[0].shape
    (3, 1)
    """
    bands = tuple(_as_maps(maps, name) for maps in (entry if isinstance(entry, tuple) else (entry,)))
    counts = [len(maps) for maps in bands]
    if len(set(counts)) != 1:
        msg = f"the bands of {name} have {counts} nodes; give maps over the same nodes, at least one band"
        raise ParameterError(msg)
    return bands


def iterate_bands(shapes: Iterable[Any], expected: tuple[int, ...] | None = None) -> Iterator[Bands]:
    """Check the maps of one shape after the other; nothing is kept, so a generator will do.

    Parameters
    ----------
    shapes
        One entry a shape, as `as_bands` takes it.
    expected
        Number of maps in each band; those of the first shape when None.

    Yields
    ------
    Bands
        The maps of each shape.

    Raises
    ------
    ParameterError
        When there is no shape, or shapes differ in their bands.

    Examples
    --------
    >>> [len(maps) for maps, in iterate_bands([np.ones((4, 2)), np.ones((7, 2))])]
    [4, 7]
    """
    if hasattr(shapes, "toarray"):
        msg = "got a sparse matrix; give a sequence with one dense array of maps a shape"
        raise ParameterError(msg)
    index = -1
    for index, entry in enumerate(shapes if hasattr(shapes, "__iter__") else np.asarray(shapes)):
        bands = as_bands(entry, f"shape {index}")
        found = tuple(maps.shape[1] for maps in bands)
        expected = expected or found
        if found != expected:
            msg = f"shape {index} has {found} maps in its bands, expected {expected}"
            raise ParameterError(msg)
        yield bands
    if index < 0:
        msg = "got 0 shapes; give a sequence with one array of maps a shape"
        raise ParameterError(msg)


def _as_maps(maps: Any, name: str) -> NDArray[np.floating]:
    """Check one band: two dimensions, real, floating, finite, not empty."""
    values = np.asarray(maps)
    if np.iscomplexobj(values):
        msg = f"Complex data not supported: the maps of {name} must be real"
        raise ParameterError(msg)
    if values.ndim == 0:
        msg = f"Reshape your data: the maps of {name} are a single number, not (n_nodes, n_maps)"
        raise ParameterError(msg)
    values = values[:, None] if values.ndim == 1 else values
    if values.ndim != 2 or 0 in values.shape:
        msg = f"the maps of {name} must be (n_nodes, n_maps), at least one of each, not {np.shape(maps)}"
        raise ParameterError(msg)
    if values.dtype not in (np.float32, np.float64):
        values = values.astype(np.float64)
    if not np.isfinite(values).all():
        msg = f"the maps of {name} contain NaN or inf; they must be finite"
        raise ParameterError(msg)
    return values
