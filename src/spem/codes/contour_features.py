"""Node features of kinds "shape-context" and "inner-distance": what each point of a contour sees (2-D)."""

from __future__ import annotations

import numpy as np

from spem.codes.bands import Bands
from spem.codes.settings import Settings
from spem.embedding.shape_context import inner_distance_shape_context, shape_context
from spem.errors import ParameterError
from spem.shapes.shape import Shape

N_POINTS = 128
N_ANGLES = 8
_CONTEXTS = {"shape-context": shape_context, "inner-distance": inner_distance_shape_context}


def contour_features(shape: Shape, settings: Settings, threads: int | None = None) -> Bands:
    """Compute the shape contexts that the settings name, at points spread evenly along the contours.

    The roots of the shares are taken, so that rare directions count (the Hellinger distance).

    Parameters
    ----------
    shape
        A shape of two dimensions.
    settings
        Kind of features, boundary model, and number of values: eight directions for each bin of distance.
    threads
        Without effect: one shape takes milliseconds.

    Returns
    -------
    tuple
        One band, ``(128, n_maps)`` in float32.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When the number of values is no multiple of eight.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> settings = Settings(features="shape-context", n_maps=64)
    >>> contour_features(disk(radius=10.0, spacing=1.0), settings)[0].shape
    (128, 64)
    """
    if settings.n_maps % N_ANGLES:
        msg = (
            f"n_maps={settings.n_maps}: features {settings.features!r} have {N_ANGLES} directions for each "
            f"distance; give a multiple of {N_ANGLES}"
        )
        raise ParameterError(msg)
    context = _CONTEXTS[settings.features]
    n_radii = settings.n_maps // N_ANGLES
    shares = context(shape, N_POINTS, n_radii=n_radii, n_angles=N_ANGLES, boundary=settings.boundary)
    return (np.sqrt(shares).astype(np.float32),)
