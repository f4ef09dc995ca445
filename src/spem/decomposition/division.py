"""Division of a shape into parts: measurements, sparse coding (4.3), labels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.measurements import Centre, Over, measurements
from spem.decomposition.parts import Parts, strongest_part, touched_part
from spem.decomposition.sparse_coding import NonnegativeSparseCoding, largest_sparsity
from spem.errors import ParameterError
from spem.fields.superposition.fields import SourceFields, require_fields

# A sample belongs to no part where the components together explain less than this share of its square.
MIN_EXPLAINED = 0.1
SPARSITY = 0.1


def region_parts(
    fields: SourceFields,
    n_parts: int = 8,
    *,
    sparsity: float = SPARSITY,
    centre: Centre = "mean",
    n_init: int = 8,
    rng: np.random.Generator | None = None,
) -> Parts:
    """Divide the region of a shape into parts (4.1): nodes with like interactions belong together.

    Parameters
    ----------
    fields
        Fields of sources that cover the boundary, at one ρ; the paper takes ρ = `inf`.
    n_parts
        Number k of components.
    sparsity
        λ of (4.3) as a share, in [0, 1), of the λ at which all codes vanish, the largest norm of a
        measurement: one value means the same for every shape and any number of sources. 0 is non-negative
        matrix factorisation.
    centre
        What the log-fields are measured from, ``"mean"`` or ``"median"`` of the sources.
    n_init
        Number of starts of the sparse coding; the best is kept.
    rng
        Randomness of the starts; seed 0 by default.

    Raises
    ------
    ParameterError
        When an argument is out of its range, or all measurements are equal.

    Examples
    --------
    >>> import spem
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> bone = np.pad(np.ones((3, 20)), ((4, 4), (0, 0)))
    >>> bone[:, :8] = bone[:, -8:] = 1
    >>> shape = spem.Shape.from_mask(bone, name="bone")
    >>> region_parts(solve_sources(point_sources(assemble(shape, "voxel")), np.inf), 2)
    Parts('bone', 2 parts of its region, rho inf, sizes 50, 50 %)
    """
    return _divide(fields, "region", n_parts, sparsity, centre, n_init, rng)


def boundary_parts(
    fields: SourceFields,
    n_parts: int = 8,
    *,
    sparsity: float = SPARSITY,
    centre: Centre = "mean",
    n_init: int = 8,
    rng: np.random.Generator | None = None,
) -> Parts:
    """Divide the boundary of a shape into parts, with the region that each owns (5.2).

    The paper takes the transpose of Y "without normalization (4.2)", which does not say what non-negative
    measurement is meant. Here the log-field of each source is measured from its own mean over the nodes. A
    part owns the nodes from which a random walk most likely ends in it.

    Parameters
    ----------
    fields
        Fields of sources that cover the boundary, at one ρ.
    n_parts
        Number k of components.
    sparsity
        λ of (4.3), as for `region_parts`.
    centre
        What the log-fields are measured from, ``"mean"`` or ``"median"`` of the nodes.
    n_init
        Number of starts of the sparse coding; the best is kept.
    rng
        Randomness of the starts; seed 0 by default.

    Raises
    ------
    ParameterError
        When an argument is out of its range, or all measurements are equal.
    """
    return _divide(fields, "boundary", n_parts, sparsity, centre, n_init, rng)


def parts_of_factors(
    fields: SourceFields,
    over: Over,
    measured: NDArray[np.float64],
    components: NDArray[np.float64],
    basis: NDArray[np.float64],
) -> Parts:
    """Label nodes and sources by the factors of a decomposition.

    Part j is component j. What is divided, a node for the region, a source for the boundary, belongs to the
    component that brings most to its measurement, or to none where all together explain less than a tenth of
    its square. A source then belongs to the part of the region that it is next to, and a node to the part of
    the boundary in which a random walk from it most likely ends, that of the largest sum of fields.

    Parameters
    ----------
    fields
        The fields.
    over
        What is divided, ``"region"`` or ``"boundary"``.
    measured
        ``(n_sources, n_nodes)`` measurements Y.
    components
        ``(k, n_nodes)`` rows of S for the region, ``(k, n_sources)`` for the boundary.
    basis
        ``(k, n_sources)`` columns of A for the region, ``(k, n_nodes)`` for the boundary.
    """
    norm = np.linalg.norm(basis, axis=1)[:, None]
    components, basis = components * norm, basis / np.where(norm > 0, norm, 1.0)
    explained = _explained(measured if over == "region" else measured.T, components, basis)
    labels = np.where(explained < MIN_EXPLAINED, -1, strongest_part(components)).astype(np.int32)
    if over == "region":
        node_labels, source_labels = labels, touched_part(fields.sources, labels, len(components))
    else:
        node_labels, source_labels = _owner(fields, labels, len(components)), labels
    total = components.sum(axis=1)
    intensity = total / max(float(total.sum()), np.finfo(float).tiny)
    return Parts(fields.sources, fields.rho, over, components, basis, node_labels, source_labels, intensity)


def _divide(
    fields: SourceFields,
    over: Over,
    n_parts: int,
    sparsity: float,
    centre: Centre,
    n_init: int,
    rng: np.random.Generator | None,
) -> Parts:
    """Measure, decompose and label."""
    check_division(fields, n_parts, sparsity)
    measured = measurements(fields, centre, over=over)
    samples = np.ascontiguousarray(measured.T if over == "region" else measured)
    coder = NonnegativeSparseCoding(
        n_parts,
        sparsity * limit_of(samples, fields),
        n_init=n_init,
        random_state=int((rng or np.random.default_rng(0)).integers(2**31)),
    )
    codes = coder.fit_transform(samples)
    parts = parts_of_factors(fields, over, measured, np.ascontiguousarray(codes.T), coder.components_)
    return parts.relabelled(_by_size(parts))


def check_division(fields: SourceFields, n_parts: Any, sparsity: Any) -> None:
    """Refuse a number of parts or a sparsity that cannot be.

    Raises
    ------
    ParameterError
        When `n_parts` is no whole number or more than the sources or nodes, or `sparsity` is not in [0, 1).
    """
    require_fields(fields)
    sources, name = fields.sources, fields.sources.system.shape.name
    n_nodes = sources.system.n_nodes
    most = min(sources.n_sources, n_nodes)
    if not isinstance(n_parts, int | np.integer) or not 1 <= n_parts <= most:
        counts = f"{sources.n_sources} sources and {n_nodes} nodes"
        msg = f"{name}: n_parts={n_parts}: expected 1 to {most}, for it has {counts}"
        raise ParameterError(msg)
    if not isinstance(sparsity, int | float | np.number) or not 0 <= sparsity < 1:
        msg = f"sparsity={sparsity}: expected 0 to less than 1, where all codes vanish"
        raise ParameterError(msg)


def limit_of(samples: NDArray[np.float64], fields: SourceFields) -> float:
    """Return the λ at which all codes of samples vanish.

    Raises
    ------
    ParameterError
        When it is 0, for all measurements are equal.
    """
    limit = largest_sparsity(samples)
    if limit == 0:
        name, count = fields.sources.system.shape.name, fields.sources.n_sources
        msg = f"{name}: the log-fields of its {count} sources do not differ; there is nothing to divide"
        raise ParameterError(msg)
    return limit


def _explained(
    samples: NDArray[np.float64], components: NDArray[np.float64], basis: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share of the square of each column that A S explains."""
    residual = basis.T @ components
    residual -= samples
    square = np.einsum("ij,ij->j", samples, samples)
    left = np.einsum("ij,ij->j", residual, residual)
    return np.asarray(1 - left / np.maximum(square, np.finfo(float).tiny))


def _owner(fields: SourceFields, source_labels: NDArray[np.int32], n_parts: int) -> NDArray[np.int32]:
    """Part of the boundary in which a walk from each node most likely ends."""
    share = np.exp(fields.log - np.maximum(fields.log.max(axis=0), np.finfo(float).min))
    ends = np.zeros((n_parts, fields.sources.n_sources))
    labelled = np.flatnonzero(source_labels >= 0)
    ends[source_labels[labelled], labelled] = 1.0
    return strongest_part(ends @ share)


def _by_size(parts: Parts) -> NDArray[np.int64]:
    """Order of the parts: most nodes first; of equal ones, that with the first node."""
    first = [np.argmax(parts.node_labels == j) for j in range(parts.n_parts)]
    return np.lexsort((first, -parts.sizes))
