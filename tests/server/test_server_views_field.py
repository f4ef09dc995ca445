"""The view of the field: what a browser multiplies out is what the sweep has."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.errors import ParameterError
from spem.server.arrays import pack_arrays
from spem.server.views import VIEWS

view = VIEWS["field"]
SHAPES = {
    "interval": spem.synthetic.interval(length=9.0, spacing=0.1),
    "disk": spem.synthetic.disk(radius=30.0, spacing=1.0),
    "square": spem.Shape.from_mask(np.ones((3, 3))),
    "box": spem.Shape.from_mask(np.ones((12, 20, 9)), (1.0, 0.5, 2.0)),
    "tesseract": spem.Shape.from_mask(np.ones((4, 5, 4, 5))),
}


@pytest.mark.parametrize("name", SHAPES)
def test_products_in_single_precision_are_the_fields(name):
    """Fields of all rho multiplied out in float32 are right to 1e-5 against a sharp solution."""
    shape = SHAPES[name]
    _, arrays = view(shape, {})
    v = arrays["basis"] @ arrays["coefficients"].T
    assert v.dtype == np.float32
    np.testing.assert_allclose(v, spem.field(shape, arrays["rho"].astype(float)), atol=1e-5)
    assert (arrays["basis"][:, 0] == 1).all()


@pytest.mark.parametrize("name", ["disk", "box"])
def test_maps_are_combinations_of_the_same_columns(name):
    """Maps multiplied out agree with those of the sweep, each relative to its own size."""
    shape = SHAPES[name]
    header, arrays = view(shape, {"n_maps": 6})
    maps = spem.maps(shape, 6)
    shown = arrays["basis"] @ arrays["maps"].T
    error = np.sqrt(np.mean((shown - maps.values) ** 2, axis=0) / maps.variance)
    assert error.max() < 5e-3
    assert error[:4].max() < 1e-4
    np.testing.assert_allclose(header["explained"], maps.explained)
    np.testing.assert_allclose(arrays["components"].T, maps.basis, atol=1e-6)


def test_population_is_quantiles_of_the_fields():
    """They are those of all nodes, and of a large shape those of a sample, nearly."""
    shape = SHAPES["disk"]
    _, arrays = view(shape, {})
    whole = np.percentile(spem.sweep(shape).fields(), (5, 25, 50, 75, 95), axis=0).T
    np.testing.assert_allclose(arrays["population"], whole, atol=1e-6)


def test_rho_is_told_in_units_of_the_size_too():
    """A shape in other units has the same relative lengths and the same fields."""
    small, large = (spem.Shape.from_mask(np.ones((20, 30)), h) for h in (1.0, 50.0))
    (_, one), (_, two) = (view(shape, {}) for shape in (small, large))
    np.testing.assert_allclose(one["rho_relative"], two["rho_relative"], rtol=1e-6)
    np.testing.assert_allclose(50 * one["rho"], two["rho"], rtol=1e-6)
    np.testing.assert_allclose(one["population"], two["population"], atol=1e-5)


def test_components_of_like_shapes_agree_in_sign():
    """The vectors that maps project on tell which signs agree: of a shape and its coarser self all do."""
    shape = SHAPES["disk"]
    (_, one), (_, two) = (view(shape, {"max_nodes": n, "n_maps": 4}) for n in (60_000, 1000))
    assert (np.einsum("kr,kr->k", one["components"], two["components"]) > 0.9).all()


def test_reply_is_small():
    """A shape of 15 thousand nodes takes less than 1.5 MB."""
    shape = spem.synthetic.ball(15.3, 1.0)
    assert shape.n_nodes > 14_500
    assert len(pack_arrays(*view(shape, {}))) < 1.5e6


def test_number_of_maps_is_checked():
    """More maps than the range of rho bears are refused."""
    with pytest.raises(ParameterError, match="n_maps=99: expected a whole number from 1 to 32"):
        view(SHAPES["square"], {"n_maps": 99})
