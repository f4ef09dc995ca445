"""Fluxes between boundary sources: closed forms, symmetry, scale, lengths of ways."""

from __future__ import annotations

import numpy as np
import pytest

from spem.embedding.boundary_response import boundary_response, response_of
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape
from spem.shapes.synthetic import box, disk, interval


def arcs(shape: Shape, count: int) -> Sources:
    """Cut the boundary of a shape into patches."""
    return patch_sources(assemble(shape), count)


def test_interval_converges_to_its_closed_form_with_second_order() -> None:
    """Between the ends of an interval the flux is 1/(ρ sinh(L/ρ)), with an error that falls like h²."""
    errors = []
    for spacing in (0.02, 0.01):
        ends = point_sources(assemble(interval(1.0, spacing)))
        log = boundary_response(ends, 0.2).log[0, 1]
        errors.append(abs(log + np.log(0.2 * np.sinh(5.0))))
    assert errors[1] < 1e-3
    assert 3.5 < errors[0] / errors[1] < 4.5


def test_disk_without_screening_has_the_flux_of_its_poisson_kernel() -> None:
    """Between far arcs of a disk the flux is their lengths over π times the squared chord."""
    sources = arcs(disk(1.0, 0.01), 40)
    log = boundary_response(sources, np.inf).log
    position, measure = sources.position, sources.measure
    chord = np.linalg.norm(position[:, None] - position, axis=2)
    far = chord > 0.8
    expected = np.log(measure[:, None] * measure / np.pi)[far] - 2 * np.log(chord[far])
    assert np.abs(log[far] - expected).max() < 0.02


def test_fluxes_are_symmetric_and_do_not_depend_on_the_order_of_sources() -> None:
    """F(p, q) = F(q, p), and renumbering the sources renumbers rows and columns."""
    sources = arcs(box((1.0, 0.6), 0.05), 24)
    log = boundary_response(sources, 0.2).log
    assert np.array_equal(log, log.T)
    order = np.random.default_rng(0).permutation(24)
    assert np.allclose(boundary_response(sources.select(order), 0.2).log, log[np.ix_(order, order)])


@pytest.mark.parametrize("factor", [0.1, 7.0])
def test_lengths_scale_with_the_shape(factor: float) -> None:
    """Twice the shape at twice ρ has ways of twice the length."""
    plain = boundary_response(arcs(box((1.0, 0.5), 0.05), 20), 0.1).distances
    scaled = boundary_response(arcs(box((factor, 0.5 * factor), 0.05 * factor), 20), 0.1 * factor).distances
    assert np.allclose(scaled, factor * plain, atol=1e-9 * factor)


def test_fluxes_far_below_the_range_of_floats_keep_their_logarithms() -> None:
    """Across fifty thousand screening lengths a flux is far below 1e-308, and its length still right."""
    ends = point_sources(assemble(interval(1.0, 0.05)))
    log = boundary_response(ends, 0.002).log
    assert log[0, 1] < -100.0
    assert np.isfinite(log).all()
    thin = Shape.from_mask(np.ones((1, 600)))
    log = boundary_response(arcs(thin, 40), 0.5).log
    assert log.min() < -900.0
    assert np.isfinite(log).all()


def test_no_way_leads_from_one_component_to_another() -> None:
    """Between shapes that lie apart the flux is zero and the length infinite."""
    mask = np.zeros((4, 9), bool)
    mask[:, :4] = mask[:, 5:] = True
    sources = patch_sources(assemble(Shape.from_mask(mask)), 8)
    response = boundary_response(sources, 2.0)
    apart = sources.contour[:, None] != sources.contour
    assert np.isneginf(response.log[apart]).all()
    assert np.isinf(response.distances[apart]).all()
    assert np.isfinite(response.distances[~apart]).all()


def test_holes_are_held_at_zero_when_they_are_no_source() -> None:
    """Sources chosen among all have the same fluxes as among themselves alone."""
    mask = np.ones((12, 12), bool)
    mask[4:7, 5:8] = False
    sources = arcs(Shape.from_mask(mask), 20)
    outer = np.flatnonzero(sources.contour == 0)
    chosen = boundary_response(sources.select(outer), 2.0)
    assert np.allclose(chosen.log, boundary_response(sources, 2.0).log[np.ix_(outer, outer)])


def test_fields_solved_before_are_read_in_the_same_way() -> None:
    """Fields at hand give the same fluxes; fields of some of their sources are refused."""
    sources = arcs(disk(1.0, 0.1), 12)
    fields = solve_sources(sources, 0.3)
    assert np.array_equal(response_of(fields).log, boundary_response(sources, 0.3).log)
    with pytest.raises(ParameterError, match="5 fields of 12 sources; solve for all of them"):
        response_of(SourceFields(sources, 0.3, fields.log[:5]))


def test_a_shape_is_no_sources() -> None:
    """What is no sources is refused with the call that makes them."""
    with pytest.raises(ParameterError, match=r"spem\.sources"):
        boundary_response(disk(1.0, 0.1), 0.3)  # type: ignore[arg-type]
