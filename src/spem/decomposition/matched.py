"""Parts of several shapes under one numbering, however they were found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.parts import Parts


@dataclass(frozen=True, eq=False)
class MatchedParts:
    """Parts of several shapes; a number means the same part in all of them.

    Parameters
    ----------
    parts
        Parts of each shape; one without a match has a number of its own.
    reference
        Which shape the others were aligned or matched with.
    costs
        ``(n_shapes,)`` how far each shape is from the reference. Of a joint fit, how much their interactions
        differ (`spem.decomposition.transport.Coupling.cost`): below 0.02 for poses of one body at 200
        sources, above 0.03 where bodies differ or limbs fuse in a pose. Of parts matched afterwards, the
        mean square difference between matched parts and between their distances.
    """

    parts: tuple[Parts, ...]
    reference: int
    costs: NDArray[np.float64]
