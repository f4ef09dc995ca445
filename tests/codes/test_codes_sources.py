"""Where the shapes of a collection come from."""

from __future__ import annotations

import numpy as np
import pytest

from spem.codes.settings import Settings
from spem.codes.sources import as_source, read_shapes
from spem.errors import ParameterError
from spem.shapes.shape import Shape


@pytest.mark.parametrize(("components", "nodes"), [("largest", 12), ("all", 13)])
def test_components_of_shapes_are_kept_as_the_settings_say(components, nodes):
    """A shape made by hand is no exception."""
    mask = np.zeros((5, 8), bool)
    mask[:3, :4] = True
    mask[4, 7] = True
    settings = Settings(features="spem", voxels=None, components=components)
    [(_, shape)] = read_shapes(Shape.from_mask(mask), settings)
    assert shape.n_nodes == nodes


def test_what_is_no_file_and_no_shape_is_refused():
    """An array has to be read first, which says what it is an array of."""
    with pytest.raises(ParameterError, match="expected files or shapes, got ndarray; read it first"):
        as_source(np.ones((5, 8), bool))
