"""What every rival descriptor does: describe one shape on its own, then compare those of a collection."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spem.shapes.shape import Shape


class Rival(Protocol):
    """A descriptor of the protocol of Table 1: a shape in, distances between shapes out."""

    @property
    def name(self) -> str:
        """Name in tables, as its publication has it."""
        ...

    def describe(self, shape: Shape) -> Any:
        """Compute what is known of one shape, arrays that can be pickled; nothing of other shapes enters.

        Parameters
        ----------
        shape
            A shape; of a mesh, its ``surface`` is the mesh.

        Raises
        ------
        ShapeError
            When the shape has no such descriptor; the message says why.
        """
        ...

    def compare(self, descriptions: Sequence[Any]) -> NDArray[np.float64]:
        """Compute the distances between the shapes of a collection.

        What has to be learnt, such as a codebook, is learnt of these shapes, without labels and from a fixed
        seed.

        Parameters
        ----------
        descriptions
            What `describe` gave for each shape.

        Returns
        -------
        numpy.ndarray
            ``(n_shapes, n_shapes)`` distances, zero on the diagonal.
        """
        ...
