"""What no batch of a device can be made of."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import SizeError
from spem.fields.operator import assemble
from spem.fields.solvers.cuda.bricks import first_cells
from spem.fields.solvers.cuda.workspace import require_batch
from spem.shapes.shape import Shape


def test_more_voxels_than_can_be_numbered_are_refused() -> None:
    """Shapes that are thin in large grids are refused for their grids, not for their nodes."""
    thin = assemble(Shape.from_mask(np.eye(400, dtype=bool)), "voxel")
    voxels = int(first_cells(np.array([thin.shape.mask.shape]), np.ones(1, bool))[-1])
    require_batch([thin] * ((2**31 - 1) // voxels))
    message = r"shapes of .* nodes in grids of .* voxels: a device takes fewer than 2,147,483,648; sweep"
    with pytest.raises(SizeError, match=message):
        require_batch([thin] * ((2**31 - 1) // voxels + 1))
