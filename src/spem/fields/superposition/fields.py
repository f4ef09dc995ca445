"""Fields of single boundary sources (2.2) at one ρ: factor once, solve many."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import SizeError, require_kind
from spem.fields.boundary.sources import Sources
from spem.fields.rho import single_rho
from spem.fields.solvers.protocol import SourceSolver
from spem.fields.superposition.slices import prepare_slice, require_entrywise, source_solver
from spem.shapes.limits import format_size, memory_limit_bytes

#: Called with a stage's name, how much of it is done, and of how much.
Progress = Callable[[str, int, int], None]

# Fields solved at a time at most: enough for the solver's matrix products, few enough for its caches.
_BLOCK = 64
# Right-hand sides, solutions, their transpose and the solver's own working copy.
BLOCK_COPIES = 4


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
        ``(n_sources, n_nodes)`` natural logarithm of each field; -inf where it is zero, in connected
        components that the source does not touch, and nowhere else.
    """

    sources: Sources
    rho: float
    log: NDArray[np.float64]

    @property
    def values(self) -> NDArray[np.float64]:
        """``(n_sources, n_nodes)`` the fields themselves; 0 below the range of float64."""
        with np.errstate(under="ignore"):
            return np.asarray(np.exp(self.log))

    def __repr__(self) -> str:
        sizes = f"{self.log.shape[0]} sources, {self.log.shape[1]} nodes, rho {self.rho:.4g}"
        return f"SourceFields({self.sources.system.shape.name!r}, {sizes})"


def require_fields(fields: object) -> None:
    """Refuse what is no fields of sources.

    Raises
    ------
    ParameterError
        If it is something else; it says how fields are made.
    """
    require_kind(fields, SourceFields, "solve for them first: spem.source_fields(spem.sources(shape))")


def solve_sources(
    sources: Sources,
    rho: float,
    *,
    solver: SourceSolver | None = None,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> SourceFields:
    """Solve (A + M/ρ²) v^{p_i} = b^{p_i} for every source, as logarithms right in every entry.

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length in the unit of the spacing; `inf` for the Laplace equation.
    solver
        One that is right in every entry: `Direct`, the default.
    memory_limit
        Bytes for the result and the fields in work, beside the matrix and its factor; None for
        SPEM_MEMORY_LIMIT or the default of 2 GiB.
    progress
        Called with ``"sources"``, the number of fields solved and that of all.

    Raises
    ------
    ParameterError
        If the solver does not promise every entry, or ρ is not a positive length.
    SizeError
        If the fields do not fit in memory; it says how many would.

    Examples
    --------
    Together the fields of all sources are v (2.3):

    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((3, 4))))), np.inf)
    >>> fields
    SourceFields('shape', 14 sources, 12 nodes, rho inf)
    >>> bool(np.allclose(fields.values.sum(axis=0), 1.0, rtol=1e-14))
    True
    """
    require_entrywise(source_solver(solver))
    log = _solve(sources, rho, solver, memory_limit, progress, log=True)
    return SourceFields(sources, single_rho(rho), log)


def solve_several(
    several: Sequence[Sources], rho: float, *, progress: Progress | None = None
) -> list[SourceFields]:
    """Solve for the sources of several shapes that are to be divided together.

    Parameters
    ----------
    several
        The sources of each shape.
    rho, progress
        As for `solve_sources`.

    Raises
    ------
    ParameterError
        If ρ is not a positive length.
    SizeError
        If the fields of all, and a measurement for each, do not fit in memory together.
    """
    needed, limit = sum(2 * 8 * s.n_sources * s.system.n_nodes for s in several), memory_limit_bytes()
    if len(several) > 1 and needed > limit:
        sizes = f"{format_size(needed)}, the limit is {format_size(limit)}"
        what = f"fields and measurements of {len(several)} shapes together"
        msg = f"{what} need {sizes}; take fewer shapes"
        raise SizeError(msg)
    return [solve_sources(sources, rho, progress=progress) for sources in several]


def source_values(
    sources: Sources,
    rho: float,
    *,
    solver: SourceSolver | None = None,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.float64]:
    """Solve for the fields themselves, ``(n_sources, n_nodes)``, by any solver that takes single sources.

    They are as right as the solver makes them; of iterations, `MultigridGradients` and `ConjugateGradient`,
    only relative to each field's maximum.

    Parameters
    ----------
    sources, rho, solver, memory_limit, progress
        As for `solve_sources`.

    Raises
    ------
    ParameterError
        If the solver takes no single sources, or ρ is not a positive length.
    SizeError
        If the fields do not fit in memory.
    ConvergenceError
        If an iteration misses its tolerance.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.solvers.cg import ConjugateGradient
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(3)), "voxel"))
    >>> source_values(sources, np.inf, solver=ConjugateGradient()).round(6)
    array([[0.75, 0.5 , 0.25],
           [0.25, 0.5 , 0.75]])
    """
    return _solve(sources, rho, solver, memory_limit, progress, log=False)


def _solve(
    sources: Sources,
    rho: float,
    solver: SourceSolver | None,
    memory_limit: int | None,
    progress: Progress | None,
    *,
    log: bool,
) -> NDArray[np.float64]:
    """Solve block by block into one array."""
    total = sources.n_sources
    block = block_size(sources, total, memory_limit)
    part = prepare_slice(sources, rho, solver)
    result = np.empty((total, sources.system.n_nodes))
    for start, stop in blocks(total, block):
        result[start:stop] = part.log(start, stop) if log else part.values(start, stop)
        if progress is not None:
            progress("sources", stop, total)
    return result


def blocks(total: int, size: int) -> Iterator[tuple[int, int]]:
    """First and one past the last source of each block."""
    for start in range(0, total, size):
        yield start, min(start + size, total)


def block_size(sources: Sources, held: int, memory_limit: int | None) -> int:
    """How many fields to solve at a time, beside so many that are held.

    Raises
    ------
    SizeError
        If the memory limit leaves no room for one.
    """
    limit, field = memory_limit_bytes(memory_limit), 8 * sources.system.n_nodes
    room = limit // field - held
    if room < BLOCK_COPIES:
        fit = max(limit // field - BLOCK_COPIES, 0)
        name, n_nodes = sources.system.shape.name, sources.system.n_nodes
        needed = format_size((held + BLOCK_COPIES) * field)
        msg = (
            f"{name}: {held} fields of {n_nodes} nodes need {needed}, the limit is {format_size(limit)} and "
            f"{fit} would fit; take fewer patches or Sources.select, use a SourceHyperfield, or raise "
            "memory_limit= or SPEM_MEMORY_LIMIT"
        )
        raise SizeError(msg)
    return int(min(_BLOCK, room // BLOCK_COPIES))
