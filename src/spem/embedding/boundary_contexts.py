"""Boundary contexts: what each piece of a contour sees of the others through the hyperfield (2-D).

The fluxes of boundary sources hold lengths of ways through the shape, with its thickness in them. Their
change along the contour tells at which angle a way leaves it. So the matrix of fluxes is an inner distance
with directions at both ends, and its histogram a shape context that is the hyperfield's own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.embedding.boundary_response import BoundaryResponse
from spem.errors import ParameterError, ShapeError, require_kind

Array = NDArray[np.float64]
Bins = tuple[int, int, int, int]
#: Bins of length, of the angle at either end, and of the way along the contour.
DEFAULT_BINS: Bins = (4, 6, 6, 4)
# Lengths that are told apart, in units of their median.
_FARTHEST = 2.2


def boundary_contexts(response: BoundaryResponse, bins: Bins = DEFAULT_BINS) -> Array:
    """Count what each source sees by length of the way, its angle at either end, and place on the contour.

    Lengths are `BoundaryResponse.distances` over their median. The angle between a way and the contour where
    it starts is arccos(−∂d/∂s), as s goes on along the contour; beyond ρ of the source it is that of the
    shortest way. The place is the share of the contour from one source on to the other. Translation, rotation
    and scale change nothing.

    Parameters
    ----------
    response
        Fluxes between arcs of one contour in their order, at a finite ρ.
    bins
        Number of bins of length, of angle here, of angle there, and of place.

    Returns
    -------
    NDArray
        ``(n_sources, n_bins)`` shares of the boundary of the other sources; rows add up to 1.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When the sources are not of one contour or fewer than two, ρ is `inf`, or a number of bins is below 1.

    Examples
    --------
    All of a disk is seen alike from every point of its circle:

    >>> from spem.embedding.boundary_response import boundary_response
    >>> from spem.fields.boundary.patches import patch_sources
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.synthetic import disk
    >>> arcs = patch_sources(assemble(disk(1.0, 0.02)), 60)
    >>> contexts = boundary_contexts(boundary_response(arcs, 0.1), (2, 2, 2, 2))
    >>> contexts.shape, bool(np.ptp(contexts, axis=0).max() < 0.05)
    ((60, 16), True)
    """
    _check(response, bins)
    measure = response.sources.measure
    angle = departure_angles(response) / np.pi
    place = (np.cumsum(measure) - measure / 2) / measure.sum()
    columns = (_relative(response.distances) / _FARTHEST, angle, angle.T, (place - place[:, None]) % 1.0)
    cell = np.zeros(angle.shape, np.int64)
    for column, count in zip(columns, bins, strict=True):
        cell = cell * count + np.clip((column * count).astype(np.int64), 0, count - 1)
    n, size = len(cell), int(np.prod(bins))
    seen = np.broadcast_to(measure, cell.shape) * ~np.eye(n, dtype=bool)
    counted = np.bincount((cell + size * np.arange(n)[:, None]).ravel(), seen.ravel(), n * size)
    shares = counted.reshape(n, size)
    return np.asarray(shares / shares.sum(axis=1, keepdims=True))


def departure_angles(response: BoundaryResponse) -> Array:
    """Return the angle between the contour at each source and the way to each other, in [0, π].

    Parameters
    ----------
    response
        Fluxes between arcs of one contour in their order, at a finite ρ.

    Returns
    -------
    NDArray
        ``(n_sources, n_sources)``: in row p the angles at p, 0 for ways onward along the contour.

    Raises
    ------
    ShapeError, ParameterError
        As `boundary_contexts` does.

    Examples
    --------
    Across a disk the way leaves at a right angle:

    >>> from spem.embedding.boundary_response import boundary_response
    >>> from spem.fields.boundary.patches import patch_sources
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.synthetic import disk
    >>> arcs = patch_sources(assemble(disk(1.0, 0.02)), 60)
    >>> round(float(departure_angles(boundary_response(arcs, 0.1))[0, 30] / np.pi), 1)
    0.5
    """
    _check(response, DEFAULT_BINS)
    distance, measure = response.distances, response.sources.measure
    step = measure + (np.roll(measure, 1) + np.roll(measure, -1)) / 2
    slope = (np.roll(distance, -1, axis=0) - np.roll(distance, 1, axis=0)) / step[:, None]
    return np.asarray(np.arccos(np.clip(-slope, -1.0, 1.0)))


def mirror_signs(count: int, bins: Bins = DEFAULT_BINS) -> Array:
    """Return what a reflection of the shape multiplies the coefficients of `context_basis` with.

    It turns the contour round: angles a become π − a, and places s become 1 − s.

    Parameters
    ----------
    count, bins
        As `context_basis` takes them.

    Returns
    -------
    NDArray
        ``(count,)`` 1 and −1.

    Raises
    ------
    ParameterError
        When there are fewer bins than functions asked for.

    Examples
    --------
    >>> mirror_signs(5).tolist()
    [1.0, 1.0, -1.0, -1.0, -1.0]
    """
    basis = context_basis(count, bins).reshape(*bins, count)
    reflected = basis[:, ::-1, ::-1, ::-1]
    return np.asarray(np.sign(np.einsum("abcdk,abcdk->k", basis, reflected)))


def context_basis(count: int, bins: Bins = DEFAULT_BINS) -> Array:
    """Return orthonormal functions on the bins, the smoothest first: cosines, and waves around the contour.

    Parameters
    ----------
    count
        Number of functions.
    bins
        Number of bins, as `boundary_contexts` takes them.

    Returns
    -------
    NDArray
        ``(n_bins, count)``; by total degree.

    Raises
    ------
    ParameterError
        When there are fewer bins than functions asked for.

    Examples
    --------
    >>> basis = context_basis(44)
    >>> basis.shape, bool(np.allclose(basis.T @ basis, np.eye(44)))
    ((576, 44), True)
    """
    if not 1 <= count <= np.prod(bins):
        msg = f"{count} functions on {np.prod(bins)} bins: expected at least 1 and at most one for each bin"
        raise ParameterError(msg)
    values, degree = np.ones((1, 1)), np.zeros(1, np.int64)
    for kind, size in zip((_cosines, _cosines, _cosines, _waves), bins, strict=True):
        along, order = kind(size)
        values, degree = np.kron(values, along), (degree[:, None] + order).ravel()
    return np.asarray(values[:, np.argsort(degree, kind="stable")[:count]])


def _relative(distance: Array) -> Array:
    """Return distances over their median between different sources; clipped where they are infinite."""
    apart = distance[~np.eye(len(distance), dtype=bool)]
    unit = float(np.median(apart[np.isfinite(apart)])) if np.isfinite(apart).any() else 1.0
    return np.clip(distance / (unit if unit > 0 else 1.0), 0.0, _FARTHEST)


def _cosines(size: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the orthonormal cosines on so many bins, and their degrees."""
    degree = np.arange(size)
    values = np.cos(np.pi * (degree[:, None] + 0.5) * degree / size)
    return values / np.linalg.norm(values, axis=0), degree


