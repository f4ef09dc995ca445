"""Blocks of the full hyperfield (2.4): consecutive sources at one ρ, solved when asked for, then kept."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from spem.fields.boundary.sources import Sources
from spem.fields.solvers.protocol import Prepared, SourceSolver
from spem.fields.superposition.slices import SourceSlice, prepare_slice

Value = TypeVar("Value")


class Blocks(Protocol):
    """Where the fields of a hyperfield come from: a solver, or a file."""

    @property
    def size(self) -> int:
        """Sources in a block."""
        ...

    @property
    def log(self) -> bool:
        """Whether a block holds logarithms that are right in every entry, or plain values."""
        ...

    def read(self, index: int, start: int, stop: int) -> NDArray[np.float64]:
        """Fields ``(stop - start, n_nodes)`` of one block at one sampled ρ."""
        ...


class Recent(Generic[Value]):
    """The values used last, up to a number of bytes; the very last is kept whatever its size.

    Parameters
    ----------
    limit
        Bytes.
    size
        Bytes of a value.

    Examples
    --------
    >>> recent = Recent(16, len)
    >>> [recent.get(key, lambda key=key: key * 8) for key in "aba"]
    ['aaaaaaaa', 'bbbbbbbb', 'aaaaaaaa']
    >>> _ = recent.get("c", lambda: "c" * 8)
    >>> recent.keys  # "b" was used least recently
    ('a', 'c')
    """

    def __init__(self, limit: int, size: Callable[[Value], int]) -> None:
        self._limit, self._size = limit, size
        self._held: OrderedDict[Hashable, Value] = OrderedDict()
        self._bytes = 0

    @property
    def keys(self) -> tuple[Hashable, ...]:
        """Keys of what is held, the one used last at the end."""
        return tuple(self._held)

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return what is held under a key, making it first where it is not."""
        if key in self._held:
            self._held.move_to_end(key)
            return self._held[key]
        value = make()
        self._held[key] = value
        self._bytes += self._size(value)
        while self._bytes > self._limit and len(self._held) > 1:
            _, oldest = self._held.popitem(last=False)
            self._bytes -= self._size(oldest)
        return value


@dataclass(frozen=True, eq=False)
class SolvedBlocks:
    """Blocks from a solver; the factors used last are kept.

    Parameters
    ----------
    sources
        The sources.
    rho
        ``(n_rho,)`` the sampled ρ.
    solver
        The solver.
    size
        Sources in a block.
    factor_bytes
        Room for factors; one is kept in any case.
    """

    sources: Sources
    rho: NDArray[np.float64]
    solver: SourceSolver
    size: int
    factor_bytes: int
    _slices: Recent[SourceSlice] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        n_nodes = self.sources.system.n_nodes
        slices: Recent[SourceSlice] = Recent(self.factor_bytes, lambda s: factor_bytes(s.prepared, n_nodes))
        object.__setattr__(self, "_slices", slices)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without the factors."""
        return SolvedBlocks, (self.sources, self.rho, self.solver, self.size, self.factor_bytes)

    @property
    def log(self) -> bool:
        """Whether the solver is right in every entry."""
        return self.solver.entrywise

    def read(self, index: int, start: int, stop: int) -> NDArray[np.float64]:
        """Solve for one block."""
        rho = float(self.rho[index])
        part = self._slices.get(index, lambda: prepare_slice(self.sources, rho, self.solver))
        return part.log(start, stop) if self.log else part.values(start, stop)


@dataclass(frozen=True, eq=False)
class KeptBlocks:
    """Blocks of another kind, the ones read last kept in memory; safe to read from several threads.

    Parameters
    ----------
    origin
        Where they come from.
    field_bytes
        Room for fields; one block is kept in any case.
    """

    origin: Blocks
    field_bytes: int
    _kept: Recent[NDArray[np.float64]] = field(init=False, repr=False)
    _lock: threading.Lock = field(init=False, repr=False, default_factory=threading.Lock)

    def __post_init__(self) -> None:
        kept: Recent[NDArray[np.float64]] = Recent(self.field_bytes, lambda block: block.nbytes)
        object.__setattr__(self, "_kept", kept)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle without the fields."""
        return KeptBlocks, (self.origin, self.field_bytes)

    @property
    def size(self) -> int:
        """Sources in a block."""
        return self.origin.size

    @property
    def log(self) -> bool:
        """Whether a block holds logarithms."""
        return self.origin.log

    def read(self, index: int, start: int, stop: int) -> NDArray[np.float64]:
        """Return a block, kept or read anew."""
        with self._lock:
            return self._kept.get((index, start), lambda: self.origin.read(index, start, stop))


def factor_bytes(prepared: Prepared, n_nodes: int) -> int:
    """Bytes of a prepared matrix: what it says itself, or about what nested dissection fills in 3-D."""
    return int(getattr(prepared, "nbytes", 80 * n_nodes ** (4 / 3)))
