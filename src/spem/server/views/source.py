"""The view "source": the log field of one patch of the boundary."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from spem.errors import ParameterError
from spem.fields.boundary.sources import check_source
from spem.fields.rho import single_rho
from spem.fields.superposition.slices import SourceSlice, prepare_slice
from spem.server.views.options import Options, Reply, plain_length, shown_shape
from spem.server.views.outline import grid_units, shown_sources
from spem.server.views.shape_key import ShapeKey
from spem.shapes.shape import Shape

# Factors of larger shapes would fill the memory that a worker may go on holding.
_KEPT_NODES = 20_000


def view_source(shape: Shape, options: Options) -> Reply:
    """Return the natural logarithm of the field of one source (2.2), right in every entry.

    One is solved for when asked. The factorisation takes a tenth of a second of 15 thousand nodes; that of
    the last shape is kept, unless it is a large one.

    Parameters
    ----------
    shape
        Any shape.
    options
        ``patch``, the number of the patch in the view of the geometry; ``rho`` in the unit of the spacing,
        infinity by default; ``max_nodes``, as there.

    Returns
    -------
    header
        ``patch``, ``n_patches``, ``rho`` (``"inf"`` where it is), ``position`` in indices of the grid,
        ``share`` of the boundary that the patch has, and ``unreached``, the number of nodes in components
        that it does not touch.
    arrays
        ``log (n,)`` in float32; the least value at nodes that are not reached.

    Raises
    ------
    ParameterError
        When there is no such patch, or ρ is no positive length.

    Examples
    --------
    >>> header, arrays = view_source(Shape.from_mask(np.ones((5, 5))), {"patch": 3})
    >>> header["n_patches"], header["unreached"], bool((arrays["log"] < 0).all())
    (20, 0, True)
    """
    patch = options.get("patch")
    if patch is None or isinstance(patch, bool):
        msg = f"{shape.name}: patch={patch!r}: expected the number of a patch of the boundary"
        raise ParameterError(msg)
    shown = shown_shape(shape, options)
    sources = shown_sources(shown)
    check_source(sources, patch)
    length = options.get("rho")
    rho = np.inf if length is None else single_rho(length)
    log = _slice(shown, rho).log(patch, patch + 1)[0]
    reached = np.isfinite(log)
    header = {
        "patch": int(patch),
        "n_patches": sources.n_sources,
        "rho": plain_length(rho),
        "position": grid_units(shown, sources.position[patch]).tolist(),
        "share": float(sources.measure[patch] / sources.measure.sum()),
        "unreached": int(np.count_nonzero(~reached)),
    }
    return header, {"log": np.where(reached, log, log[reached].min()).astype(np.float32)}


def _slice(shape: Shape, rho: float) -> SourceSlice:
    """Return the factored system of a shape, kept from before where it is a small one."""
    if shape.n_nodes > _KEPT_NODES:
        return prepare_slice(shown_sources(shape), rho)
    return _kept_slice(ShapeKey.of(shape), rho)


@lru_cache(maxsize=1)
def _kept_slice(key: ShapeKey, rho: float) -> SourceSlice:
    """Factor the system of a shape."""
    return prepare_slice(shown_sources(key.shape), rho)
