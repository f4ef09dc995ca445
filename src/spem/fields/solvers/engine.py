"""What a backend brings to the sweep: block vectors of a batch of systems, and the kernels on them.

The sweep itself, its stopping rule, its poles and its small dense algebra are written once, over engines. An
engine holds for each node of each system of its batch eight numbers, one a lane, in a few vectors:

- u, the prediction of the reduced basis, in double precision;
- r, a residual, z, what one V-cycle of multigrid makes of it, x, p and q of conjugate gradients, in single;
- the blocks of the basis, eight columns each, in single or double precision.

What passes between an engine and the sweep are small float64 arrays of the host with the system first:
``(n_systems, LANES)``, or ``(n_systems, K, LANES)`` where K = LANES · n_blocks counts columns of the basis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.operator import System

LANES = 8
# In units of the spacing; single precision holds the square of its inverse.
_LEAST_RHO = 1e-6

Small = NDArray[np.float64]


class Products(NamedTuple):
    """What a new block of columns C has with all columns B of the basis, itself last, in double precision.

    Parameters
    ----------
    gram, stiffness, mass
        ``(n_systems, K, LANES)`` BᵀC, BᵀAC and BᵀMC, A in units of `Engine.units`.
    sums, source
        ``(n_systems, LANES)`` 1ᵀC and 1ᵀMC.
    """

    gram: Small
    stiffness: Small
    mass: Small
    sums: Small
    source: Small


class Engine(Protocol):
    """Block vectors of a batch of systems of the same dimension.

    The answers for a system do not depend on what else is in the batch, bit by bit, and reductions are in
    double precision, in an order that depends on the system alone.
    """

    #: ``(n_systems,)`` number of nodes of each system.
    counts: NDArray[np.int64]
    #: ``(n_systems,)`` the length that A is scaled by: the least spacing of each system.
    units: Small
    #: Precision of the columns of the basis.
    dtype: type[np.floating[Any]]

    def measure(self, mix: Small, shifts: Small, active: NDArray[np.bool_]) -> tuple[Small, Small]:
        """Set u = B·mix, r = s M (1 − u) − A u in double precision, and z to a cycle's answer to r.

        Parameters
        ----------
        mix
            ``(n_systems, K, LANES)`` coefficients of the predictions.
        shifts
            ``(n_systems, LANES)`` s of each lane, in units of 1/`units`².
        active
            ``(n_systems,)`` the systems to work on, until the next call; the answers for others are zero.

        Returns
        -------
        tuple
            r·z and the largest magnitude of z, ``(n_systems, LANES)`` each.
        """
        ...

    def select(self, active: NDArray[np.bool_]) -> None:
        """Narrow the active systems, or widen them again to those of the last `measure` or `refine`.

        Until the next call of any of the three; the vectors of other systems keep what they hold.
        """
        ...

    def search(self, beta: Small | None) -> Small:
        """Turn the search directions, p ← z + β p, set q = (A + s M) p, and return p·q.

        With None conjugate gradients start afresh: x = 0 and p = z.
        """
        ...

    def improve(self, alpha: Small) -> Small:
        """Advance, x ← x + α p and r ← r − α q, set z to a cycle's answer to r, and return r·z."""
        ...

    def overlaps(self) -> Small:
        """Return inner products ``(n_systems, K + LANES, LANES)`` of the basis, then of x itself, with x."""
        ...

    def append(self, mix: Small, remove: Small) -> Products:
        """Append the block x·mix + B·remove to the basis.

        Parameters
        ----------
        mix
            ``(n_systems, LANES, LANES)``; zero for systems that are not active.
        remove
            ``(n_systems, K, LANES)``.
        """
        ...

    def columns(self, turn: Sequence[Small]) -> list[NDArray[np.floating[Any]]]:
        """Return the columns B·turn of each system, ``(n_nodes, rank)`` in node order, on the host.

        Parameters
        ----------
        turn
            For each system ``(K, rank)``.
        """
        ...

    def close(self) -> None:
        """Give back threads and memory; nothing may be asked for afterwards."""
        ...


class SourceEngine(Engine, Protocol):
    """An engine that takes right-hand sides other than s M·1, and refines their solutions v."""

    def load(self, rhs: Sequence[NDArray[np.float64]]) -> Small:
        """Take right-hand sides b, for each system ``(n_nodes, LANES)``; v = x = 0; return b·b.

        They are scaled by the square of `units`, as A is. The values of b are kept, and v held, in double
        precision; the blocks of a basis are not touched.
        """
        ...

    def refine(self, shifts: Small, active: NDArray[np.bool_]) -> tuple[Small, Small]:
        """Advance v ← v + x, set r = b − (A + s M) v in double precision and z to a cycle's answer to r.

        Parameters are those of `measure`. `search` with None and `improve` follow.

        Returns
        -------
        tuple
            r·z and r·r, ``(n_systems, LANES)`` each; zero for systems that are not active.
        """
        ...

    def solution(self) -> list[NDArray[np.float64]]:
        """Return v of each system, ``(n_nodes, LANES)`` in node order, on the host."""
        ...


class Backend(Protocol):
    """Where a sweep runs."""

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> SourceEngine:
        """Make an engine for systems of one dimension.

        Raises
        ------
        SizeError
            When they do not fit into its memory; half of them, or one, may.
        """
        ...


def require_rho(system: System, rho: NDArray[np.float64]) -> None:
    """Refuse ρ that single precision cannot hold.

    Raises
    ------
    ParameterError
        When one is below a millionth of the spacing.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> require_rho(assemble(Shape.from_mask(np.ones((3, 3)))), np.array([0.5, np.inf]))
    """
    unit = min(system.shape.spacing)
    if rho.min(initial=np.inf) < _LEAST_RHO * unit:
        msg = (
            f"{system.shape.name}: rho={rho.min():g} is below {_LEAST_RHO:g} of the spacing {unit:g}, "
            "where fields vanish on every node; use a larger rho or a finer spacing"
        )
        raise ParameterError(msg)


def require_backend(device: Any) -> None:
    """Raise a `ParameterError` unless a device is a backend, or None for the processor.

    Examples
    --------
    >>> require_backend("cuda")
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: device='cuda': expected spem.Cuda() or another backend, None for the processor
    """
    if device is None or (not isinstance(device, type) and callable(getattr(device, "open", None))):
        return
    msg = f"device={device!r}: expected spem.Cuda() or another backend, None for the processor"
    raise ParameterError(msg)
