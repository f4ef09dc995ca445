"""The heat kernel on the nodes of a shape (3.5), and the diffusion distance that it makes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.spectrum import Spectrum

Array = NDArray[np.float64]


def heat_kernel(spectrum: Spectrum, time: float, sources: ArrayLike) -> Array:
    """Return the heat that reaches each node a time after a unit of it was at a source.

    p_t(x, q) = Σ exp(−λ_k t) φ_k(x) φ_k(q), (3.5). As a function of x it is the heat kernel map Θ_q.

    Parameters
    ----------
    spectrum
        Eigenpairs of the shape. Those that are left out matter for times below about 9/λ of the last.
    time
        t, in length².
    sources
        ``(n_sources,)`` nodes q, or one.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_sources)`` in 1/length^d.

    Raises
    ------
    ParameterError
        When the time is not positive, or a source is no node.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> heat = heat_kernel(spem.solve_spectrum(disk), 4.0, [0, 5])
    >>> heat.sum(axis=0).round(6).tolist()
    [1.0, 1.0]
    """
    require_kind(spectrum, Spectrum, "make it: spem.solve_spectrum(shape)")
    nodes = _nodes(spectrum, sources)
    weight = np.exp(-spectrum.values * positive([time], "time")[0])
    return np.asarray((spectrum.vectors * weight) @ spectrum.vectors[nodes].T)


def diffusion_distance(spectrum: Spectrum, time: float, sources: ArrayLike) -> Array:
    """Return how differently heat spreads from each node and from a source.

    D_t(x, q)² = ∫ (p_t(x, y) − p_t(q, y))² dy = Σ exp(−2 λ_k t) (φ_k(x) − φ_k(q))².

    Parameters
    ----------
    spectrum, time, sources
        As `heat_kernel` has them.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_sources)`` in 1/length^(d/2).

    Raises
    ------
    ParameterError
        When the time is not positive, or a source is no node.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> distance = diffusion_distance(spem.solve_spectrum(disk), 4.0, 7)
    >>> distance.shape == (disk.n_nodes, 1), float(distance[7, 0])
    (True, 0.0)
    """
    require_kind(spectrum, Spectrum, "make it: spem.solve_spectrum(shape)")
    nodes = _nodes(spectrum, sources)
    embedded = spectrum.vectors * np.exp(-spectrum.values * positive([time], "time")[0])
    columns = [np.linalg.norm(embedded - embedded[node], axis=1) for node in nodes]
    return np.stack(columns, axis=1)


def positive(values: ArrayLike, name: str) -> Array:
    """Return an array of positive finite numbers.

    Raises
    ------
    ParameterError
        When it is anything else.

    Examples
    --------
    >>> positive([1, 2], "times")
    array([1., 2.])
    """
    try:
        numbers = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim != 1 or not numbers.size or not (np.isfinite(numbers) & (numbers > 0)).all():
        msg = f"{name}={values!r}: expected positive finite numbers"
        raise ParameterError(msg)
    return numbers


def _nodes(spectrum: Spectrum, sources: ArrayLike) -> NDArray[np.int64]:
    """Check numbers of nodes."""
    nodes, count = np.atleast_1d(sources), spectrum.shape.n_nodes
    fits = nodes.ndim == 1 and nodes.size and nodes.dtype.kind in "iu"
    if not fits or nodes.min() < 0 or nodes.max() >= count:
        msg = f"sources={sources!r}: expected numbers of nodes, 0 to {count - 1}"
        raise ParameterError(msg)
    return nodes.astype(np.int64)
