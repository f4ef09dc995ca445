"""What the rivals for silhouettes share: the shape as an image, and distances between vectors."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import pdist, squareform

from spem.errors import ShapeError, require_kind
from spem.shapes.shape import Shape


def require_silhouette(shape: Shape, what: str) -> None:
    """Refuse what is no shape of two dimensions on square pixels.

    Raises
    ------
    ShapeError
        When it is not.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball
    >>> require_silhouette(ball(1.0, 0.5), "Zernike moments")
    Traceback (most recent call last):
        ...
    spem.errors.ShapeError: ball: Zernike moments are of silhouettes on square pixels, not of a 3-D shape...
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    if shape.ndim != 2 or not math.isclose(*shape.spacing):
        steps = " x ".join(f"{h:g}" for h in shape.spacing)
        found = f"a {shape.ndim}-D shape of spacing {steps}"
        msg = f"{shape.name}: {what} are of silhouettes on square pixels, not of {found}"
        raise ShapeError(msg)


def euclidean_distances(vectors: NDArray[np.float64], *, standardised: bool = False) -> NDArray[np.float64]:
    """Return the Euclidean distances between the vectors of a collection.

    Parameters
    ----------
    vectors
        ``(n_shapes, n_values)``.
    standardised
        Whether each value is divided by its standard deviation over the collection; one that is constant
        counts for nothing.

    Returns
    -------
    NDArray
        ``(n_shapes, n_shapes)``.

    Examples
    --------
    >>> euclidean_distances(np.array([[0.0, 0.0], [3.0, 4.0]]))
    array([[0., 5.],
           [5., 0.]])
    """
    if standardised:
        deviation = vectors.std(axis=0)
        varied = deviation > 0
        vectors = vectors[:, varied] / deviation[varied]
    if not vectors.shape[1]:
        return np.zeros((len(vectors), len(vectors)))
    return np.asarray(squareform(pdist(vectors)))
