"""The view "field": fields of all ρ and the SPEM maps, as combinations of a few columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.api.fields import sweep
from spem.embedding.maps import Maps, compute_maps
from spem.fields.hyperfield import Hyperfield
from spem.server.views.options import Options, Reply, shown_shape, whole_option
from spem.shapes.shape import Shape

N_MAPS = 8
QUANTILES = (5, 25, 50, 75, 95)
# Quantiles of more nodes than these move by less than a line is wide.
_COUNTED = 20_000


def view_field(shape: Shape, options: Options) -> Reply:
    """Return a hyperfield in its low-rank form: the field of ``rho[i]`` is ``basis @ coefficients[i]``.

    Parameters
    ----------
    shape
        Any shape.
    options
        ``max_nodes``, as for the view of the geometry; ``n_maps``, 8 by default.

    Returns
    -------
    header
        ``boundary``, ``error`` (estimate of the largest error of any field), ``explained`` (share of the
        variance that each map has) and ``size``.
    arrays
        ``basis (n, r)``, the constant first; ``coefficients (n_rho, r)``; ``rho`` and ``rho_relative``, in
        units of the size; ``maps (n_maps, r)``: map k is ``basis @ maps[k]``; ``components (n_maps, n_rho)``,
        the vectors Φ that maps project on; ``population (n_rho, 5)``, quantiles of v over the nodes. All in
        float32.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> header, arrays = view_field(disk(radius=10.0, spacing=1.0), {})
    >>> v = arrays["basis"] @ arrays["coefficients"][-1]
    >>> bool((v > 0).all()), bool((v <= 1 + 1e-5).all()), arrays["population"].shape
    (True, True, (64, 5))
    """
    n_maps = whole_option(options, "n_maps", N_MAPS, 1, 32)
    field, maps = shown_maps(shape, options, n_maps)
    coefficients = field.coefficients()  # (r, n_rho)
    basis = np.empty((field.shape.n_nodes, field.rank + 1), np.float32)
    basis[:, 0] = 1.0
    basis[:, 1:] = field.basis
    arrays = {
        "basis": basis,
        "coefficients": coefficients.T,
        "rho": field.rho,
        "rho_relative": field.rho / field.shape.size,
        # P = YΦ and Y = basis @ coefficients
        "maps": (coefficients @ maps.basis).T,
        "components": maps.basis.T,
        "population": population(field),
    }
    header = {
        "boundary": field.boundary,
        "error": float(field.error),
        "explained": maps.explained.tolist(),
        "size": field.shape.size,
    }
    return header, {name: np.ascontiguousarray(values, np.float32) for name, values in arrays.items()}


def shown_maps(shape: Shape, options: Options, n_maps: int = N_MAPS) -> tuple[Hyperfield, Maps]:
    """Sweep the shape that the views show over the default range of ρ, and return its maps too.

    Examples
    --------
    >>> field, maps = shown_maps(Shape.from_mask(np.ones((9, 9))), {}, 3)
    >>> field.rho.size, maps.values.shape
    (64, (81, 3))
    """
    field = sweep(shown_shape(shape, options))
    return field, compute_maps(field, n_maps)


def population(field: Hyperfield) -> NDArray[np.float64]:
    """Return the 5, 25, 50, 75 and 95 % quantiles ``(n_rho, 5)`` of the sampled fields over the nodes.

    Of many nodes every so manieth is counted.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> found = population(sweep(disk(radius=10.0, spacing=1.0), [1.0, 5.0]))
    >>> bool((np.diff(found, axis=1) > 0).all())
    True
    """
    some = field.basis[:: -(-field.shape.n_nodes // _COUNTED)]
    coefficients = field.coefficients().astype(some.dtype)
    values = some @ coefficients[1:] + coefficients[0]
    return np.asarray(np.percentile(values, QUANTILES, axis=0).T)
