"""Eigenvalues and eigenvectors of the Laplacian on the nodes of a shape."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, get_args, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.domain import Domain
from spem.fields.operator import Boundary, System, assemble
from spem.fields.solvers.lanczos import BlockLanczos
from spem.shapes.shape import Shape

Array = NDArray[np.float64]
Condition = Literal["free", "absorbing"]
# A third moment below this share of the largest there can be does not carry the sign.
_SMALL_MOMENT = 1e-3


@runtime_checkable
class Eigenpairs(Protocol):
    """The lowest eigenpairs of the Laplacian of a solid, `Spectrum`, or of a surface, `SurfaceSpectrum`."""

    @property
    def values(self) -> Array:
        """``(n_pairs,)`` eigenvalues, ascending, in 1/length²."""
        ...

    @property
    def vectors(self) -> Array:
        """``(n_nodes, n_pairs)`` eigenvectors, of unit L2 norm over what they are of."""
        ...

    @property
    def n_pairs(self) -> int:
        """Number of eigenpairs."""
        ...

    @property
    def name(self) -> str:
        """Short name for messages."""
        ...

    @property
    def ndim(self) -> int:
        """Dimension of what they are of: that of the shape, two of a surface."""
        ...

    @property
    def size(self) -> float:
        """Its volume, or area, to the power 1 / `ndim`: a length."""
        ...


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The lowest eigenpairs of the Laplacian of a shape: Δφ + λφ = 0 (3.5).

    Parameters
    ----------
    shape
        The shape; its nodes carry the eigenvectors.
    values
        ``(n_pairs,)`` eigenvalues λ, ascending, in 1/length².
    vectors
        ``(n_nodes, n_pairs)`` eigenvectors φ, in length^(−d/2): of unit L2 norm over the shape.
    boundary
        ``"free"``: no heat passes the boundary; ``"absorbing"``: φ = 0 on it.
    """

    shape: Shape
    values: Array
    vectors: Array
    boundary: Condition

    @property
    def n_pairs(self) -> int:
        """Number of eigenpairs."""
        return self.values.size

    @property
    def name(self) -> str:
        """Name of the shape."""
        return self.shape.name

    @property
    def ndim(self) -> int:
        """Dimension of the shape."""
        return self.shape.ndim

    @property
    def size(self) -> float:
        """Size of the shape, `Shape.size`."""
        return self.shape.size

    def truncated(self, n_pairs: int) -> Spectrum:
        """Return the lowest of the pairs.

        Raises
        ------
        ParameterError
            When there are fewer.
        """
        if not _is_whole(n_pairs) or not 1 <= n_pairs <= self.n_pairs:
            msg = f"{self.shape.name}: n_pairs={n_pairs}: expected 1 to {self.n_pairs}; solve for more"
            raise ParameterError(msg)
        return replace(self, values=self.values[:n_pairs], vectors=self.vectors[:, :n_pairs])

    def __repr__(self) -> str:
        n, k = self.vectors.shape
        span = f"λ from {self.values[0]:.4g} to {self.values[-1]:.4g}"
        return f"Spectrum({self.shape.name!r}, {k} pairs on {n} nodes, {self.boundary} boundary, {span})"


def solve_spectrum(
    shape: Shape,
    n_pairs: int = 100,
    *,
    boundary: Condition = "free",
    model: Boundary = "surface",
    solver: BlockLanczos | None = None,
) -> Spectrum:
    """Find the lowest eigenpairs of the Laplacian of a shape.

    On the nodes A φ = λ M φ. With an absorbing boundary (Dirichlet) A and M are those of the screened Poisson
    equation, (A + M/ρ²) v = b. With a free one (Neumann) boundary edges are left out of A and M is the
    identity, so that a constant has λ = 0; the volumetric heat kernel signature is made of these pairs.

    Parameters
    ----------
    shape
        Any shape. Its connected components are solved one by one.
    n_pairs
        How many pairs, at most the number of nodes.
    boundary
        ``"free"`` or ``"absorbing"``.
    model
        Where the boundary lies, as `spem.field` has it: ``"surface"`` or ``"voxel"``. With a free one it only
        says whether edges between two inside voxels may be cut.
    solver
        Tolerance and memory; `BlockLanczos` by default.

    Returns
    -------
    Spectrum
        Eigenvectors have a positive third moment, or where that is negligible a positive entry of largest
        magnitude. Those of a multiple value are one basis of many.

    Raises
    ------
    ParameterError
        When more pairs than nodes are asked for, or an option is another word.
    SizeError
        When the solution would take more memory than the limit.

    Examples
    --------
    >>> rod = Shape.from_mask(np.ones(4), spacing=0.25)
    >>> solve_spectrum(rod, 3).values.round(2) + 0.0
    array([ 0.  ,  9.37, 32.  ])
    >>> solve_spectrum(rod, 1, boundary="absorbing").vectors[:, 0].round(2)
    array([0.53, 1.34, 1.34, 0.53])
    """
    if boundary not in get_args(Condition):
        msg = f"boundary={boundary!r}: expected 'free' or 'absorbing'"
        raise ParameterError(msg)
    system = assemble(shape, model)
    if not _is_whole(n_pairs) or not 1 <= n_pairs <= system.n_nodes:
        msg = f"{shape.name}: n_pairs={n_pairs}: expected 1 to {system.n_nodes}, the number of nodes"
        raise ParameterError(msg)
    if boundary == "free":
        system = free_system(system)
    component = system.domain.component
    solved = [
        _component_pairs(system, np.flatnonzero(component == c), int(n_pairs), boundary, solver)
        for c in range(int(component.max()) + 1)
    ]
    values = np.concatenate([pairs[0] for pairs in solved])
    chosen = np.argsort(values, kind="stable")[:n_pairs]
    vectors = np.zeros((system.n_nodes, n_pairs))
    first = np.cumsum([0, *(pairs[0].size for pairs in solved)])
    for c, (_, own) in enumerate(solved):
        column = np.flatnonzero((first[c] <= chosen) & (chosen < first[c + 1]))
        vectors[np.ix_(component == c, column)] = own[:, chosen[column] - first[c]]
    vectors *= eigenvector_signs(vectors) / np.sqrt(np.prod(shape.spacing))
    return Spectrum(shape, values[chosen], vectors, boundary)


