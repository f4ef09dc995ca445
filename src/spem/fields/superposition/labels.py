"""The full hyperfield as a labelled array of xarray that solves only what is looked at."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from spem.fields.superposition.hyperfield import SourceHyperfield

_DIMS = ("rho", "source", "node")


class LazyFields(BackendArray):
    """A hyperfield behind the door that xarray has for arrays read on demand.

    Parameters
    ----------
    hyperfield
        The hyperfield.
    log
        Logarithms, or the fields themselves.
    """

    def __init__(self, hyperfield: SourceHyperfield, *, log: bool) -> None:
        self.hyperfield, self.log = hyperfield, log
        self.shape, self.dtype = hyperfield.size, np.dtype(np.float64)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Read what a key of xarray stands for."""
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._take)

    def __deepcopy__(self, memo: dict[int, Any]) -> LazyFields:
        """Return the same array: its numbers never change, and copying must not solve for them."""
        return self

    def _take(self, key: tuple[Any, ...]) -> NDArray[np.float64]:
        """Read by position along each axis."""
        return self.hyperfield.take((key[0], key[1], key[2]), log=self.log)


def label(hyperfield: SourceHyperfield, *, log: bool) -> xarray.DataArray:
    """Return the hyperfield as ``(rho, source, node)`` with the coordinates of sources and nodes.

    Parameters
    ----------
    hyperfield
        The hyperfield.
    log
        Logarithms, or the fields themselves.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(3)), "voxel"))
    >>> labelled = label(SourceHyperfield(sources, [1.0, np.inf]), log=False)
    >>> labelled.sel(rho=np.inf, source=0).values
    array([0.75, 0.5 , 0.25])
    """
    sources, shape = hyperfield.sources, hyperfield.shape
    coords: dict[str, Any] = {"rho": hyperfield.rho, "source": np.arange(sources.n_sources)}
    coords |= {f"source_x{a}": ("source", column) for a, column in enumerate(sources.position.T)}
    coords |= {f"x{a}": ("node", column) for a, column in enumerate(shape.points.T)}
    quantity = "log v" if log else "v"
    attributes = {"boundary": sources.system.boundary, "spacing": shape.spacing, "quantity": quantity}
    lazy = indexing.LazilyIndexedArray(LazyFields(hyperfield, log=log))
    return xarray.DataArray(xarray.Variable(_DIMS, lazy), coords, _DIMS, shape.name, attributes)
