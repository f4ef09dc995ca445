"""The full hyperfield (2.4): N × m fields, one for each ρ and each boundary source, none solved unasked."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, SizeError
from spem.fields.boundary.sources import Sources
from spem.fields.rho import check_rho
from spem.fields.solvers.protocol import SourceSolver
from spem.fields.superposition.axes import Index, numbers, samples
from spem.fields.superposition.blocks import Blocks, KeptBlocks, SolvedBlocks
from spem.fields.superposition.fields import BLOCK_COPIES, Progress, SourceFields, block_size
from spem.fields.superposition.slices import source_solver
from spem.shapes.limits import format_size, memory_limit_bytes
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    import xarray

# A block is read as a whole, so it is kept below this size where a field is.
_BLOCK_BYTES = 16 << 20
Key = int | Index | slice


@dataclass(frozen=True, eq=False)
class SourceHyperfield:
    """Fields v^{ρ_i, p_j} of every sampled ρ and every boundary source, addressed by both.

    Fields are solved for in blocks, when they are asked for: one ρ and some consecutive sources. A quarter of
    the memory limit is for blocks kept, a quarter for factors kept, and half for what one call returns.

    Parameters
    ----------
    sources
        The sources.
    rho
        ``(n_rho,)`` the sampled ρ, in the unit of the spacing; `inf` among them if wanted.
    solver
        `Direct` by default; logarithms need one that is right in every entry.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or the default of 2 GiB.
    stored
        Where fields come from instead of a solver.

    Raises
    ------
    ParameterError
        If a ρ is not a positive length, or the solver takes no single sources.
    SizeError
        If the memory limit leaves no room for a single field.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones((3, 4)), name="brick"))
    >>> hyperfield = SourceHyperfield(point_sources(system), [1.0, 2.0, np.inf])
    >>> hyperfield
    SourceHyperfield('brick', 3 rho 1 to inf, 14 sources, 12 nodes)
    >>> hyperfield.log(rho=2.0, sources=[0, 5]).shape
    (2, 12)
    >>> bool(np.allclose(hyperfield.total(np.inf), 1.0))
    True
    """

    sources: Sources
    rho: NDArray[np.float64]
    solver: SourceSolver | None = None
    memory_limit: int | None = None
    stored: Blocks | None = field(default=None, repr=False)
    _blocks: KeptBlocks = field(init=False, repr=False)

    def __post_init__(self) -> None:
        rho, quarter = check_rho(self.rho).copy(), memory_limit_bytes(self.memory_limit) // 4
        origin = self.stored
        if origin is None:
            self._check_room(quarter)
            few = max(_BLOCK_BYTES // (8 * self.sources.system.n_nodes), 1)
            size = min(block_size(self.sources, 0, quarter), few)
            origin = SolvedBlocks(self.sources, rho, source_solver(self.solver), size, quarter)
        object.__setattr__(self, "rho", rho)
        object.__setattr__(self, "_blocks", KeptBlocks(origin, quarter))

    @property
    def size(self) -> tuple[int, int, int]:
        """Numbers of ρ, sources and nodes."""
        return self.rho.size, self.sources.n_sources, self.shape.n_nodes

    @property
    def shape(self) -> Shape:
        """The shape."""
        return self.sources.system.shape

    @property
    def blocks(self) -> Blocks:
        """Where fields come from, the blocks used last kept."""
        return self._blocks

    def log(
        self,
        rho: ArrayLike | None = None,
        sources: ArrayLike | slice | None = None,
        nodes: ArrayLike | slice | None = None,
    ) -> NDArray[np.float64]:
        """Natural logarithms of fields; -inf in components that a source does not touch.

        Parameters
        ----------
        rho
            One sampled ρ, several, or all for None.
        sources, nodes
            One number, several, a slice, or all for None.

        Returns
        -------
        ``(n_rho, n_sources, n_nodes)``, without the axes for which one value was given.

        Raises
        ------
        ParameterError
            If a ρ is not sampled, a number is out of range, or the solver is not right in every entry.
        SizeError
            If what is asked for does not fit in half of the memory limit.
        """
        return self.take(self._key(rho, sources, nodes), log=True)

    def values(
        self,
        rho: ArrayLike | None = None,
        sources: ArrayLike | slice | None = None,
        nodes: ArrayLike | slice | None = None,
    ) -> NDArray[np.float64]:
        """Fields themselves, 0 below the range of float64; parameters and result as those of `log`."""
        return self.take(self._key(rho, sources, nodes), log=False)

    def fields(self, rho: float) -> SourceFields:
        """Materialise the slice of one sampled ρ."""
        return SourceFields(self.sources, float(rho), self.log(float(rho)))

    def total(self, rho: ArrayLike | None = None) -> NDArray[np.float64]:
        """Sum the fields of all sources, block by block: v itself where they cover the boundary (2.3).

        Returns
        -------
        ``(n_nodes,)`` for one ρ, ``(n_rho, n_nodes)`` for several or all.
        """
        at = samples(self.rho, rho, self.shape.name)
        n_sources, n_nodes = self.size[1:]
        sums = np.zeros((at.size, n_nodes))
        for row, index in zip(sums, np.atleast_1d(at), strict=True):
            for start in range(0, n_sources, self._blocks.size):
                block = np.arange(start, min(start + self._blocks.size, n_sources))
                row += self.take((index, block, slice(None)), log=False).sum(axis=0)
        return sums[0] if at.ndim == 0 else sums

    def take(self, key: tuple[Key, Key, Key], *, log: bool) -> NDArray[np.float64]:
        """Read fields by position along each axis, ρ, source and node; axes indexed by one number vanish.

        Only the blocks that hold what is asked for are solved or read.
        """
        self._check_log(log)
        at = [np.arange(n)[k] for n, k in zip(self.size, key, strict=True)]
        i, j, nodes = (np.atleast_1d(a) for a in at)
        needed, room = 8 * i.size * j.size * nodes.size, memory_limit_bytes(self.memory_limit) // 2
        if needed > room:
            msg = (
                f"{self.shape.name}: {i.size} rho x {j.size} sources x {nodes.size} nodes need "
                f"{format_size(needed)}, half of the memory limit is {format_size(room)}; ask for fewer at a "
                "time, or raise memory_limit= or SPEM_MEMORY_LIMIT"
            )
            raise SizeError(msg)
        result = np.empty((i.size, j.size, nodes.size))
        size, everywhere = self._blocks.size, nodes.size == self.size[2] and np.all(np.diff(nodes) == 1)
        for row, index in zip(result, i, strict=True):
            for b in np.unique(j // size):
                wanted = np.flatnonzero(j // size == b)
                block = self._blocks.read(int(index), b * size, min((b + 1) * size, self.size[1]))
                chosen = block[j[wanted] - b * size]
                row[wanted] = chosen if everywhere else chosen[:, nodes]
        if not log and self._blocks.log:
            with np.errstate(under="ignore"):
                np.exp(result, out=result)
        return result.reshape([a.size for a in at if a.ndim])

    def to_xarray(self, *, log: bool = True) -> xarray.DataArray:
        """Label the hyperfield, dims ``(rho, source, node)``; fields are solved when they are looked at.

        Parameters
        ----------
        log
            Logarithms, or the fields themselves.
        """
        from spem.fields.superposition.labels import label

        self._check_log(log)
        return label(self, log=log)

    def save(self, path: str | Path, *, progress: Progress | None = None) -> None:
        """Write the hyperfield to a zarr group, block by block; a save that was stopped continues."""
        from spem.fields.superposition.storage import save_source_hyperfield

        save_source_hyperfield(self, path, progress)

    @classmethod
    def load(cls, path: str | Path, *, memory_limit: int | None = None) -> SourceHyperfield:
        """Open a hyperfield that `save` wrote; fields are read when they are asked for."""
        from spem.fields.superposition.storage import load_source_hyperfield

        return load_source_hyperfield(path, memory_limit)

    def _key(
        self, rho: ArrayLike | None, sources: ArrayLike | slice | None, nodes: ArrayLike | slice | None
    ) -> tuple[Index, Index, Index]:
        """Return what is asked for as positions along each axis."""
        _, n_sources, n_nodes = self.size
        at = samples(self.rho, rho, self.shape.name)
        return at, numbers(n_sources, sources, "sources"), numbers(n_nodes, nodes, "nodes")

    def _check_room(self, quarter: int) -> None:
        """Refuse a memory limit of which a quarter holds no block of one field."""
        needed, name = BLOCK_COPIES * 8 * self.shape.n_nodes, self.shape.name
        if quarter < needed:
            limit = format_size(memory_limit_bytes(self.memory_limit))
            msg = (
                f"{name}: to solve for one field of {self.shape.n_nodes} nodes at a time needs "
                f"{format_size(4 * needed)}, the limit is {limit}; raise memory_limit= or SPEM_MEMORY_LIMIT"
            )
            raise SizeError(msg)

    def _check_log(self, log: bool) -> None:
        """Refuse logarithms of fields that are right only relative to their maximum."""
        if log and not self._blocks.log:
            msg = (
                f"{self.shape.name}: these fields are right only relative to their maximum, so logarithms "
                "would be wrong deep inside; solve with Direct, or ask for values"
            )
            raise ParameterError(msg)

    def __repr__(self) -> str:
        n_rho, n_sources, n_nodes = self.size
        span = f"{self.rho.min():.4g} to {self.rho.max():.4g}"
        return (
            f"SourceHyperfield({self.shape.name!r}, {n_rho} rho {span}, {n_sources} sources, {n_nodes} nodes)"
        )
