"""Fields in closed form."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError
from spem.shapes.closed_forms import ball_field, interval_field, shell_field


def on_axis(r: np.ndarray, ndim: int) -> np.ndarray:
    """Return points at given radii."""
    return np.eye(ndim)[:1] * np.asarray(r)[:, None]


RADII = np.array([0.0, 1e-9, 0.1, 0.5, 0.9, 1.0])


@pytest.mark.parametrize("rho", [0.05, 0.3, 1.0, 7.0])
def test_low_dimensions_are_the_textbook_forms(rho):
    """The general ball agrees with cosh, I0 and sinh(r)/r."""
    x = RADII / rho
    np.testing.assert_allclose(interval_field(RADII, 2.0, rho), np.cosh(x) / np.cosh(1 / rho), rtol=1e-12)
    np.testing.assert_allclose(ball_field(on_axis(RADII, 2), 1.0, rho), np.i0(x) / np.i0(1 / rho), rtol=1e-12)
    safe = np.where(RADII == 0, 1, RADII)
    sinh = np.where(RADII == 0, 1 / rho, np.sinh(x) / safe) / np.sinh(1 / rho)
    np.testing.assert_allclose(ball_field(on_axis(RADII, 3), 1.0, rho), sinh, rtol=1e-12)


def test_four_ball_agrees_with_multiprecision():
    """(R/r) I1(r/ρ)/I1(R/ρ) in four dimensions."""
    r, rho = np.array([0.2, 0.7, 1.4]), 0.3
    exact = [float(1.5 / s * mpmath.besseli(1, s / rho) / mpmath.besseli(1, 1.5 / rho)) for s in r]
    np.testing.assert_allclose(ball_field(on_axis(r, 4), 1.5, rho), exact, rtol=1e-12)


@pytest.mark.parametrize("rho", [0.1, 1.0, 50.0])
def test_shell_in_space_is_a_pair_of_exponentials(rho):
    """In 3-D, r v is a combination of exp(±r/ρ) that is r on both spheres."""
    a, b, r = 0.5, 1.3, np.linspace(0.5, 1.3, 9)
    exact = (b * np.sinh((r - a) / rho) + a * np.sinh((b - r) / rho)) / (r * np.sinh((b - a) / rho))
    np.testing.assert_allclose(shell_field(on_axis(r, 3), a, b, rho), exact, rtol=1e-11)


def test_annulus_agrees_with_multiprecision():
    """The I0, K0 combination for the ring."""
    a, b, rho, r = 0.4, 1.0, 0.2, 0.65
    with mpmath.workdps(30):
        i, k = (lambda s: mpmath.besseli(0, s / rho)), (lambda s: mpmath.besselk(0, s / rho))
        top = i(r) * (k(a) - k(b)) + k(r) * (i(b) - i(a))
        exact = float(top / (i(b) * k(a) - i(a) * k(b)))
    assert shell_field([[r, 0.0]], a, b, rho)[0] == pytest.approx(exact, rel=1e-13)


@settings(max_examples=40, deadline=None)
@given(ndim=st.integers(1, 7), radius=st.floats(0.01, 100), scaled=st.floats(1e-4, 1e6), t=st.floats(0, 1))
def test_fields_stay_between_zero_and_one(ndim, radius, scaled, t):
    """No ρ, radius or dimension overflows; v lies in [0, 1] and is 1 on the boundary."""
    v = ball_field(on_axis(radius * np.array([t, 1.0]), ndim), radius, scaled * radius)
    assert 0 <= v[0] <= 1 + 1e-12
    assert v[1] == pytest.approx(1)
    if ndim > 1:
        w = shell_field(
            on_axis(radius * np.array([1.0, 1 + t, 2.0]), ndim), radius, 2 * radius, scaled * radius
        )
        assert np.isfinite(w).all()
        assert 0 <= w[1] <= 1 + 1e-9
        np.testing.assert_allclose(w[[0, 2]], 1, rtol=1e-9)


@pytest.mark.parametrize("ndim", [2, 3, 4, 5])
def test_both_solve_the_screened_equation(ndim):
    """A radial finite difference of either field gives v/ρ² to its order."""
    r, e, rho = np.linspace(0.6, 0.9, 5), 1e-3, 0.4
    for field in (
        lambda s: ball_field(on_axis(s, ndim), 1.0, rho),
        lambda s: shell_field(on_axis(s, ndim), 0.5, 1.0, rho),
    ):
        low, mid, high = field(r - e), field(r), field(r + e)
        laplacian = (high - 2 * mid + low) / e**2 + (ndim - 1) / r * (high - low) / (2 * e)
        np.testing.assert_allclose(laplacian, mid / rho**2, rtol=1e-4)


def test_infinite_rho_gives_one_and_rho_broadcasts():
    """ρ = inf gives 1 everywhere, beside finite ones."""
    v = ball_field(np.zeros((3, 2)), 1.0, [0.5, np.inf])
    assert v.shape == (3, 2)
    np.testing.assert_array_equal(v[:, 1], 1)
    np.testing.assert_array_equal(shell_field([[0.7, 0.0]], 0.5, 1.0, np.inf), 1)


def test_bad_arguments_are_refused():
    """Radii out of order, a ρ that is not positive and points of the wrong form are refused."""
    with pytest.raises(ParameterError, match="rho must be positive, not -1"):
        ball_field([[0.0]], 1.0, [1.0, -1.0])
    with pytest.raises(ParameterError, match="radii must be positive and in order"):
        shell_field([[0.0, 1.0]], 2.0, 1.0, 1.0)
    with pytest.raises(ParameterError, match="2 dimensions or more"):
        shell_field([[0.7]], 0.5, 1.0, 1.0)
    with pytest.raises(ParameterError, match=r"shape \(n, d\)"):
        ball_field([0.0, 1.0], 1.0, 1.0)


def test_points_of_an_interval_have_one_coordinate():
    """Points of the plane are not taken for twice as many on the line."""
    with pytest.raises(ParameterError, match=r"points of an interval must be .* not \(3, 2\)"):
        interval_field(np.zeros((3, 2)), 1.0, 1.0)
