"""The screened Poisson operator of one shape: (A + M/ρ²) v = b on its nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse
from numba import njit
from numpy.typing import NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.domain import Domain, surface_domain, voxel_domain
from spem.shapes.shape import Shape

Boundary = Literal["surface", "voxel"]
_DOMAINS = {"surface": surface_domain, "voxel": voxel_domain}
# Weights are squares of spacings, and right-hand sides are scaled besides.
_WIDEST = 1e100


@dataclass(frozen=True, eq=False)
class System:
    """The 2d+1-point discretisation of (1.1) with the boundary values eliminated.

    Every ρ shares this system: its matrix is A + M/ρ² and its right-hand side b. A is a symmetric M-matrix
    with A·1 = b, and M is diagonal: the identity for the ``voxel`` boundary.

    Parameters
    ----------
    shape
        The shape whose nodes carry the field.
    domain
        Neighbours and boundary edges.
    weights
        ``(d,)`` weight of an uncut edge along each axis, 1/h².
    rhs
        ``(n_nodes,)`` b: sum of 1/(θ h²) over the boundary edges of each node.
    diagonal
        ``(n_nodes,)`` diagonal of A.
    mass
        ``(n_nodes,)`` diagonal of M: mean over the axes of the half length of the two edges of each node, in
        edges. An edge that is cut short holds less of the screening. In 1-D this is the scheme of Shortley
        and Weller; in general it halves the error that the identity would leave, at the same order.
    boundary
        The boundary model.
    """

    shape: Shape
    domain: Domain
    weights: NDArray[np.float64]
    rhs: NDArray[np.float64]
    diagonal: NDArray[np.float64]
    mass: NDArray[np.float64]
    boundary: Boundary

    @property
    def n_nodes(self) -> int:
        """Number of unknowns."""
        return self.domain.n_nodes

    def matrix(self, shift: float = 0.0) -> scipy.sparse.csc_array:
        """Assemble A + shift·M as a sparse matrix, rows and columns in node order."""
        node, direction = np.nonzero(self.domain.neighbours < self.n_nodes)
        column = self.domain.neighbours[node, direction]
        off = scipy.sparse.csc_array(
            (-self.weights[direction // 2], (node, column)), shape=(self.n_nodes, self.n_nodes)
        )
        return (off + scipy.sparse.diags_array(self.diagonal + shift * self.mass)).tocsc()


def assemble(shape: Shape, boundary: Boundary = "surface") -> System:
    """Discretise the screened Poisson equation (1.1) on a shape.

    Parameters
    ----------
    shape
        Any shape.
    boundary
        ``"surface"``: v = 1 where the surface cuts each boundary edge (second order); ``"voxel"``: v = 1 at
        the centre of the neighbouring outside voxel, as in the paper (first order).

    Raises
    ------
    ParameterError
        When there is no `Shape`, the boundary model is another word, or squares of the spacing leave the
        range of float64.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> system.matrix().toarray()
    array([[ 2., -1.,  0.],
           [-1.,  2., -1.],
           [ 0., -1.,  2.]])
    >>> system.rhs
    array([1., 0., 1.])
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    if boundary not in _DOMAINS:
        msg = f"boundary={boundary!r}: expected one of {', '.join(map(repr, _DOMAINS))}"
        raise ParameterError(msg)
    if not all(1 / _WIDEST <= h <= _WIDEST for h in shape.spacing):
        span = f"{1 / _WIDEST:g} to {_WIDEST:g}"
        msg = f"{shape.name}: spacing {shape.spacing}: expected {span}; use another unit of length"
        raise ParameterError(msg)
    domain = _DOMAINS[boundary](shape)
    weights = 1.0 / np.square(shape.spacing)
    rhs, diagonal, mass = sums = np.empty((3, domain.n_nodes))
    _eliminate(domain.neighbours, domain.fraction, weights, sums)
    return System(shape, domain, weights, rhs, diagonal, mass, boundary)


@njit(cache=True, nogil=True)
def _eliminate(
    neighbours: NDArray[np.int32],
    fraction: NDArray[np.float64],
    weights: NDArray[np.float64],
    sums: NDArray[np.float64],
) -> None:
    """Write b, the diagonal of A and that of M, from the boundary edges of each node."""
    n, width = neighbours.shape
    whole = 2 * weights.sum()
    edge = 0
    for i in range(n):
        inner = True
        for k in range(width):
            inner &= neighbours[i, k] != n
        source = cut = missing = 0.0
        if not inner:
            for k in range(width):
                if neighbours[i, k] == n:
                    theta = fraction[edge]
                    edge += 1
                    source += weights[k // 2] / theta
                    cut += weights[k // 2]
                    missing += 1 - theta
        sums[0, i] = source
        sums[1, i] = whole - cut + source
        sums[2, i] = 1 - missing / width