def free_system(system: System) -> System:
    """Leave the boundary edges out: nothing passes the boundary, which lies on the faces of the voxels.

    Parameters
    ----------
    system
        A and M of a shape, as `assemble` makes them.

    Returns
    -------
    System
        A with A·1 = 0, M the identity, and no right-hand side.

    Examples
    --------
    >>> free_system(assemble(Shape.from_mask(np.ones(3)))).matrix().toarray()
    array([[ 1., -1.,  0.],
           [-1.,  2., -1.],
           [ 0., -1.,  1.]])
    """
    inside = system.domain.neighbours < system.n_nodes
    nothing = np.zeros(system.n_nodes)
    diagonal = inside.astype(np.float64) @ np.repeat(system.weights, 2)
    return replace(system, rhs=nothing, diagonal=diagonal, mass=np.ones(system.n_nodes))


def eigenvector_signs(vectors: Array, weights: Array | None = None) -> Array:
    """Return the sign that makes the third moment of each vector positive.

    Where that is negligible, it is the sign that makes the entry of largest magnitude positive.

    Parameters
    ----------
    vectors
        ``(n_nodes, n_pairs)`` vectors, none of them zero everywhere.
    weights
        ``(n_nodes,)`` volume or area of each node; equal by default.

    Examples
    --------
    >>> eigenvector_signs(np.array([[1.0, -3.0], [1.0, 1.0], [-2.0, 2.0]]))
    array([-1., -1.])
    """
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=0)[None], axis=0)[0]
    square = np.square(vectors)
    if weights is not None:
        square *= weights[:, None]
    third, bound = np.sum(square * vectors, axis=0), np.sum(square * np.abs(vectors), axis=0)
    leading = np.where(np.abs(third) > _SMALL_MOMENT * bound, third, largest)
    return np.where(leading < 0, -1.0, 1.0)


def _is_whole(number: Any) -> bool:
    """Tell whole numbers from others, and from truth values."""
    return isinstance(number, (int, np.integer)) and not isinstance(number, bool)


def _component_pairs(
    system: System, nodes: NDArray[Any], n_pairs: int, boundary: Condition, solver: BlockLanczos | None
) -> tuple[Array, Array]:
    """Solve one connected component, for all that could be among the lowest pairs of the whole."""
    part = system if nodes.size == system.n_nodes else _restricted(system, nodes)
    # Far below the first value that is not zero, yet far above what rounding leaves of it.
    extent = np.ptp(np.stack(np.unravel_index(part.shape.voxels, part.shape.mask.shape)), axis=1) + 1
    shift = 1 / float(np.sum(np.square(extent * np.asarray(part.shape.spacing))))
    values, vectors = (solver or BlockLanczos()).lowest(part, min(n_pairs, nodes.size), shift)
    if boundary == "free":
        values[0], vectors[:, 0] = 0.0, nodes.size**-0.5  # what rounding had made of them
    return values, vectors


def _restricted(system: System, nodes: NDArray[Any]) -> System:
    """Take the rows of a connected component."""
    mask = np.zeros(system.shape.mask.shape, bool)
    mask.ravel()[system.shape.voxels[nodes]] = True
    number = np.full(system.n_nodes + 1, nodes.size, np.int32)
    number[nodes] = np.arange(nodes.size, dtype=np.int32)
    held = np.isin(system.domain.boundary_edges[0], nodes)
    domain = Domain(number[system.domain.neighbours[nodes]], system.domain.fraction[held])
    shape = Shape(mask, system.shape.spacing, system.shape.origin, system.shape.name)
    rows = {name: getattr(system, name)[nodes] for name in ("rhs", "diagonal", "mass")}
    return System(shape, domain, system.weights, boundary=system.boundary, **rows)
