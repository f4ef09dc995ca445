"""Parts of a shape: the components of a non-negative decomposition of its interaction vectors (4.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.sources import Sources
from spem.shapes.shape import Shape


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of one shape, of its region (4.1) or of its boundary (5.2).

    For the region Y ≈ A S, one column for each node; for the boundary Yᵀ ≈ A S, one column for each source.

    Parameters
    ----------
    sources
        The boundary sources.
    rho
        Screening length of the slice.
    over
        What is divided: ``"region"`` or ``"boundary"``.
    components
        ``(k, n_nodes)`` rows of S for the region, ``(k, n_sources)`` for the boundary.
    basis
        ``(k, n_sources)`` columns of A for the region, ``(k, n_nodes)`` for the boundary.
    node_labels
        ``(n_nodes,)`` part of each node, -1 where no component explains it.
    source_labels
        ``(n_sources,)`` part of each source, -1 where no component explains it.
    intensity
        ``(k,)`` share of each component in the whole.
    """

    sources: Sources
    rho: float
    over: str
    components: NDArray[np.float64]
    basis: NDArray[np.float64]
    node_labels: NDArray[np.int32]
    source_labels: NDArray[np.int32]
    intensity: NDArray[np.float64]

    @property
    def shape(self) -> Shape:
        """The shape."""
        return self.sources.system.shape

    @property
    def n_parts(self) -> int:
        """Number of parts, k."""
        return int(self.components.shape[0])
