"""Fields of single boundary sources, as logarithms: factor once, solve many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.direct import Direct
from spem.fields.sources import Sources

# Sources are scaled up by this power of two, so that values far below 1e-308 are still normal numbers.
_SCALE = 1000


@dataclass(frozen=True, eq=False)
class SourceFields:
    """Fields v^{p_i} of boundary sources at one ρ (2.2).

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length; `inf` for the Laplace equation.
    log
        ``(n_sources, n_nodes)`` natural logarithm of each field; -inf where it is zero, in components
        that the source does not touch.
    """

    sources: Sources
    rho: float
    log: NDArray[np.float64]

    @property
    def values(self) -> NDArray[np.float64]:
        """``(n_sources, n_nodes)`` the fields themselves."""
        return np.asarray(np.exp(self.log))


def solve_sources(sources: Sources, rho: float) -> SourceFields:
    """Solve (A + M/ρ²) v^{p_i} = b^{p_i} for every source."""
    factor = Direct().prepare(sources.system, 1.0 / rho**2)
    rhs = np.ldexp(sources.rhs.toarray(), _SCALE)
    with np.errstate(divide="ignore"):
        log = np.log(factor.solve(rhs).T)
    return SourceFields(sources, rho, log - _SCALE * np.log(2.0))
