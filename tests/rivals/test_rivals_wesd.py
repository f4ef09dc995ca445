"""The weighted spectral distance against its definition."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.rivals.wesd import WESD
from spem.shapes.synthetic import ball, box


def test_it_is_the_sum_of_its_definition() -> None:
    """ρ is the p-norm of |λ − μ| / (λ μ)."""
    rival = WESD(p=1.7)
    one, two = np.array([1.0, 2.0, 5.0]), np.array([1.5, 3.0, 4.0])
    expected = (np.abs(one - two) / (one * two)) ** 1.7
    assert rival.compare([1 / one, 1 / two])[0, 1] == pytest.approx(expected.sum() ** (1 / 1.7))


def test_the_box_has_its_frequencies() -> None:
    """The values of a box are sums of (π k / a)²; the description holds reciprocals, in units of the size."""
    sides = np.array([2.0, 1.5, 1.0])
    k = np.stack(np.meshgrid(*[np.arange(1, 9)] * 3), axis=-1).reshape(-1, 3)
    exact = np.sort(np.sum(np.square(np.pi * k / sides), axis=1))[:10]
    shape = box(tuple(sides), 0.1)
    assert WESD(n_values=10).describe(shape) == pytest.approx(1 / (exact * shape.size**2), rel=0.03)


def test_scale_does_not_count() -> None:
    """A ball of another size is at distance zero, a box is not."""
    rival = WESD(n_values=20)
    shapes = [ball(1.0, 0.2), ball(5.0, 1.0), box((3.0, 1.0, 1.0), 0.2)]
    distances = rival.compare([rival.describe(shape) for shape in shapes])
    assert distances[0, 1] == pytest.approx(0, abs=1e-9)
    assert distances[0, 2] > 0.01
    assert distances == pytest.approx(distances.T)


def test_more_values_hardly_count() -> None:
    """The sum converges: twice the values change the distance by a few hundredths."""
    shapes = [ball(1.0, 0.2), box((3.0, 1.0, 1.0), 0.2)]
    found = []
    for count in (25, 50):
        rival = WESD(n_values=count)
        found.append(rival.compare([rival.describe(shape) for shape in shapes])[0, 1])
    assert found[1] == pytest.approx(found[0], rel=0.05)


def test_an_exponent_for_which_the_sum_diverges_is_refused() -> None:
    """The exponent must lie above half the dimension."""
    with pytest.raises(ParameterError, match=r"p=1.5: expected more than 1.5 in 3 dimensions"):
        WESD(p=1.5).describe(ball(1.0, 0.3))
    assert WESD(p=1.5, n_values=3).describe(box((1.0, 1.0), 0.2)).shape == (3,)


def test_fine_solids_are_resampled():
    """A ball of many voxels has the spectrum of one of few: the surface lies between them."""
    fine, coarse = ball(1.0, 0.06), ball(1.0, 0.12)
    assert fine.n_nodes > 5000 > coarse.n_nodes
    found = [WESD(n_values=10).describe(shape) for shape in (fine, coarse)]
    np.testing.assert_allclose(found[0], found[1], rtol=0.01)
