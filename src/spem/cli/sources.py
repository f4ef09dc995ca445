"""Fields of single boundary sources that a user points at."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spem.api.parts import part_sources
from spem.api.parts import sources as boundary_sources
from spem.cli.division import naming_options
from spem.cli.output import complain, counted, write_figure, write_npz
from spem.cli.progress import Bar
from spem.cli.results import about, summarise
from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources
from spem.fields.operator import Boundary
from spem.fields.superposition.fields import solve_sources

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from spem.shapes.shape import Shape


@dataclass(frozen=True)
class SourceRequest:
    """Sources as they were asked for.

    Parameters
    ----------
    places
        Coordinates of each, as text.
    as_patches
        Whether a source is a patch, or else one boundary node.
    n_patches
        Number of patches that the boundary is divided into, or as many as it has points.
    boundary
        The boundary model.
    """

    places: tuple[str, ...]
    as_patches: bool
    n_patches: int
    boundary: Boundary


def write_sources(
    shape: Shape,
    request: SourceRequest,
    rho: NDArray[np.float64],
    output: Path | None,
    plot: Path | None,
    *,
    json: bool,
) -> None:
    """Solve for the fields of single sources, write, draw and tell them.

    Raises
    ------
    SpemError
        When a place is no point near the boundary, or the fields do not fit in memory.
    """
    chosen, distance, lines = _choose(shape, request)
    with naming_options(), Bar() as bar:
        fields = [solve_sources(chosen, float(value), progress=bar.advance) for value in rho]
    log = np.stack([field.log.T for field in fields], axis=1)  # (n_nodes, n_rho, n_sources)
    with np.errstate(under="ignore"):
        values = np.exp(log)
    _tell_unreached(log)
    if output is not None:
        arrays = {"points": shape.points, "values": values, "log": log, "rho": rho}
        arrays |= {"sources": chosen.position, "distance": distance}
        write_npz(output, **arrays, **about(shape, request.boundary))
    if plot is not None:
        from spem.plots.source_logs import figure_logs

        columns = log.reshape(shape.n_nodes, -1)
        where = np.tile(chosen.position, (len(rho), 1))
        write_figure(plot, figure_logs(shape, columns, _titles(rho, chosen.position), sources=where))
    summary: dict[str, Any] = {"boundary": request.boundary, "rho": rho}
    summary |= {"sources": chosen.position, "distance": distance, "measure": chosen.measure}
    summary |= {"min_log": log.min(axis=0), "mean": values.mean(axis=0)}
    summarise(shape, summary, output, plot, json=json, lines=lines)


def read_point(text: str, shape: Shape, option: str) -> tuple[float, ...]:
    """Parse a point in the shape's own coordinates.

    Raises
    ------
    ParameterError
        When it is not as many finite numbers as the shape has dimensions.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> read_point("3,-4.5", Shape.from_mask(np.ones((2, 2))), "--source")
    (3.0, -4.5)
    """
    try:
        point = tuple(float(part) for part in text.split(","))
    except ValueError:
        point = ()
    if len(point) != shape.ndim or not all(map(math.isfinite, point)):
        example = ",".join(f"{x:g}" for x in shape.points[0])
        wanted = f"a point of {shape.name} has {shape.ndim} finite coordinates, such as {option} {example}"
        msg = f"{option} {text}: {wanted}"
        raise ParameterError(msg)
    return point


def _choose(shape: Shape, request: SourceRequest) -> tuple[Sources, NDArray[np.float64], list[str]]:
    """Find the sources asked for, how far they are from where they were asked for, and what to tell."""
    option = "--patch" if request.as_patches else "--source"
    places = [read_point(text, shape, option) for text in request.places]
    if request.as_patches:
        found = part_sources(shape, request.n_patches, boundary=request.boundary)
    else:
        found = boundary_sources(shape, boundary=request.boundary)
    numbers, distance = found.nearest(places)
    chosen = found.select(numbers)
    lines = []
    for i, text in enumerate(request.places):
        place = ",".join(f"{x:.6g}" for x in chosen.position[i])
        if request.as_patches:
            what = f"patch {numbers[i]} of {found.n_sources} about {place}, its boundary"
        else:
            what = f"boundary node {numbers[i]} of {found.n_sources} at {place},"
        lines.append(f"{option} {text}: {what} {distance[i]:.4g} away")
    return chosen, distance, lines


def _tell_unreached(log: NDArray[np.float64]) -> None:
    """Tell of nodes that no source reaches."""
    lost = int(np.isneginf(log).all(axis=(1, 2)).sum())
    if lost:
        nodes = counted(lost, "node")
        complain(f"note: the field is 0, its logarithm -inf, at {nodes} in components that no source touches")


def _titles(rho: NDArray[np.float64], places: NDArray[np.float64]) -> list[str]:
    """One title for each ρ and source."""
    points = [", ".join(f"{x:.4g}" for x in place) for place in places]
    return [f"ρ = {value:g}, p = ({point})" for value in rho for point in points]
