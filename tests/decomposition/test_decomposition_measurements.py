"""Centred and clipped log-fields."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from spem.decomposition.measurements import centred_logs, measurements
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape


def _fields(mask, boundary="voxel", rho=np.inf) -> SourceFields:
    """Solve for every boundary point of a mask."""
    return solve_sources(point_sources(assemble(Shape.from_mask(mask), boundary)), rho)


def test_centred_log_is_the_log_of_the_field_over_its_geometric_mean():
    """Equation (4.2): centring by the mean divides by the geometric mean of all sources."""
    fields = _fields(np.ones((3, 5)), rho=2.0)
    values = fields.values
    geometric = np.prod(values, axis=0) ** (1 / len(values))
    np.testing.assert_allclose(centred_logs(fields), np.log(values / geometric), atol=1e-13)


def test_interval_has_the_fields_of_a_random_walk():
    """On an interval at rho = inf the two fields are linear, so V is half the log of their ratio."""
    x = np.arange(1, 8) / 8
    half = np.log((1 - x) / x) / 2
    np.testing.assert_allclose(centred_logs(_fields(np.ones(7))), [half, -half], atol=1e-13)


@settings(max_examples=15, deadline=None)
@given(
    mask=arrays(bool, (5, 6)).filter(np.any),
    centre=st.sampled_from(["mean", "median"]),
    over=st.sampled_from(["region", "boundary"]),
)
def test_measurements_of_any_mask_are_finite_and_centred(mask, centre, over):
    """-inf stands exactly where a source does not reach; the reached entries are centred; Y is finite."""
    fields = _fields(mask, "surface")
    before = fields.log.copy()
    centred, measured = centred_logs(fields, centre, over=over), measurements(fields, centre, over=over)
    reached = np.isfinite(fields.log)
    assert np.array_equal(np.isfinite(centred), reached)
    assert not np.isnan(centred).any()
    lines = zip(*((centred, reached) if over == "boundary" else (centred.T, reached.T)), strict=True)
    level = np.mean if centre == "mean" else np.median
    for values, seen in lines:
        if seen.any():
            assert abs(level(values[seen])) < 1e-10
    assert np.isfinite(measured).all()
    assert not measured[~reached].any()
    if reached.all():
        np.testing.assert_array_equal(measured, np.maximum(centred, 0))
    np.testing.assert_array_equal(fields.log, before)


def test_node_that_no_source_reaches_is_marked():
    """With the sources of one component alone, nodes of the other have -inf, and measurement 0."""
    mask = np.zeros((3, 9))
    mask[:, :3] = mask[:, 5:] = 1
    whole = point_sources(assemble(Shape.from_mask(mask), "voxel"))
    chosen = whole.select(np.flatnonzero(whole.position[:, 1] < 4))
    fields = solve_sources(chosen, np.inf)
    far = fields.sources.system.shape.points[:, 1] > 4
    for centre in ("mean", "median"):
        assert np.isneginf(centred_logs(fields, centre)[:, far]).all()
        assert not measurements(fields, centre)[:, far].any()


def test_over_the_boundary_the_strength_of_a_source_cancels():
    """Scaling each field leaves the log-fields less their means over the nodes as they were."""
    fields = _fields(np.ones((4, 6)))
    strength = np.linspace(-30, 5, len(fields.log))[:, None]
    scaled = SourceFields(fields.sources, fields.rho, fields.log + strength)
    before, after = centred_logs(fields, over="boundary"), centred_logs(scaled, over="boundary")
    np.testing.assert_allclose(after, before, atol=1e-12)


@pytest.mark.parametrize(("name", "value"), [("centre", "mode"), ("over", "surface")])
def test_other_words_are_refused(name, value):
    """A wrong word is named with the right ones."""
    with pytest.raises(ParameterError, match=f"{name}='{value}': expected '.*' or '.*'"):
        centred_logs(_fields(np.ones(3)), **{name: value})
