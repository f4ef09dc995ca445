"""Hu moments of silhouettes and of nodal domains."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.exceptions import NotFittedError

import spem
from spem.codes.moments import NodalMoments, hu_moments
from spem.errors import ParameterError, ShapeError
from spem.shapes.shape import Shape

RNG = np.random.default_rng(0)
BLOT = np.pad(RNG.random((12, 9)) > 0.35, 1)


def stars() -> list[spem.Maps]:
    """Maps of three stars."""
    return [spem.maps(spem.synthetic.star_polygon(n, 2, spacing=0.08), n_maps=3) for n in (5, 7, 9)]


def test_moments_of_a_rectangle_are_the_exact_ones():
    """The first is (a² + b²) / 12ab, the second ((a² − b²) / 12ab)², the last five vanish."""
    sides = np.array([60.0, 20.0])
    shape = Shape.from_mask(np.ones(sides.astype(int)))
    first = (sides**2).sum() / (12 * sides.prod())
    second = ((sides[0] ** 2 - sides[1] ** 2) / (12 * sides.prod())) ** 2
    found = hu_moments(shape)
    assert found[:2] == pytest.approx([first, second], rel=2e-3)
    assert np.abs(found[2:]).max() < 1e-12


def test_moments_are_those_of_the_image():
    """They agree with those that scikit-image finds from the pixels."""
    from skimage.measure import moments_central, moments_hu, moments_normalized

    image = moments_hu(moments_normalized(moments_central(BLOT.astype(float), order=3)))
    assert hu_moments(Shape.from_mask(BLOT)) == pytest.approx(image, rel=1e-9, abs=1e-15)


def test_moments_ignore_place_size_and_turn():
    """A silhouette moved, in another unit, turned by 90 degrees keeps them; reflected, the last flips."""
    plain = hu_moments(Shape.from_mask(BLOT))
    moved = hu_moments(Shape.from_mask(BLOT, spacing=0.3, origin=(5.0, -2.0)))
    turned = hu_moments(Shape.from_mask(np.rot90(BLOT)))
    mirrored = hu_moments(Shape.from_mask(BLOT[::-1]))
    assert moved == pytest.approx(plain, rel=1e-9)
    assert turned == pytest.approx(plain, rel=1e-9)
    assert mirrored == pytest.approx(plain * [1, 1, 1, 1, 1, 1, -1], rel=1e-9)


def test_moments_know_oblong_pixels():
    """Half as many rows of twice the height are the same silhouette."""
    tall = Shape.from_mask(np.ones((30, 20)), spacing=(2.0, 1.0))
    assert hu_moments(tall)[:2] == pytest.approx(hu_moments(Shape.from_mask(np.ones((60, 20))))[:2], rel=2e-3)


def test_compressions_keep_order_and_sign():
    """The logarithm is −sign(h) log₁₀|h|; arsinh grows like one and is smooth through zero."""
    shape = Shape.from_mask(BLOT)
    plain = hu_moments(shape)
    log, arsinh = (hu_moments(shape, compression=kind) for kind in ("log", "arsinh"))
    large = np.abs(plain) > 1e-7
    assert log[large] == pytest.approx((-np.sign(plain) * np.log10(np.abs(plain)))[large], abs=1e-3)
    assert np.array_equal(np.sign(arsinh), np.sign(plain))
    assert arsinh[0] == pytest.approx(np.log(2 * plain[0] / 1e-8), abs=1e-6)


def test_part_without_a_node_has_zeros():
    """In every compression, so that an empty domain is a point of its own."""
    shape = Shape.from_mask(BLOT)
    for kind in ("none", "log", "arsinh"):
        assert not hu_moments(shape, np.zeros(shape.n_nodes), compression=kind).any()


def test_nodal_moments_are_those_of_the_domains():
    """A code holds, map by map, the moments of the negative and of the positive domain."""
    maps = stars()
    coder = NodalMoments(unit=False, compression="none", random_state=0).fit(maps)
    code = coder.transform(maps[:1])[0].reshape(3, 2, 7)
    domains = spem.nodal_domains(maps[0].values, coder.thresholds_)
    for j in range(3):
        for side, sign in enumerate((-1, 1)):
            expected = hu_moments(maps[0].shape, domains[:, j] == sign)
            assert code[j, side] == pytest.approx(expected, rel=1e-6, abs=1e-18)


def test_nodal_moments_ignore_turns():
    """A silhouette turned by 90 degrees keeps its code, whatever thresholds were learnt."""
    shape = Shape.from_mask(BLOT)
    turned = Shape.from_mask(np.rot90(BLOT))
    maps = [spem.maps(each, n_maps=3, rtol=1e-9) for each in (shape, turned)]
    plain, other = NodalMoments(compression="arsinh", random_state=0).fit(maps[:1]).transform(maps)
    assert other == pytest.approx(plain, abs=1e-4)


def test_nodal_moments_are_an_estimator():
    """Parameters are kept as they are given, names and repeats follow; unfitted it says so."""
    coder = clone(NodalMoments(compression="log", random_state=3))
    assert coder.get_params()["compression"] == "log"
    with pytest.raises(NotFittedError, match="NodalMoments instance is not fitted yet"):
        coder.transform(stars())
    codes = coder.fit_transform(stars())
    assert np.array_equal(codes, clone(coder).fit_transform(stars()))
    assert codes.shape == (3, len(coder.get_feature_names_out())) == (3, 42)


def test_wrong_kinds_are_refused():
    """Solids, weights of another number, unknown compressions and bare arrays."""
    ball = spem.synthetic.ball(radius=4.0, spacing=1.0)
    with pytest.raises(ShapeError, match="silhouettes; this shape has 3"):
        hu_moments(ball)
    with pytest.raises(ParameterError, match="expected Shape, got ndarray"):
        hu_moments(BLOT)
    with pytest.raises(ParameterError, match="expected one weight for each of"):
        hu_moments(Shape.from_mask(BLOT), [1.0])
    with pytest.raises(ParameterError, match="compression='ln' must be one of log, arsinh, none"):
        NodalMoments(compression="ln").fit(stars())
    with pytest.raises(ParameterError, match=r"make them with spem\.maps"):
        NodalMoments().fit([np.ones((3, 2))])
