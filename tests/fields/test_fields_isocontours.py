"""Lines and surfaces of equal value."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError, ShapeError
from spem.fields.boundary.sources import point_sources
from spem.fields.isocontours import equal_levels, iso_contours, iso_surfaces
from spem.fields.operator import assemble
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk


def test_circles_of_a_disk():
    """The lines of equal distance from the middle are circles, closed, in the shape's coordinates."""
    shape = disk(1.0, (0.04, 0.025), offset=0.3137)
    radius = np.linalg.norm(shape.points, axis=1)
    for lines, level in zip(iso_contours(shape, radius, [0.3, 0.6]), [0.3, 0.6], strict=True):
        assert len(lines) == 1
        assert lines[0][0].tolist() == lines[0][-1].tolist()
        assert np.linalg.norm(lines[0], axis=1) == pytest.approx(level, abs=2e-3)
        length = np.linalg.norm(np.diff(lines[0], axis=0), axis=1).sum()
        assert length == pytest.approx(2 * np.pi * level, rel=0.01)


def test_spheres_of_a_ball():
    """The surface of equal distance from the middle is a sphere; a level that is not met gives none."""
    shape = ball(1.0, 0.08, offset=0.3137)
    radius = np.linalg.norm(shape.points, axis=1)
    (vertices, faces), (no_vertices, no_faces) = iso_surfaces(shape, radius, [0.5, 1.5])
    assert np.linalg.norm(vertices, axis=1) == pytest.approx(0.5, abs=5e-3)
    corner = vertices[faces]
    area = (
        np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum() / 2
    )
    assert area == pytest.approx(np.pi, rel=0.02)
    assert no_vertices.shape == no_faces.shape == (0, 3)


def test_lines_keep_to_the_shape():
    """Across a slot between two limbs no line passes, in the plane and in space."""
    mask = np.ones((5, 5))
    mask[1:, 2] = 0
    shape = Shape.from_mask(mask)
    lines = iso_contours(shape, shape.points[:, 0], [2.5])[0]
    assert sorted(sorted(line[:, 1].tolist()) for line in lines) == [[0, 1], [3, 4]]
    solid = Shape.from_mask(np.repeat(mask[:, :, None], 3, axis=2))
    vertices, _ = iso_surfaces(solid, solid.points[:, 0], [2.5])[0]
    assert set(vertices[:, 1].tolist()) == {0, 1, 3, 4}


def test_equal_steps_of_logs_are_evenly_spaced_along_a_strip():
    """Down a strip log v falls evenly, so lines at equal steps stand at equal distances."""
    shape = Shape.from_mask(np.ones((9, 60)))
    sources = point_sources(assemble(shape))
    end = int(np.argmin(np.linalg.norm(sources.position - [4, -0.5], axis=1)))
    fields = solve_sources(sources.select([end]), np.inf)
    contours = iso_contours(shape, fields.log[0], equal_levels(fields.log, 12))
    points = [np.concatenate(lines) for lines in contours]
    crossed = [line[np.abs(line[:, 0] - 4) < 1e-9, 1] for line in points]
    middle = [float(place[0]) for place in crossed if place.size]
    assert len(middle) > 9
    assert np.diff(middle)[2:-3] == pytest.approx(np.diff(middle)[5], rel=0.02)


def test_unreached_components_have_no_lines():
    """Where a field is zero its logarithm has no lines, and there is no warning."""
    shape = Shape.from_mask(np.pad(np.ones((4, 11)), 0) * (np.abs(np.arange(11) - 5) > 1))
    log = np.where(shape.points[:, 1] < 5, shape.points[:, 1], -np.inf)
    levels = equal_levels(log, 2)
    assert levels.tolist() == [1.0, 2.0]
    assert all(line[:, 1].max() < 4 for lines in iso_contours(shape, log, levels) for line in lines)


def test_bad_arguments_are_refused():
    """Shapes of another dimension, values of another length and no levels have their line."""
    flat, solid = Shape.from_mask(np.ones((2, 2)), name="flat"), Shape.from_mask(np.ones((2, 2, 2)))
    with pytest.raises(ShapeError, match="of 2 dimensions, this one has 3; use iso_surfaces"):
        iso_contours(solid, np.ones(8), [1])
    with pytest.raises(ShapeError, match="of 3 dimensions, this one has 2; use iso_contours"):
        iso_surfaces(flat, np.ones(4), [1])
    with pytest.raises(ShapeError, match=r"this one has 1$"):
        iso_contours(Shape.from_mask([1, 1]), [1, 1], [1])
    with pytest.raises(ParameterError, match=r"flat: values must be \(4,\), one a node, not \(3,\)"):
        iso_contours(flat, np.ones(3), [1])
    with pytest.raises(ParameterError, match="count=0 levels of 1 finite values"):
        equal_levels([1.0], 0)
    with pytest.raises(ParameterError, match="count=3 levels of 0 finite values"):
        equal_levels([-np.inf], 3)
