"""The view "parts": the parts of a shape, on its nodes and on what bounds it."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.division import SPARSITY
from spem.server.views.division import Division, divide
from spem.server.views.options import Options, Reply, indices, plain_length
from spem.server.views.outline import contours_of, mesh_of, shown_sources
from spem.shapes.shape import Shape


def view_parts(shape: Shape, options: Options) -> Reply:
    """Return the parts of a shape (4.3), as `spem.parts` finds them.

    Parameters
    ----------
    shape
        Any shape.
    options
        ``k``, from 1 to 12, chosen where it is None; ``max_nodes``, as for the view of the geometry.

    Returns
    -------
    header
        ``k``, ``chosen`` (whether it was), ``sparsity`` with λ of (4.3) as ``penalty`` and relative to the λ
        at which all codes vanish as ``share``, ``rho``, ``boundary``, ``n_sources``, ``divided_nodes`` (on
        how many the parts were found), ``unexplained`` (share of the nodes in no part) and ``seconds``.
    arrays
        ``node_part (n,)``, -1 for none; ``strength (n, k)`` codes of the nodes; ``sizes`` and ``intensity``
        ``(k,)``; ``contour_part`` in 2-D and ``vertex_part`` in 3-D, of the points of the view of the
        geometry; ``curve (12,)``, the error left by 1, 2, … parts, where the number was chosen.

    Raises
    ------
    ParameterError
        When `k` is out of its range, or the shape cannot be divided.

    Examples
    --------
    >>> header, arrays = view_parts(Shape.from_mask(np.ones((4, 12))), {"k": 2})
    >>> header["k"], arrays["sizes"].tolist(), arrays["contour_part"].shape
    (2, [0.5, 0.5], (32,))
    """
    start = perf_counter()
    division = divide(shape, options)
    parts = division.parts
    arrays = {
        "node_part": indices(division.labels),
        "strength": parts.components.T[division.node].astype(np.float32),
        "sizes": parts.sizes.astype(np.float32),
        "intensity": parts.intensity.astype(np.float32),
        **_rim(division),
    }
    if division.curve is not None:
        arrays["curve"] = division.curve.errors.astype(np.float32)
    header = {
        "k": parts.n_parts,
        "chosen": division.curve is not None,
        "sparsity": {"penalty": division.penalty, "share": SPARSITY},
        "rho": plain_length(parts.rho),
        "boundary": parts.sources.system.boundary,
        "n_sources": parts.sources.n_sources,
        "divided_nodes": parts.shape.n_nodes,
        "unexplained": parts.unexplained,
        "seconds": perf_counter() - start,
    }
    return header, arrays


def _rim(division: Division) -> dict[str, NDArray[Any]]:
    """Return the parts of the points of contours, or of the vertices of a mesh."""
    shape, labels = division.shape, division.labels
    if shape.ndim == 2:
        return {"contour_part": indices(labels[contours_of(shape, shown_sources(shape)).node])}
    if shape.ndim == 3:
        return {"vertex_part": indices(labels[mesh_of(shape).node])}
    return {}
