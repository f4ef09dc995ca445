"""The facade over boundary sources: sources, their fields, and parts of one shape or several."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from spem.decomposition.division import SPARSITY, boundary_parts, region_parts
from spem.decomposition.joint import joint_parts
from spem.decomposition.measurements import Over
from spem.decomposition.parts import Parts
from spem.errors import ParameterError, require_kind
from spem.fields.boundary.patches import divide_points, patch_sources
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import Boundary, assemble
from spem.fields.superposition.fields import SourceFields, solve_several, solve_sources
from spem.shapes.shape import Shape

# Enough to tell fingers apart; more, up to every boundary point, make parts no steadier.
_PATCHES = 200
_DIVIDE = {"region": region_parts, "boundary": boundary_parts}


def sources(
    shape: Shape,
    n_patches: int | None = None,
    *,
    at: ArrayLike | None = None,
    boundary: Boundary = "surface",
    rng: np.random.Generator | None = None,
) -> Sources:
    """Divide the boundary of a shape into sources (2.2).

    By default they lie on the ``"surface"``, as those of `spem.field`; `spem.parts` has the paper's, of the
    ``"voxel"`` boundary.

    Parameters
    ----------
    shape
        Any shape.
    n_patches
        Number of connected patches of nearly equal area; every boundary point alone by default.
    at
        ``(k, d)`` coordinates, in the shape's own: keep only the sources nearest to them, in that order.
    boundary
        ``"surface"``: boundary points are where the surface cuts an edge; ``"voxel"``: the outside voxels
        next to the shape, as in the paper.
    rng
        Where the patches begin; see `spem.fields.boundary.patches.patch_sources`.

    Raises
    ------
    ParameterError
        When there are more patches than boundary points, or a coordinate is far from the boundary.

    Examples
    --------
    >>> import spem
    >>> found = spem.sources(spem.synthetic.disk(radius=10.0, spacing=1.0), at=[(0.0, 10.0)])
    >>> found.position.round(1).tolist()
    [[0.0, 10.0]]
    """
    system = assemble(shape, boundary)
    found = point_sources(system) if n_patches is None else patch_sources(system, n_patches, rng)
    return found if at is None else found.select(found.nearest(at)[0])


def source_fields(sources: Sources, rho: float = np.inf) -> SourceFields:
    """Solve for the field v^{p_i} of every source at one ρ (2.2), as logarithms right in every entry.

    Parameters
    ----------
    sources
        Sources of one shape.
    rho
        The screening length, in the unit of the spacing; `inf` for the Laplace equation.

    Raises
    ------
    ParameterError
        When ρ is not one positive length.
    SizeError
        When the fields or the factorisation do not fit in memory.

    Examples
    --------
    >>> import spem
    >>> fields = spem.source_fields(spem.sources(spem.synthetic.disk(radius=10.0, spacing=1.0)), rho=3.0)
    >>> bool((fields.log < 0).all())
    True
    """
    require_kind(sources, Sources, "make them first: spem.sources(shape)")
    return solve_sources(sources, rho)


@overload
def parts(
    shapes: Shape,
    n_parts: int = ...,
    *,
    over: Over = ...,
    rho: float = ...,
    sparsity: float = ...,
    n_patches: int | None = ...,
    boundary: Boundary = ...,
    rng: np.random.Generator | None = ...,
) -> Parts: ...


@overload
def parts(
    shapes: Sequence[Shape],
    n_parts: int = ...,
    *,
    over: Over = ...,
    rho: float = ...,
    sparsity: float = ...,
    n_patches: int | None = ...,
    boundary: Boundary = ...,
    rng: np.random.Generator | None = ...,
) -> list[Parts]: ...


def parts(
    shapes: Shape | Sequence[Shape],
    n_parts: int = 8,
    *,
    over: Over = "region",
    rho: float = np.inf,
    sparsity: float = SPARSITY,
    n_patches: int | None = _PATCHES,
    boundary: Boundary = "voxel",
    rng: np.random.Generator | None = None,
) -> Parts | list[Parts]:
    """Divide a shape into parts by non-negative sparse coding of its sources' fields (4.1, 4.3, 5.2).

    By default sources are the paper's, of the ``"voxel"`` boundary, unlike those of `spem.sources`.

    Parameters
    ----------
    shapes
        A shape; or several, poses of one body or like ones, divided together: one label is the same part in
        all of them.
    n_parts
        Number k of components.
    over
        What is divided: the ``"region"`` (4.1) or the ``"boundary"`` (5.2).
    rho
        Screening length of the slice, in the unit of the spacing.
    sparsity
        λ of (4.3), relative: as a share of the λ at which all codes vanish. That of
        `NonnegativeSparseCoding` is absolute.
    n_patches
        Patches of the boundary, one source each: as many, or every boundary point where there are no more,
        or one for each separate piece of the boundary where there are more of these. None: every boundary
        point, as the paper has it for silhouettes.
    boundary
        Boundary model; by default the paper's, where a source is an outside voxel.
    rng
        Randomness of patches and starts.

    Raises
    ------
    ParameterError
        When an argument is out of its range.
    SizeError
        When the fields or a factorisation do not fit in memory.

    Examples
    --------
    >>> import numpy as np, spem
    >>> bone = np.pad(np.ones((3, 20)), ((4, 4), (0, 0)))
    >>> bone[:, :8] = bone[:, -8:] = 1
    >>> bone = spem.Shape.from_mask(bone, name="bone")
    >>> spem.parts(bone, 2)
    Parts('bone', 2 parts of its region, rho inf, sizes 50, 50 %)
    >>> [p.sizes.round(2).tolist() for p in spem.parts([bone, bone], 2)]
    [[0.5, 0.5], [0.5, 0.5]]
    """
    if over not in _DIVIDE:
        msg = f"over={over!r}: expected one of {', '.join(map(repr, _DIVIDE))}"
        raise ParameterError(msg)
    together = isinstance(shapes, Iterable) and not isinstance(shapes, str)
    several: Sequence[Shape] = list(shapes) if together else [shapes]  # type: ignore[arg-type, list-item]
    for shape in several:
        require_kind(shape, Shape, "read it first: spem.read(...)")
    divided = [part_sources(shape, n_patches, boundary=boundary, rng=rng) for shape in several]
    fields = solve_several(divided, rho)
    if not isinstance(shapes, Shape):
        return list(joint_parts(fields, n_parts, over=over, sparsity=sparsity, rng=rng).parts)
    return _DIVIDE[over](fields[0], n_parts, sparsity=sparsity, rng=rng)


def part_sources(
    shape: Shape,
    n_patches: int | None = _PATCHES,
    *,
    boundary: Boundary = "voxel",
    rng: np.random.Generator | None = None,
) -> Sources:
    """Return the sources that a shape is divided by: patches, or every point where there are no more.

    There is one patch for each separate piece of the boundary at least.

    Parameters
    ----------
    shape, n_patches, boundary, rng
        As for `parts`.
    """
    points = sources(shape, boundary=boundary)
    if n_patches is None or n_patches >= points.n_sources:
        return points
    fewest = points.points.n_contours if n_patches > 0 else n_patches
    return divide_points(points, max(n_patches, fewest), rng)
