"""The facade over ρ: fields, the sweep and its maps."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.embedding.maps import Maps, compute_maps
from spem.errors import ParameterError
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import Boundary, assemble
from spem.fields.rho import DEFAULT_COUNT, Scheme, check_rho, sample_rho
from spem.fields.solvers.engine import Backend
from spem.fields.solvers.protocol import Solver, require_solver
from spem.fields.solvers.sweep import Sweep
from spem.fields.solvers.team import usable_threads
from spem.shapes.shape import Shape

# A few fields asked for by name are worth more digits than a sweep that feeds maps.
_FIELD_RTOL = 1e-10


def field(
    shape: Shape,
    rho: ArrayLike,
    *,
    boundary: Boundary = "surface",
    solver: Solver | None = None,
    device: Backend | None = None,
) -> NDArray[np.floating[Any]]:
    """Solve Δv − v/ρ² = 0 with v = 1 on the boundary (1.1).

    Parameters
    ----------
    shape
        Any shape.
    rho
        One ρ or several, in the unit of the spacing; `inf` is allowed.
    boundary
        ``"surface"`` (second order) or ``"voxel"`` (the paper's).
    solver
        Any solver of `spem.fields.solvers`; the fast sweep to 1e-10 by default.
    device
        Where the fast sweep runs, such as ``spem.Cuda()``; the processor when None.

    Returns
    -------
    ``(n_nodes,)`` for one ρ, ``(n_nodes, n_rho)`` for several; rows in the order of ``shape.points``.

    Raises
    ------
    ParameterError
        If a ρ is not positive, or a solver and a device are given together, or are none.
    ConvergenceError
        If the solver misses its tolerance; it carries the best iterate.
    SizeError
        If the shape does not fit into the memory of the device.

    Examples
    --------
    >>> import spem
    >>> v = spem.field(spem.synthetic.interval(length=9.0, spacing=0.1), rho=2.0)
    >>> print(round(float(v.min()), 3))  # 1 / cosh(4.5 / 2)
    0.209
    """
    require_solver(solver)
    if solver is not None and device is not None:
        msg = f"solver={solver!r} and device={device!r} exclude each other; give the device to the solver"
        raise ParameterError(msg)
    values = check_rho(rho)
    chosen = Sweep(rtol=_FIELD_RTOL, device=device) if solver is None else solver
    solution = chosen.solve(assemble(shape, boundary), values).checked(shape.name)
    return solution.values[:, 0] if np.ndim(rho) == 0 else solution.values


def sweep(
    shape: Shape,
    rho: ArrayLike | None = None,
    *,
    n_rho: int = DEFAULT_COUNT,
    scheme: Scheme = "linear",
    boundary: Boundary = "surface",
    rtol: float = 1e-6,
    device: Backend | None = None,
) -> Hyperfield:
    """Solve for all ρ of a range at once, as a low-rank hyperfield.

    Parameters
    ----------
    shape
        Any shape.
    rho
        The ρ to sample, in the unit of the spacing; by default `n_rho` of them in a range set by the
        shape's size.
    n_rho, scheme
        Number and spacing of the default samples (``"linear"``, ``"squared"``, ``"log"``).
    boundary
        ``"surface"`` (second order) or ``"voxel"`` (the paper's).
    rtol
        Largest error of any field at any node, relative to the field's maximum.
    device
        Where to compute, such as ``spem.Cuda()``; the processor when None.

    Raises
    ------
    ConvergenceError
        If `rtol` is missed.
    SizeError
        If the shape does not fit into the memory of the device.

    Examples
    --------
    >>> import spem
    >>> spem.sweep(spem.synthetic.disk(radius=20.0, spacing=1.0)).rho.size
    64
    """
    system = assemble(shape, boundary)
    samples = sample_rho(shape.size, count=n_rho, scheme=scheme) if rho is None else check_rho(rho)
    return Sweep(rtol=rtol, device=device).hyperfield(system, samples)


def sweep_many(
    shapes: Iterable[Shape],
    rho: ArrayLike | None = None,
    *,
    n_rho: int = DEFAULT_COUNT,
    scheme: Scheme = "linear",
    boundary: Boundary = "surface",
    rtol: float = 1e-6,
    device: Backend | None = None,
) -> list[Hyperfield]:
    """Sweep many shapes, on a device all of one dimension together; each comes out as `sweep` has it alone.

    Parameters
    ----------
    shapes
        Shapes, of several dimensions too. Their systems and hyperfields are held in memory all at once.
    rho, n_rho, scheme, boundary, rtol
        As for `sweep`; a given `rho` is that of every shape.
    device
        Where to compute, such as ``spem.Cuda()``; the processor when None. What does not fit into its memory
        together is swept in halves.

    Returns
    -------
    list
        A hyperfield for each shape, in their order.

    Raises
    ------
    ConvergenceError
        If a shape misses `rtol`.
    SizeError
        If a single shape does not fit into the memory of the device.

    Examples
    --------
    >>> import spem
    >>> disks = [spem.synthetic.disk(radius=r, spacing=1.0) for r in (8.0, 9.0)]
    >>> [field.shape.n_nodes for field in spem.sweep_many(disks, rho=[2, 4])]
    [193, 249]
    """
    if isinstance(shapes, Shape) or not isinstance(shapes, Iterable):
        msg = f"shapes={shapes!r}: expected a list of shapes; use spem.sweep for one"
        raise ParameterError(msg)
    shapes, given = list(shapes), None if rho is None else check_rho(rho)
    with ThreadPoolExecutor(usable_threads()) as pool:
        systems = list(pool.map(lambda shape: assemble(shape, boundary), shapes))
    solver, found = Sweep(rtol=rtol, device=device), dict[int, Hyperfield]()
    for ndim in sorted({shape.ndim for shape in shapes}):
        rows = [row for row, shape in enumerate(shapes) if shape.ndim == ndim]
        samples = [
            sample_rho(shapes[row].size, count=n_rho, scheme=scheme) if given is None else given
            for row in rows
        ]
        found |= zip(rows, solver.hyperfields([systems[row] for row in rows], samples), strict=True)
    return [found[row] for row in range(len(systems))]


def maps(
    source: Shape | Hyperfield,
    n_maps: int = 6,
    *,
    centred: bool = False,
    rho: ArrayLike | None = None,
    n_rho: int = DEFAULT_COUNT,
    scheme: Scheme = "linear",
    boundary: Boundary = "surface",
    rtol: float = 1e-6,
    device: Backend | None = None,
) -> Maps:
    """SPEM maps of a shape or of its hyperfield: P = YΦ (4.4).

    Parameters
    ----------
    source
        A shape, swept first, or a hyperfield.
    n_maps
        Number of maps.
    centred
        Remove the mean field first.
    rho, n_rho, scheme, boundary, rtol, device
        As for `sweep`; a hyperfield has its own.

    Raises
    ------
    ParameterError
        If settings of the sweep are given for a hyperfield.

    Examples
    --------
    >>> import spem
    >>> spem.maps(spem.synthetic.disk(radius=20.0, spacing=1.0), n_maps=4).basis.shape
    (64, 4)
    """
    given = (rho is None, n_rho, scheme, boundary, rtol, device is None)
    if not isinstance(source, Hyperfield):
        source = sweep(source, rho, n_rho=n_rho, scheme=scheme, boundary=boundary, rtol=rtol, device=device)
    elif given != (True, DEFAULT_COUNT, "linear", "surface", 1e-6, True):
        msg = (
            "maps of a hyperfield: rho, n_rho, scheme, boundary, rtol and device are its own; "
            "give them to sweep"
        )
        raise ParameterError(msg)
    return compute_maps(source, n_maps, centred=centred)
