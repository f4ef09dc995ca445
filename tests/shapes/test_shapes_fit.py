"""The spacing at which a shape has the size that was asked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spem.errors import ShapeError
from spem.shapes.fit import fit_spacing
from spem.shapes.shape import Shape


def rod(step):
    """Make a row of voxels ten units long."""
    if step > 10:
        msg = "rod: thinner than the grid"
        raise ShapeError(msg)
    return Shape.from_mask(np.ones(int(10 / step)), step)


def fit(measure, wanted, step=1.0, tolerance=0.01):
    """Search with rods."""
    return fit_spacing(rod, step, measure, wanted, power=1, tolerance=tolerance, what="units")


@pytest.mark.parametrize("step", [0.01, 0.3, 9.0])
def test_a_measure_that_goes_as_the_spacing_is_met(step):
    """From a first spacing however far off."""
    found = fit(lambda shape: shape.n_nodes, 25, step)
    assert found.n_nodes == 25
    assert found.report.repairs == ()


def test_the_best_round_is_kept_and_its_miss_told():
    """A measure that jumps over what is wanted, by a fifth or by a tenth, gives the tenth."""
    jump = {True: 1.1, False: 0.8}
    found = fit(lambda shape: 10 * jump[shape.spacing[0] < 0.95], 10)
    assert found.spacing[0] < 0.95
    assert found.report.repairs == ("11 units instead of 10, the nearest that was found",)


def test_a_spacing_that_gives_no_shape_ends_the_search():
    """What was found before is kept; with nothing found, the error says why."""
    found = fit(lambda _: 3.0, 1, step=6.0)
    assert math.isclose(found.spacing[0], 6.0)
    with pytest.raises(ShapeError, match="rod: thinner than the grid"):
        fit(lambda _: 3.0, 1, step=11.0)
