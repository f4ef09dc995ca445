"""Node features of kinds "shape-context" and "inner-distance": what each point of a contour sees (2-D)."""

from __future__ import annotations

import numpy as np

from spem.codes.bands import Bands
from spem.codes.settings import Settings
from spem.embedding.shape_context import inner_distance_shape_context, shape_context
from spem.shapes.shape import Shape

N_POINTS = 128
N_RADII = 8
N_ANGLES = 8
_CONTEXTS = {"shape-context": shape_context, "inner-distance": inner_distance_shape_context}


def contour_features(shape: Shape, settings: Settings, threads: int | None = None) -> Bands:
    """Compute the shape contexts that the settings name, at points spread evenly along the contours.

    The roots of the shares are taken, so that rare directions count (the Hellinger distance). Each point
    counts a second time as it is in the mirror image of the shape, so that both have the same code.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    settings
        Kind of features, and boundary model.
    threads
        Without effect: one shape takes milliseconds.

    Returns
    -------
    tuple
        One band, ``(256, 64)`` in float32: eight distances by eight directions.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> settings = Settings(features="shape-context")
    >>> contour_features(disk(radius=10.0, spacing=1.0), settings)[0].shape
    (256, 64)
    """
    context = _CONTEXTS[settings.features]
    shares = context(shape, N_POINTS, n_radii=N_RADII, n_angles=N_ANGLES, boundary=settings.boundary)
    values = np.sqrt(shares).astype(np.float32)
    # From the tangent, a direction θ becomes π − θ; bins lie about multiples of 2π / 8.
    turned = (N_ANGLES // 2 - np.arange(N_ANGLES)) % N_ANGLES
    mirrored = values.reshape(-1, N_RADII, N_ANGLES)[:, :, turned].reshape(values.shape)
    return (np.vstack([values, mirrored]),)