def _waves(size: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the orthonormal periodic functions on so many bins, and their degrees."""
    degree = (np.arange(size) + 1) // 2
    phase = 2 * np.pi * (np.arange(size)[:, None] + 0.5) * degree / size
    # the highest wave of an even number of bins has the bins' centres where its cosine is zero
    sine = (np.arange(size) % 2 == 1) & (2 * degree == size) | (np.arange(size) % 2 == 0) & (degree > 0)
    values = np.where(sine, np.sin(phase), np.cos(phase))
    return values / np.linalg.norm(values, axis=0), degree


def _check(response: BoundaryResponse, bins: Bins) -> None:
    """Refuse what has no contexts."""
    require_kind(response, BoundaryResponse, "make it: boundary_response(sources, rho)")
    sources, shape = response.sources, response.sources.system.shape
    if shape.ndim != 2:
        msg = f"{shape.name}: boundary contexts are of silhouettes; this shape has {shape.ndim} dimensions"
        raise ShapeError(msg)
    if sources.n_sources < 2 or np.ptp(sources.contour):
        pieces = np.unique(sources.contour).size
        msg = (
            f"{shape.name}: {sources.n_sources} sources on {pieces} contours; give two or more of one contour"
        )
        raise ParameterError(msg)
    if not np.isfinite(response.rho):
        msg = f"{shape.name}: ways have no length at rho=inf; give a finite rho"
        raise ParameterError(msg)
    if len(bins) != len(DEFAULT_BINS) or min(bins) < 1:
        msg = f"bins={bins}: expected four numbers of at least 1, such as {DEFAULT_BINS}"
        raise ParameterError(msg)
