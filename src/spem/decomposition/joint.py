"""One division of several shapes: parts that mean the same in all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.alignment import align, most_typical, relations
from spem.decomposition.coding_descent import encode
from spem.decomposition.division import SPARSITY, check_division, limit_of, parts_of_factors
from spem.decomposition.handedness import settle_hands
from spem.decomposition.matched import MatchedParts
from spem.decomposition.measurements import Centre, Over, measurements
from spem.decomposition.parts import Parts
from spem.decomposition.sparse_coding import NonnegativeSparseCoding, largest_sparsity
from spem.errors import ParameterError, require_kind
from spem.fields.superposition.fields import SourceFields

Array = NDArray[np.float64]

# Nodes of all shapes together that the common components are learnt from; each shape gives as many.
_NODES = 20_000
_TOLERANCE = 1e-5


def joint_parts(
    fields: Sequence[SourceFields],
    n_parts: int = 8,
    *,
    over: Over = "region",
    sparsity: float = SPARSITY,
    centre: Centre = "mean",
    reference: int | None = None,
    n_init: int = 4,
    rng: np.random.Generator | None = None,
) -> MatchedParts:
    """Divide several shapes into the same parts.

    The sources of each shape are put in correspondence with those of a reference, by a coupling that keeps
    their distances by interactions and along the boundary. Measurements carried to the reference are
    decomposed together (4.3), so that all shapes share one matrix A over its sources (or, over the boundary,
    one S); A carried back to the sources of each shape labels it by its own measurements. No point
    correspondence is given, and bending limbs changes little. Only left and
    right of solids, which interactions do not tell apart, are settled by where parts lie.

    Parameters
    ----------
    fields
        Fields of each shape, at one ρ: of like shapes, such as poses of one body. Numbers of sources may
        differ.
    n_parts
        Number k of parts.
    over
        What is divided, the ``"region"`` (4.1) or the ``"boundary"`` (5.2).
    sparsity
        λ of (4.3) as a share of the λ at which all codes vanish.
    centre
        What the log-fields are measured from, ``"mean"`` or ``"median"``.
    reference
        Number of the shape that the others are aligned with; by default the most typical one.
    n_init
        Number of starts of the sparse coding.
    rng
        Randomness of the starts and of the nodes learnt from; seed 0 by default.

    Raises
    ------
    ParameterError
        When an argument is out of its range, the fields differ in ρ, or there are none.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> hook = np.zeros((24, 24))
    >>> hook[2:22, 2:7] = hook[16:22, 2:14] = 1
    >>> shapes = [Shape.from_mask(hook), Shape.from_mask(hook.T)]
    >>> fields = [solve_sources(point_sources(assemble(shape, "voxel")), np.inf) for shape in shapes]
    >>> first, second = (parts.shape.to_grid(parts.node_labels, -1) for parts in joint_parts(fields, 2).parts)
    >>> bool(np.mean(first == second.T) > 0.99)
    True
    """
    rng = np.random.default_rng(0) if rng is None else rng
    _check(fields, n_parts, sparsity, reference)
    known = [relations(f) for f in fields]
    chosen = most_typical(known) if reference is None else reference
    couplings = [align(known[chosen], other) for other in known]
    measured = [measurements(f, centre, over=over) for f in fields]
    share = _NODES // len(fields) + 1
    drawn = [rng.choice(m.shape[1], min(share, m.shape[1]), replace=False) for m in measured]
    carried = [c.to_first(m[:, i]) for c, m, i in zip(couplings, measured, drawn, strict=True)]
    samples = np.ascontiguousarray(np.hstack(carried).T if over == "region" else np.hstack(carried))
    limit = limit_of(samples, fields[chosen])
    coder = NonnegativeSparseCoding(
        n_parts,
        sparsity * limit,
        n_init=n_init,
        tol=_TOLERANCE,
        random_state=int(rng.integers(2**31)),
    )
    codes = coder.fit_transform(samples)
    common = coder.components_ if over == "region" else np.ascontiguousarray(codes.T)
    found = [
        _own_parts(f, over, m, c.to_second(common.T).T, sparsity)
        for f, m, c in zip(fields, measured, couplings, strict=True)
    ]
    order = np.argsort(-np.mean([p.sizes for p in found], axis=0), kind="stable")
    costs = np.array([c.cost for c in couplings])
    settled = settle_hands([p.relabelled(order) for p in found], chosen)
    return MatchedParts(settled, chosen, costs)


def _own_parts(f: SourceFields, over: Over, measured: Array, on_sources: Array, sparsity: float) -> Parts:
    """Parts of one shape by its own measurements and the common components on its sources ``(k, m)``."""
    unit = _unit(on_sources)
    if over == "region":
        samples = np.ascontiguousarray(measured.T)
        codes = encode(samples, unit, sparsity * largest_sparsity(samples))
        return parts_of_factors(f, over, measured, np.ascontiguousarray(codes.T), unit)
    basis = _unit(np.ascontiguousarray(encode(np.ascontiguousarray(measured.T), unit, 0.0).T))
    codes = encode(measured, basis, sparsity * largest_sparsity(measured))
    return parts_of_factors(f, over, measured, np.ascontiguousarray(codes.T), basis)


def _unit(rows: Array) -> Array:
    """Scale rows to norm 1, but for those that are 0."""
    norm = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.ascontiguousarray(rows / np.where(norm > 0, norm, 1.0))


def _check(fields: Sequence[SourceFields], n_parts: int, sparsity: float, reference: int | None) -> None:
    """Refuse shapes and parameters that do not go together."""
    require_kind(fields, Sequence, "give the fields of all shapes as a list")
    if not fields:
        msg = "no shapes: expected the fields of one shape or several"
        raise ParameterError(msg)
    for f in fields:
        check_division(f, n_parts, sparsity)
    first = fields[0].sources.system.shape
    for f in fields:
        shape = f.sources.system.shape
        if f.rho != fields[0].rho:
            msg = f"{shape.name} has ρ {f.rho:g}, {first.name} has {fields[0].rho:g}: expected one ρ for all"
            raise ParameterError(msg)
        if shape.ndim != first.ndim:
            msg = (
                f"{shape.name} is {shape.ndim}-D, {first.name} is {first.ndim}-D: shapes of one dimension "
                "have parts in common; divide them apart"
            )
            raise ParameterError(msg)
    if reference is not None and reference not in range(len(fields)):
        msg = f"reference={reference}: expected the number of a shape, 0 to {len(fields) - 1}"
        raise ParameterError(msg)
