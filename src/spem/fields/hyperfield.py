"""The hyperfield over ρ as a value: a few columns that yield the field of any ρ in their range."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.rho import check_rho
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    import xarray

# Fields leave their range of ρ only by rounding.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False)
class Hyperfield:
    """Fields v(·, ρ) of one shape for all ρ of a range, as a low-rank Galerkin model.

    v(ρ) = [1 | basis] a(ρ), where a comes from a dense system of the size of the basis.

    Parameters
    ----------
    shape
        The shape; its nodes carry the fields.
    rho
        ``(n_rho,)`` the sampled ρ, in the unit of the spacing.
    basis
        ``(n_nodes, rank)`` orthonormal columns.
    gram
        ``(rank + 1, rank + 1)`` inner products of the constant and the columns.
    mass, stiffness
        ``(rank, rank)`` the matrices M and A of the system between the columns.
    source
        ``(rank,)`` M·1 against the columns.
    boundary
        Boundary model, ``"surface"`` or ``"voxel"``.
    error
        Estimate of the largest error of any field, from true residuals.

    Examples
    --------
    >>> import numpy as np, spem
    >>> field = spem.sweep(spem.synthetic.disk(radius=10.0, spacing=1.0), rho=[2, 4, 8])
    >>> field.fields().shape == (field.shape.n_nodes, 3)
    True
    >>> bool(np.all(field.at(3.0) > field.at(2.5)))  # any ρ in between, without another solve
    True
    """

    shape: Shape
    rho: NDArray[np.float64]
    basis: NDArray[np.floating[Any]]
    gram: NDArray[np.float64]
    mass: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    source: NDArray[np.float64]
    boundary: str = "surface"
    error: float = 0.0

    @property
    def rank(self) -> int:
        """Number of basis columns."""
        return int(self.basis.shape[1])

    def coefficients(self, rho: ArrayLike | None = None) -> NDArray[np.float64]:
        """Coefficients ``(rank + 1, n_rho)`` of the fields in the constant and the basis columns."""
        wanted = self.rho if rho is None else self._check(rho)
        a = np.zeros((self.rank + 1, wanted.size))
        a[0] = 1.0
        finite = np.isfinite(wanted)
        a[1:, finite] = -galerkin(self.stiffness, self.mass, self.source, wanted[finite] ** -2.0)
        return a

    def resampled(self, rho: ArrayLike) -> Hyperfield:
        """Return the same hyperfield with other samples of its range."""
        return replace(self, rho=self._check(rho))

    def fields(self) -> NDArray[np.floating[Any]]:
        """Materialise all sampled fields, ``(n_nodes, n_rho)``."""
        return self._expand(self.coefficients())

    def at(self, rho: ArrayLike) -> NDArray[np.floating[Any]]:
        """Fields of any ρ between the smallest and the largest sampled one, or `inf`.

        Parameters
        ----------
        rho
            One ρ or ``(k,)`` of them.

        Returns
        -------
        ``(n_nodes,)`` for one ρ, ``(n_nodes, k)`` for several.
        """
        values = self._expand(self.coefficients(rho))
        return values[:, 0] if np.ndim(rho) == 0 else values

    def to_xarray(self, *, grid: bool = False) -> xarray.DataArray:
        """Label the sampled fields.

        Parameters
        ----------
        grid
            False: dims ``(node, rho)`` with the coordinates of the nodes. True: one dim per axis of the grid
            (``axis_0``, ...) and ``rho``, NaN outside the shape.
        """
        import xarray

        shape, values = self.shape, self.fields()
        attributes = {"boundary": self.boundary, "spacing": shape.spacing, "error": self.error}
        coords: dict[str, Any] = {"rho": self.rho}
        if not grid:
            coords |= {f"x{a}": ("node", column) for a, column in enumerate(shape.points.T)}
            return xarray.DataArray(values, coords, ("node", "rho"), shape.name, attributes)
        axes = {f"axis_{a}": values for a, values in enumerate(shape.axes)}
        return xarray.DataArray(shape.to_grid(values), axes | coords, (*axes, "rho"), shape.name, attributes)

    def save(self, path: str | Path) -> None:
        """Write the hyperfield to a zarr group, in its low-rank form (see `spem.fields.storage`)."""
        from spem.fields.storage import save_hyperfield

        save_hyperfield(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Hyperfield:
        """Read a hyperfield that `save` wrote."""
        from spem.fields.storage import load_hyperfield

        return load_hyperfield(path)

    def _check(self, rho: ArrayLike) -> NDArray[np.float64]:
        wanted = check_rho(rho)
        finite, known = wanted[np.isfinite(wanted)], self.rho[np.isfinite(self.rho)]
        low, high = (known.min(), known.max()) if known.size else (np.inf, np.inf)
        outside = (finite < low * (1 - _SLACK)) | (finite > high * (1 + _SLACK))
        if outside.any():
            msg = (
                f"rho={finite[outside][0]:g}: this hyperfield of {self.shape.name} covers "
                f"{low:g} to {high:g} (and inf); sweep a wider range"
            )
            raise ParameterError(msg)
        return wanted

    def _expand(self, coefficients: NDArray[np.float64]) -> NDArray[np.floating[Any]]:
        a = coefficients.astype(self.basis.dtype)
        values = self.basis @ a[1:]
        values += a[0]
        return values

    def __repr__(self) -> str:
        span = f"{self.rho.min():.4g} to {self.rho.max():.4g}"
        sizes = f"{self.shape.n_nodes} nodes, {self.rho.size} rho {span}, rank {self.rank}"
        return f"Hyperfield({self.shape.name!r}, {sizes})"


def galerkin(
    stiffness: NDArray[np.float64],
    mass: NDArray[np.float64],
    source: NDArray[np.float64],
    shifts: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Solve (A + s M) y = s M·1 in a basis for each s: the coefficients of 1 - v, one column each."""
    s = shifts[:, None, None]
    return np.asarray(np.linalg.solve(stiffness + s * mass, s * source[:, None])[..., 0].T)
