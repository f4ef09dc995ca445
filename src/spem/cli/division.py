"""The computing behind `spem parts`, with progress and in the words of the command line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from spem.api.parts import part_sources
from spem.cli.output import complain, counted
from spem.cli.parts import PARTS, PartsRequest
from spem.cli.progress import Bar
from spem.decomposition.choice import ErrorCurve, error_curve
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.joint import joint_parts
from spem.decomposition.parts import Parts
from spem.errors import ParameterError, SizeError
from spem.fields.boundary.sources import Sources
from spem.fields.superposition.fields import SourceFields, solve_several

if TYPE_CHECKING:
    from spem.shapes.shape import Shape

MOST_PARTS = 16
# Cost of the alignment of two shapes above which their bodies differ, or something fuses in one of them.
UNLIKE = 0.03


@contextmanager
def naming_options() -> Iterator[None]:
    """Say by which options memory can be saved, where it does not suffice.

    Raises
    ------
    SizeError
        In place of one that names arguments of the library.

    Examples
    --------
    >>> with naming_options():
    ...     raise SizeError("hand: 9 fields need 4 GiB, the limit is 2 GiB; use Sources.select")
    Traceback (most recent call last):
        ...
    spem.errors.SizeError: hand: 9 fields need 4 GiB, the limit is 2 GiB; ask for fewer sources, ...
    """
    try:
        yield
    except SizeError as error:
        reason = str(error).partition("; ")[0]
        msg = f"{reason}; ask for fewer sources, as with --patches M, or raise SPEM_MEMORY_LIMIT"
        raise SizeError(msg) from error


def divide(shapes: Sequence[Shape], request: PartsRequest) -> list[Parts]:
    """Divide one shape, or several into the same parts.

    Raises
    ------
    SpemError
        When a shape cannot be divided as asked.
    """
    rng = np.random.default_rng(request.seed)
    with naming_options():
        fields = _solve(shapes, request, rng)
        if len(shapes) > 1:
            return _divide_together(fields, request, rng)
        count = request.n_parts or _curve(fields[0], request, rng).suggested
        chosen = region_parts if request.over == "region" else boundary_parts
        return [chosen(fields[0], count, sparsity=request.sparsity, rng=rng)]


def curve(shape: Shape, request: PartsRequest) -> ErrorCurve:
    """Return the error of the parts of a shape against their number, up to that asked for.

    Raises
    ------
    SpemError
        When the shape cannot be divided as asked.
    """
    rng = np.random.default_rng(request.seed)
    with naming_options():
        return _curve(_solve([shape], request, rng)[0], request, rng)


def _solve(shapes: Sequence[Shape], request: PartsRequest, rng: np.random.Generator) -> list[SourceFields]:
    """Solve for the fields of the sources of all shapes, once it is known that they will do."""
    several = [part_sources(shape, request.n_patches, boundary=request.boundary, rng=rng) for shape in shapes]
    for sources in several:
        _check_count(sources, request.n_parts)
    with Bar() as bar:
        return solve_several(several, request.rho, progress=bar.advance)


def _check_count(sources: Sources, n_parts: int | None) -> None:
    """Refuse more parts than sources or nodes, before fields are solved for."""
    name, m, n = sources.system.shape.name, sources.n_sources, sources.system.n_nodes
    if n_parts is not None and n_parts > min(m, n):
        what = f"{name} has {counted(m, 'source')} and {counted(n, 'node')}"
        msg = f"-k {n_parts}: {what}; expected at most {min(m, n)}"
        raise ParameterError(msg)


def _divide_together(
    fields: Sequence[SourceFields], request: PartsRequest, rng: np.random.Generator
) -> list[Parts]:
    """Divide several shapes so that one label is the same part in all; tell which are unlike the others."""
    count = request.n_parts or PARTS
    found = joint_parts(fields, count, over=request.over, sparsity=request.sparsity, rng=rng)
    like = found.parts[found.reference].shape.name
    for i, (parts, cost) in enumerate(zip(found.parts, found.costs, strict=True)):
        if i != found.reference and cost > UNLIKE:
            complain(f"note: {parts.shape.name} is unlike {like}; their parts may not be the same")
    return list(found.parts)


def _curve(fields: SourceFields, request: PartsRequest, rng: np.random.Generator) -> ErrorCurve:
    """Return the error curve up to the number of parts asked for, or to its default."""
    with Bar() as bar:

        def advance(k: int, total: int) -> None:
            bar.advance("curve", k, total)

        return error_curve(
            fields,
            request.n_parts or MOST_PARTS,
            over=request.over,
            sparsity=request.sparsity,
            rng=rng,
            progress=advance,
        )
