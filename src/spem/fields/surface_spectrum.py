"""Eigenvalues and eigenvectors of the Laplace-Beltrami operator of a surface, by linear finite elements."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.errors import ConvergenceError, ParameterError, ShapeError, require_kind
from spem.fields.solvers.blas import one_thread
from spem.fields.spectrum import eigenvector_signs
from spem.shapes.remeshing import subdivide
from spem.shapes.surface import Surface

Array = NDArray[np.float64]
# Up to here, or with fewer vertices for each pair, a dense factorisation takes less time than the iteration.
_DENSE_NODES, _DENSE_SHARE = 400, 3
# Of a surface of unit area, whose first values above zero are of order one to ten.
_SHIFT = 1.0
# Pairs beyond those wanted: the iteration on one vector finds copies of the last multiple values late.
_SPARE = 20


@dataclass(frozen=True, eq=False)
class SurfaceSpectrum:
    """The lowest eigenpairs of the Laplace-Beltrami operator of a surface.

    Parameters
    ----------
    surface
        The surface; its vertices carry the eigenvectors. With too few of them it is the subdivided one.
    values
        ``(n_pairs,)`` eigenvalues λ, ascending, in 1/length²; as many are zero as it has parts.
    vectors
        ``(n_vertices, n_pairs)`` eigenvectors φ, in 1/length: of unit L2 norm over the surface.
    name
        Short name for messages.
    """

    surface: Surface
    values: Array
    vectors: Array
    name: str = "surface"

    @property
    def n_pairs(self) -> int:
        """Number of eigenpairs."""
        return self.values.size

    @property
    def ndim(self) -> int:
        """Dimension of a surface: two."""
        return 2

    @property
    def size(self) -> float:
        """Root of the area: a length."""
        return float(np.sqrt(self.surface.area))

    def truncated(self, n_pairs: int) -> SurfaceSpectrum:
        """Return the lowest of the pairs.

        Raises
        ------
        ParameterError
            When there are fewer.
        """
        _check_pairs(n_pairs, self.name)
        if n_pairs > self.n_pairs:
            msg = f"{self.name}: n_pairs={n_pairs}: expected 1 to {self.n_pairs}; solve for more"
            raise ParameterError(msg)
        return replace(self, values=self.values[:n_pairs], vectors=self.vectors[:, :n_pairs])

    def __repr__(self) -> str:
        n, k = self.vectors.shape
        span = f"λ from {self.values[0]:.4g} to {self.values[-1]:.4g}"
        return f"SurfaceSpectrum({self.name!r}, {k} pairs on {n} vertices, {span})"


def solve_surface_spectrum(surface: Surface, n_pairs: int = 100, *, name: str = "surface") -> SurfaceSpectrum:
    """Find the lowest eigenpairs of the Laplace-Beltrami operator of a surface: Δφ + λφ = 0.

    Linear finite elements, S φ = λ B φ, with B halfway between the full mass matrix, which makes values too
    large by a share of order λh², and the lumped one, which makes them too small by as much; nothing passes
    open edges (Neumann).

    Parameters
    ----------
    surface
        Triangles; edges with more than two faces are no obstacle. Faces without area are taken for very small
        ones.
    n_pairs
        How many pairs. With fewer vertices than that, each face is cut into four until there are enough.
    name
        Short name for messages.

    Returns
    -------
    SurfaceSpectrum
        Eigenvectors have a positive third moment, or where that is negligible a positive entry of largest
        magnitude. Those of a multiple value are one basis of many.

    Raises
    ------
    ParameterError
        When this is no surface, or the number of pairs not a whole number of at least 1.
    ShapeError
        When the surface has no area, values that are not finite, or vertices without a face.
    ConvergenceError
        When the eigenvalue iteration stops short.

    Examples
    --------
    >>> from spem.shapes.boundary_surface import boundary_surface
    >>> from spem.shapes.synthetic import ball
    >>> sphere = boundary_surface(ball(radius=1.0, spacing=0.1))
    >>> solve_surface_spectrum(sphere, 5).values.round(1)
    array([0., 2., 2., 2., 6.])
    """
    _check_pairs(n_pairs, name)
    _check_surface(surface, name)
    surface = subdivide(surface, int(n_pairs))
    stiffness, mass = _elements(surface)
    n = len(surface.vertices)
    with one_thread():
        if n <= max(_DENSE_NODES, _DENSE_SHARE * n_pairs):
            inverse, vectors = _dense(stiffness, mass, int(n_pairs))
        else:
            inverse, vectors = _sparse(stiffness, mass, int(n_pairs), name)
    order = np.argsort(-inverse, kind="stable")
    # no value is below zero but by rounding
    values = np.maximum(1 / inverse[order] - _SHIFT, 0.0)
    vectors = vectors[:, order]
    vectors *= eigenvector_signs(vectors, np.asarray(mass.sum(axis=0)).ravel())
    return SurfaceSpectrum(surface, values / surface.area, vectors / np.sqrt(surface.area), name)


def _check_pairs(n_pairs: Any, name: str) -> None:
    """Refuse what is no number of pairs."""
    whole = isinstance(n_pairs, (int, np.integer)) and not isinstance(n_pairs, bool)
    if not whole or n_pairs < 1:
        msg = f"{name}: n_pairs={n_pairs!r} must be a whole number of at least 1"
        raise ParameterError(msg)


def _check_surface(surface: Surface, name: str) -> None:
    """Refuse surfaces that have no spectrum."""
    require_kind(surface, Surface, "take spem.boundary_surface(shape)")
    if not len(surface.faces) or not np.isfinite(surface.vertices).all() or not surface.area > 0:
        msg = f"{name}: the surface has no faces, no area or vertices that are not finite; check the mesh"
        raise ShapeError(msg)
    lone = len(surface.vertices) - np.unique(surface.faces).size
    if lone:
        msg = f"{name}: {lone} of {len(surface.vertices)} vertices have no face; leave them out"
        raise ShapeError(msg)


def _elements(surface: Surface) -> tuple[Any, Any]:
    """Return stiffness and mass matrix of the surface scaled to unit area."""
    from lapy import Solver, TriaMesh

    middle = surface.vertices.mean(axis=0)
    logging.getLogger("lapy").setLevel(logging.WARNING)
    elements = Solver(TriaMesh((surface.vertices - middle) / np.sqrt(surface.area), surface.faces))
    lumped = scipy.sparse.diags(np.asarray(elements.mass.sum(axis=0)).ravel())
    return elements.stiffness.tocsc(), ((elements.mass + lumped) / 2).tocsc()


def _dense(stiffness: Any, mass: Any, n_pairs: int) -> tuple[Array, Array]:
    """Solve B φ = (S + σB) φ / (λ + σ) for all pairs: right for small λ, however large the largest are."""
    dense = mass.toarray()
    inverse, vectors = scipy.linalg.eigh(dense, stiffness.toarray() + _SHIFT * dense, driver="gvd")
    inverse, vectors = inverse[-n_pairs:], vectors[:, -n_pairs:]
    return inverse, vectors / np.sqrt(inverse)


def _sparse(stiffness: Any, mass: Any, n_pairs: int, name: str) -> tuple[Array, Array]:
    """Find the lowest pairs by Lanczos iteration on the inverse of S + σB."""
    options = {"SymmetricMode": True}
    try:
        factor = scipy.sparse.linalg.splu(
            stiffness + _SHIFT * mass, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
        )
        values, vectors = scipy.sparse.linalg.eigsh(
            stiffness,
            min(n_pairs + _SPARE, stiffness.shape[0] - 1),
            mass,
            sigma=-_SHIFT,
            OPinv=scipy.sparse.linalg.LinearOperator(stiffness.shape, factor.solve, dtype=np.float64),
            tol=0,
            v0=np.random.default_rng(0).random(stiffness.shape[0]),
        )
    except RuntimeError as error:
        msg = f"{name}: the eigenvalue iteration for {n_pairs} pairs failed ({error}); mend the mesh"
        raise ConvergenceError(msg.replace("\n", " ")) from error
    lowest = np.argsort(values)[:n_pairs]
    return 1 / (values[lowest] + _SHIFT), vectors[:, lowest]
