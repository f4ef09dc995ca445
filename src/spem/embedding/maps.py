"""SPEM maps (4.4): the principal components of a hyperfield over ρ, projected to the nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.hyperfield import Hyperfield
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    import xarray

# An entry below this fraction of the largest cannot carry the sign: rounding or a small change of the
# shape could flip it.
_SMALL_LAST = 1e-3


@dataclass(frozen=True, eq=False)
class Maps:
    """SPEM maps of one shape.

    Parameters
    ----------
    shape
        The shape; its nodes carry the maps.
    values
        ``(n_nodes, n_maps)`` projections P = YΦ, strongest first.
    basis
        ``(n_rho, n_maps)`` orthonormal columns Φ.
    variance
        ``(n_maps,)`` mean square of each map over the nodes (about the mean field if centred).
    rho
        ``(n_rho,)`` the sampled ρ.
    total_variance
        Sum of the variances of all components.
    centred
        Whether the mean field was removed.
    """

    shape: Shape
    values: NDArray[np.floating[Any]]
    basis: NDArray[np.float64]
    variance: NDArray[np.float64]
    rho: NDArray[np.float64]
    total_variance: float
    centred: bool = False

    @property
    def explained(self) -> NDArray[np.float64]:
        """``(n_maps,)`` fraction of the total variance that each map explains."""
        return (
            self.variance / self.total_variance if self.total_variance > 0 else np.zeros_like(self.variance)
        )

    def to_xarray(self, *, grid: bool = False) -> xarray.DataArray:
        """Label the maps: dims ``(node, map)``, or one dim per axis of the grid and ``map``."""
        import xarray

        shape, coords = self.shape, {"map": np.arange(1, self.values.shape[1] + 1)}
        attributes = {"spacing": shape.spacing, "centred": int(self.centred)}
        if not grid:
            points: dict[str, Any] = {f"x{a}": ("node", column) for a, column in enumerate(shape.points.T)}
            return xarray.DataArray(self.values, coords | points, ("node", "map"), shape.name, attributes)
        axes = {f"axis_{a}": values for a, values in enumerate(shape.axes)}
        return xarray.DataArray(
            shape.to_grid(self.values), axes | coords, (*axes, "map"), shape.name, attributes
        )

    def __repr__(self) -> str:
        shares = ", ".join(f"{share:.2g}" for share in self.explained)
        n, k = self.values.shape
        return f"Maps({self.shape.name!r}, {k} maps on {n} nodes, explained {shares})"


def compute_maps(field: Hyperfield, n_maps: int = 6, *, centred: bool = False) -> Maps:
    """Project a hyperfield on its principal components over ρ.

    With Y the ``(n_nodes, n_rho)`` matrix of fields, Φ holds the leading eigenvectors of YᵀY and the maps are
    P = YΦ (4.4). Y is never formed: its singular value decomposition is that of a small matrix, the
    coefficients in an orthonormal basis, so components are right down to a hundredth of the tolerance of
    the sweep, relative to the strongest one: 1e-9 takes a sweep with ``rtol=1e-11``.

    Parameters
    ----------
    field
        The hyperfield of one shape.
    n_maps
        Number of maps, at most the number of sampled ρ.
    centred
        Remove the mean field over the nodes first. The paper's retrieval figures need it not removed.

    Examples
    --------
    >>> import spem
    >>> result = compute_maps(spem.sweep(spem.synthetic.disk(radius=12.0, spacing=1.0)), n_maps=3)
    >>> result.values.shape == (result.shape.n_nodes, 3)
    True
    >>> bool((result.basis[-1] > 0).all())
    True
    """
    found = principal_components(
        field.gram, field.coefficients(), field.rho, field.shape.n_nodes, n_maps, centred=centred
    )
    mix = found.mix.astype(field.basis.dtype)
    values = field.basis @ mix[1:] + mix[0]
    return Maps(field.shape, values, found.basis, found.variance, field.rho, found.total_variance, centred)


@dataclass(frozen=True, eq=False)
class Components:
    """Principal components of a hyperfield over ρ, before they are projected to the nodes.

    Parameters
    ----------
    mix
        ``(rank + 1, n_maps)`` coefficients of the maps in the constant and the columns of the hyperfield.
    basis
        ``(n_rho, n_maps)`` orthonormal columns Φ.
    variance
        ``(n_maps,)`` mean square of each map over the nodes.
    total_variance
        Sum of the variances of all components.
    """

    mix: NDArray[np.float64]
    basis: NDArray[np.float64]
    variance: NDArray[np.float64]
    total_variance: float


def principal_components(
    gram: NDArray[np.float64],
    coefficients: NDArray[np.float64],
    rho: NDArray[np.float64],
    n_nodes: int,
    n_maps: int,
    *,
    centred: bool = False,
) -> Components:
    """Find the leading eigenvectors of YᵀY (4.4) from the small matrices of a hyperfield alone.

    Parameters
    ----------
    gram
        ``(rank + 1, rank + 1)`` inner products of the constant and the columns, as `Hyperfield.gram`.
    coefficients
        ``(rank + 1, n_rho)`` coefficients of the fields, as `Hyperfield.coefficients` returns them.
    rho
        ``(n_rho,)`` the sampled ρ.
    n_nodes
        Number of nodes.
    n_maps, centred
        As `compute_maps` takes them.

    Raises
    ------
    ParameterError
        When there are fewer samples of ρ than maps, or no map is asked for.

    Examples
    --------
    Two fields on one node, 3 and 4 times the constant, have one component:

    >>> found = principal_components(np.eye(1), np.array([[3.0, 4.0]]), np.array([1.0, 2.0]), 1, 1)
    >>> found.basis.ravel(), found.variance
    (array([0.6, 0.8]), array([25.]))
    """
    if not 1 <= n_maps <= rho.size:
        msg = f"n_maps={n_maps}: expected 1 to {rho.size}, the number of sampled rho"
        raise ParameterError(msg)
    upper = _root(gram)
    small = upper @ coefficients
    if centred:
        small[0] = 0.0  # the part along the constant
    left, size, right = np.linalg.svd(small, full_matrices=False)
    # what rounding leaves of a component that is not there
    size[size <= max(small.shape) * np.finfo(float).eps * size.max()] = 0.0
    size = np.pad(size, (0, max(0, n_maps - size.size)))
    left, basis = _complete(left, n_maps), _complete(right.T, n_maps)
    sign = _signs(basis, int(np.argmax(rho)))
    mix = np.asarray(np.linalg.lstsq(upper, left * (size[:n_maps] * sign))[0], np.float64)
    variance, total = np.square(size) / n_nodes, np.square(size).sum() / n_nodes
    return Components(mix, basis * sign, variance[:n_maps], float(total))


def _root(gram: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return R with RᵀR = G; on a few nodes the constant lies in the span of the basis, and R is singular."""
    try:
        return np.asarray(np.linalg.cholesky(gram).T)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(gram)
        return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)


def _signs(basis: NDArray[np.float64], last: int) -> NDArray[np.float64]:
    """Sign that makes the entry of the largest ρ positive, or the largest entry where that is negligible."""
    largest = np.take_along_axis(basis, np.abs(basis).argmax(axis=0)[None], axis=0)[0]
    leading = np.where(np.abs(basis[last]) > _SMALL_LAST * np.abs(largest), basis[last], largest)
    return np.where(leading < 0, -1.0, 1.0)


def _complete(columns: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """First `count` columns, with orthonormal ones appended when there are fewer (their maps are zero)."""
    if columns.shape[1] >= count:
        return columns[:, :count]
    full, _ = np.linalg.qr(np.hstack([columns, np.eye(columns.shape[0])]))
    if full.shape[1] >= count:
        return np.hstack([columns, full[:, columns.shape[1] : count]])
    return np.pad(columns, ((0, 0), (0, count - columns.shape[1])))
