"""Node values continued past the surface."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates

from spem.errors import ParameterError
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.surfaces import shape_surface, surface_values
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk


def test_a_linear_profile_goes_on_through_the_surface() -> None:
    """Values that fall linearly with depth are continued along the same line."""
    shape = Shape.from_mask(np.ones((9, 5)))
    level = surface_level(shape)
    extended = extend_values(shape, 1 - 0.2 * level[shape.mask], level, boundary=1.0)
    near = level > -0.9
    np.testing.assert_allclose(extended[near], 1 - 0.2 * level[near], atol=1e-12)


def test_the_surface_has_its_known_value() -> None:
    """Around a disc, interpolation on its circle gives the boundary value to a few hundredths."""
    shape = disk(radius=10.3, spacing=1.0)
    radius = np.linalg.norm(shape.points, axis=1)
    values = np.exp((radius - 10.3) / 2)  # falls to 1/e over two pixels
    extended = extend_values(shape, values, surface_level(shape), boundary=1.0)
    angle = np.linspace(0, 2 * np.pi, 400)
    circle = 10.3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    where = (circle - shape.origin) / shape.spacing
    assert np.abs(map_coordinates(extended, where.T, order=1) - 1).max() < 0.08


def test_the_rim_of_a_section_is_even() -> None:
    """Along the rim of a ball cut open, a steep field is one to a few hundredths, without beads."""
    shape = ball(radius=10.3, spacing=1.0)
    values = np.exp((np.linalg.norm(shape.points, axis=1) - 10.3) / 2)
    surface = shape_surface(shape, 0, toward=(1, 0, 0))
    shown = surface_values(shape, surface, values, boundary=1.0)
    rim = surface.section & (np.linalg.norm(surface.vertices, axis=1) > 10.1)
    assert rim.sum() > 50
    assert np.abs(shown[rim] - 1).max() < 0.1


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([None, 1.0]))
def test_nodes_keep_their_values(seed: int, boundary: float | None) -> None:
    """However ragged the shape, nodes keep their values and everything is finite."""
    rng = np.random.default_rng(seed)
    mask = rng.random((5, 6)) < 0.5
    mask[2, 2] = True
    shape = Shape.from_mask(mask)
    values = rng.random(shape.n_nodes)
    extended = extend_values(shape, values, surface_level(shape), boundary=boundary)
    np.testing.assert_array_equal(extended[shape.mask], values)
    assert np.isfinite(extended).all()


def test_wrong_number_of_values_is_refused() -> None:
    """There must be one value for each node."""
    shape = Shape.from_mask([1, 1])
    with pytest.raises(ParameterError, match=r"values must be \(2,\), one a node"):
        extend_values(shape, [1.0], surface_level(shape))
