"""Fronts over the graph of the nodes: orders of fast marching, and nearest points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from spem.fields.domain import surface_domain
from spem.fields.marching import march, spread
from spem.shapes.synthetic import annulus, disk


def _marched(spacing, order):
    """Return the error of marching inward from a band beside a circle."""
    shape = annulus(0.4, 1.0, spacing, offset=0.3)
    exact = 1 - np.linalg.norm(shape.points, axis=1)
    distance = np.where(exact < 0.1, exact, np.inf)
    march(surface_domain(shape).neighbours, np.asarray(shape.spacing), order, distance)
    return np.abs(distance - exact)


@pytest.mark.parametrize("order", [1, 2])
def test_order_of_upwind_differences(order):
    """From exact values in a band the error falls with the order of the differences."""
    errors = [_marched(h, order).mean() for h in (0.04, 0.01)]
    assert np.log(errors[0] / errors[1]) / np.log(4) == pytest.approx(order, abs=0.3)


def test_anisotropic_grids():
    """Spacings that differ by axis are taken as lengths."""
    assert _marched((0.01, 0.02), 2).max() < 0.02


def test_given_values_are_kept_and_unreached_ones_stay_infinite():
    """Marching changes no value that is given, and reaches what edges lead to."""
    shape = disk(1.0, 0.2)
    neighbours = surface_domain(shape).neighbours
    distance = np.full(shape.n_nodes, np.inf)
    march(neighbours, np.asarray(shape.spacing), 2, distance)
    assert np.isinf(distance).all()
    distance[[0, 7]] = 3.0, 1.0
    march(neighbours, np.asarray(shape.spacing), 2, distance)
    assert distance[0] == 3.0
    assert distance[7] == 1.0
    assert np.isfinite(distance).all()


def test_nearest_points_are_those_of_a_search():
    """Feet that spread over the nodes are the nearest of all."""
    shape = disk(1.0, 0.05, offset=0.2)
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    feet = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    starts = cKDTree(shape.points).query(feet)[1]
    beside = (np.arange(200)[:, None] + [-1, 1]) % 200
    foot = spread(shape.points, surface_domain(shape).neighbours, starts, feet, beside)
    found = np.linalg.norm(shape.points - feet[foot], axis=1)
    np.testing.assert_allclose(found, cKDTree(feet).query(shape.points)[0], rtol=1e-12)
