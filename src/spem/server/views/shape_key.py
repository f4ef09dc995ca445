"""Shapes as keys of what is kept between views: a worker unpacks the same shape anew for each of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.shapes.shape import Shape


@dataclass(frozen=True)
class ShapeKey:
    """A shape by its content; keys of equal digest are equal.

    Parameters
    ----------
    digest
        SHA-256 of name, grid, inside, cuts and surface.
    shape
        The shape.

    Examples
    --------
    >>> one, two = (Shape.from_mask(np.ones((2, 3))) for _ in range(2))
    >>> ShapeKey.of(one) == ShapeKey.of(two), one == two
    (True, False)
    """

    digest: bytes
    shape: Shape = field(compare=False)

    @classmethod
    def of(cls, shape: Shape) -> Self:
        """Return the key of a shape."""
        cuts, surface = shape.cuts, shape.surface
        arrays: list[NDArray[Any]] = [np.packbits(shape.mask), cuts.voxel, cuts.direction, cuts.fraction]
        if surface is not None:
            arrays += [surface.vertices, surface.faces]
        sizes = [array.shape for array in arrays]
        said = repr((shape.name, shape.mask.shape, shape.spacing, shape.origin, sizes)).encode()
        return cls(sha256(said + b"".join(array.tobytes() for array in arrays)).digest(), shape)
