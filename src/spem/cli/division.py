"""The computing behind `spem parts`, with progress and in the words of the command line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from spem.api.parts import parts as matched_parts
from spem.api.parts import sources as boundary_sources
from spem.cli.output import counted
from spem.cli.progress import Bar
from spem.decomposition.choice import ErrorCurve, error_curve
from spem.decomposition.division import boundary_parts, region_parts
from spem.decomposition.parts import Parts
from spem.errors import ParameterError, SizeError
from spem.fields.operator import Boundary
from spem.fields.source_fields import SourceFields, solve_sources
from spem.fields.sources import Sources

if TYPE_CHECKING:
    from spem.cli.parts import PartsRequest
    from spem.shapes.shape import Shape

PATCHES = 200
MOST_PARTS = 16


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
    with naming_options():
        if len(shapes) > 1:
            return _divide_together(shapes, request)
        rng = np.random.default_rng(request.seed)
        fields = _fields(shapes[0], request, rng)
        count = request.n_parts or _curve(fields, request, MOST_PARTS, rng).suggested
        chosen = region_parts if request.over == "region" else boundary_parts
        return [chosen(fields, count, sparsity=request.sparsity, rng=rng)]


def curve(shape: Shape, request: PartsRequest) -> ErrorCurve:
    """Return the error of the parts of a shape against their number, up to that asked for.

    Raises
    ------
    SpemError
        When the shape cannot be divided as asked.
    """
    with naming_options():
        rng = np.random.default_rng(request.seed)
        return _curve(_fields(shape, request, rng), request, request.n_parts or MOST_PARTS, rng)


def default_patches(single: Sources) -> int:
    """Return the number of patches of a boundary, its single points given: 200, if it has as many points."""
    return max(min(PATCHES, single.n_sources), single.points.n_contours)


def patch_boundary(
    shape: Shape, count: int | None, boundary: Boundary, rng: np.random.Generator | None = None
) -> Sources:
    """Divide a boundary into patches, as many as asked for or by default.

    Raises
    ------
    ParameterError
        When there are fewer points, or more separate pieces, than patches.
    """
    if count is None:
        count = default_patches(boundary_sources(shape, boundary=boundary))
    return boundary_sources(shape, count, boundary=boundary, rng=rng)


def _divide_together(shapes: Sequence[Shape], request: PartsRequest) -> list[Parts]:
    """Divide several shapes so that one label is the same part in all."""
    divided: list[Parts] = matched_parts(  # type: ignore[assignment]
        shapes,  # type: ignore[arg-type]
        request.n_parts or 1,
        over=request.over,
        rho=request.rho,
        sparsity=request.sparsity,
        n_patches=request.n_patches,
        boundary=request.boundary,
        rng=np.random.default_rng(request.seed),
    )
    return divided


def _fields(shape: Shape, request: PartsRequest, rng: np.random.Generator) -> SourceFields:
    """Solve for the fields of the sources of one shape."""
    if request.n_patches is None and shape.ndim < 3:
        sources = boundary_sources(shape, boundary=request.boundary)
    else:
        sources = patch_boundary(shape, request.n_patches, request.boundary, rng)
    most = min(sources.n_sources, shape.n_nodes)
    if request.n_parts is not None and request.n_parts > most:
        what = f"{shape.name} has {counted(sources.n_sources, 'source')} and {counted(shape.n_nodes, 'node')}"
        msg = f"-k {request.n_parts}: {what}; expected at most {most}"
        raise ParameterError(msg)
    with Bar() as bar:
        return solve_sources(sources, request.rho, progress=bar.advance)


def _curve(fields: SourceFields, request: PartsRequest, most: int, rng: np.random.Generator) -> ErrorCurve:
    """Return the error curve up to a number of parts."""
    with Bar() as bar:

        def advance(k: int, total: int) -> None:
            bar.advance("curve", k, total)

        return error_curve(
            fields, most, over=request.over, sparsity=request.sparsity, rng=rng, progress=advance
        )
