"""Rivals for silhouettes: what leaves their descriptors as they are, closed forms, refusals."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest

from spem.errors import MissingExtraError, ParameterError, ShapeError
from spem.retrieval.evaluation import evaluate
from spem.rivals.elliptic_fourier import EllipticFourier
from spem.rivals.hu import Hu
from spem.rivals.plane import euclidean_distances
from spem.rivals.zernike import Zernike
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, box, disk

RIVALS = pytest.mark.parametrize("rival", [Hu(), Zernike(), EllipticFourier()], ids=lambda rival: rival.name)
NEEDS = {"Zernike moments": "mahotas", "elliptic Fourier": "pyefd"}


def _ready(rival):
    """Skip where the package of a rival is not installed."""
    if rival.name in NEEDS:
        pytest.importorskip(NEEDS[rival.name])
    return rival


@RIVALS
def test_turned_mirrored_moved_and_scaled_silhouettes_are_the_same(rival):
    """Quarter turns, reflection, place and unit change no descriptor by more than other hands differ."""
    _ready(rival)
    hands = [creature("hand", ndim=2, voxels=2500, rng=np.random.default_rng(seed)) for seed in (1, 2)]
    mask, h = hands[0].mask, hands[0].spacing
    same = [
        Shape.from_mask(mask, h),
        Shape.from_mask(np.rot90(mask), h),
        Shape.from_mask(mask, tuple(5 * step for step in h), origin=(3.0, -4.0)),
    ]
    # the seventh moment of Hu changes its sign
    if rival.name != "Hu moments":
        same.append(Shape.from_mask(mask[::-1], h))
    found = rival.compare([rival.describe(shape) for shape in [*same, hands[1]]])
    assert found[:-1, :-1].max() < 0.3 * found[:-1, -1].min()
    np.testing.assert_allclose(found, found.T)
    np.testing.assert_allclose(np.diag(found), 0)


@RIVALS
def test_kinds_of_creatures_are_told_apart(rival):
    """Of three kinds, four each, the nearest other one is mostly of the same kind."""
    _ready(rival)
    kinds = ("hand", "fish", "snake")
    shapes = [
        creature(kind, ndim=2, voxels=1200, rng=np.random.default_rng(seed))
        for kind in kinds
        for seed in range(4)
    ]
    distances = rival.compare([rival.describe(shape) for shape in shapes])
    assert evaluate(distances, [kind for kind in kinds for _ in range(4)]).mean()["NN"] > 60


def test_a_disk_has_no_harmonic_but_the_first():
    """The contour of a disk is its first ellipse; all other coefficients are small."""
    rival = _ready(EllipticFourier(6))
    coefficients = rival.describe(disk(1.0, 0.02)).reshape(6, 4)
    np.testing.assert_allclose(coefficients[0], [1, 0, 0, 1], atol=0.02)
    assert np.abs(coefficients[1:]).max() < 0.01


def test_a_box_has_the_first_ellipse_of_its_sides():
    """Of a long box the first ellipse is long: its short axis is below half of the long one."""
    rival = _ready(EllipticFourier(2))
    long = rival.describe(box((4.0, 1.0), 0.05)).reshape(2, 4)[0]
    assert long[0] == pytest.approx(1, abs=1e-6)
    assert 0.1 < long[3] < 0.5


def test_a_disk_has_only_radial_zernike_moments():
    """Of a disk the moments of angular order above zero vanish, but for the corners of pixels."""
    rival = _ready(Zernike(4))
    # orders (1,1) (2,0) (2,2) (3,1) (3,3) (4,0) (4,2) (4,4)
    moments = rival.describe(disk(1.0, 0.02))
    assert np.abs(moments[[0, 2, 3, 4, 6, 7]]).max() < 0.01


@RIVALS
def test_solids_are_refused(rival):
    """A solid has none of these descriptors."""
    with pytest.raises(ShapeError, match=r"of silhouettes"):
        rival.describe(ball(1.0, 0.5))


@pytest.mark.parametrize("rival", [Zernike(), EllipticFourier()], ids=lambda rival: rival.name)
def test_oblong_pixels_are_refused_and_missing_packages_named(rival):
    """Both work on square pixels; without their package one line says what to install."""
    shape = disk(1.0, 0.1)
    with pytest.raises(ShapeError, match=r"square pixels, not of a 2-D shape of spacing 0\.1 x 0\.2"):
        rival.describe(replace(shape, spacing=(0.1, 0.2)))
    missing = patch("spem.rivals.extra.find_spec", return_value=None)
    with (
        missing,
        pytest.raises(MissingExtraError, match=rf"needs {NEEDS[rival.name]}; install spem\[rivals\]"),
    ):
        rival.describe(shape)


def test_orders_below_one_are_refused():
    """Neither rival has an order of zero."""
    with pytest.raises(ParameterError, match="degree=0"):
        Zernike(0)
    with pytest.raises(ParameterError, match="order=0"):
        EllipticFourier(0)


def test_constant_values_count_for_nothing():
    """Standardised, a value that is the same everywhere is left out; without others all are equal."""
    vectors = np.array([[1.0, 0.0], [1.0, 2.0]])
    assert euclidean_distances(vectors, standardised=True)[0, 1] == pytest.approx(2.0)
    np.testing.assert_array_equal(euclidean_distances(vectors[:, :1], standardised=True), np.zeros((2, 2)))
