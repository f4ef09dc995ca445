"""Interior heat kernel signatures against what is known of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import spem
from spem.errors import ParameterError, ShapeError
from spem.rivals.ihks import IHKS
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface
from spem.shapes.synthetic import ball, box


def _sphere(scale: float = 1.0) -> Shape:
    """Return a ball whose surface is a divided icosahedron."""
    mesh = trimesh.creation.icosphere(2, scale)
    return replace(ball(scale, scale / 5), surface=Surface(mesh.vertices, np.asarray(mesh.faces, np.int64)))


def test_only_the_constant_reaches_the_centre_of_the_ball() -> None:
    """All but the constant eigenfunction vanish at the centre by symmetry, and none far from it."""
    shape = _sphere()
    found = IHKS(n_pairs=30, n_times=5).describe(shape)
    radius = np.linalg.norm(shape.points, axis=1)
    assert found[radius < 1e-9] == pytest.approx(np.ones((1, 5)), abs=1e-4)
    assert np.all(found >= 1 - 1e-4)
    assert np.corrcoef(radius, found[:, 0])[0, 1] > 0.9


def test_the_first_degree_is_linear_inside() -> None:
    """Eigenfunctions of degree one are coordinates and stay so inside: h grows with the squared radius."""
    shape, rival = _sphere(), IHKS(n_pairs=4, n_times=3)
    surface = shape.surface
    assert surface is not None
    # three functions x √(3 / R²) of unit mean square, and 2/R² their eigenvalue, times the area
    square = np.sum(np.square(shape.points), axis=1)
    expected = 1 + 3 * np.outer(square, np.exp(-2 * surface.area * rival.times))
    assert rival.describe(shape) == pytest.approx(expected, rel=0.03)


def test_scale_does_not_count() -> None:
    """A scaled shape has the same signatures."""
    rival = IHKS(n_pairs=30)
    assert rival.describe(_sphere(5.0)) == pytest.approx(rival.describe(_sphere()), rel=1e-4)


def test_no_more_points_than_wanted() -> None:
    """There are as many points as wanted, or as there are nodes."""
    shape = _sphere()
    assert IHKS(n_pairs=10, samples=7).describe(shape).shape == (7, 12)
    assert IHKS(n_pairs=10, samples=10_000).describe(shape).shape == (shape.n_nodes, 12)


def test_another_component_is_left_out() -> None:
    """Points of a component that the surface does not enclose are no points of the description."""
    index = np.stack(np.indices((28, 13, 13)), axis=-1)
    large, small = (np.sum(np.square(index - c), axis=-1) < 30 for c in ([6, 6, 6], [21, 6, 6]))
    small &= index[..., 0] < 21
    rival = IHKS(n_pairs=10, samples=10_000)
    both = rival.describe(Shape.from_mask(large | small))
    assert both == pytest.approx(rival.describe(Shape.from_mask(large)), rel=1e-3)


def test_shapes_of_one_word_each_are_as_far_as_can_be() -> None:
    """Shapes without a common word are at distance 2, equal ones at 0; softness brings them nearer."""
    one, two = np.zeros((5, 2)), np.ones((5, 2))
    hard = IHKS(n_words=2, softness=0.0).compare([one, two, one + 1e-9])
    assert hard == pytest.approx(np.array([[0, 2, 0], [2, 0, 2], [0, 2, 0]]), abs=1e-6)
    rng = np.random.default_rng(0)
    cloud = [centre + 0.3 * rng.normal(size=(50, 2)) for centre in (0.0, 1.0)]
    near, far = (IHKS(n_words=2, softness=s).compare(cloud)[0, 1] for s in (2.0, 0.0))
    assert 0 < near < far


def test_units_of_a_time_do_not_count() -> None:
    """Where times are standardised, a factor of one of them changes nothing."""
    rng = np.random.default_rng(0)
    points = [rng.random((30, 3)) for _ in range(3)]
    scaled = [each * np.array([1.0, 100.0, 0.01]) for each in points]
    rival = IHKS(n_words=5)
    assert rival.compare(scaled) == pytest.approx(rival.compare(points), abs=1e-9)
    plain = IHKS(n_words=5, standardised=False)
    assert not np.allclose(plain.compare(scaled), plain.compare(points))


def test_fewer_points_than_words_are_refused() -> None:
    """A vocabulary needs as many points as words."""
    with pytest.raises(
        ParameterError, match="n_words=48: expected at most 4, the number of points of all shapes"
    ):
        IHKS().compare([np.ones((2, 3)), np.zeros((2, 3))])


def test_a_plane_shape_is_refused() -> None:
    """A shape of two dimensions has no surface."""
    with pytest.raises(ShapeError, match="surface"):
        IHKS().describe(box((1.0, 1.0), 0.2))


@pytest.mark.data
def test_poses_are_nearer_than_classes(data_dir: Path) -> None:
    """Of three shapes of SHREC'11, the two of one class are nearest."""
    folder = data_dir / "shrec11"
    rows = [line.split(",") for line in (folder / "labels.csv").read_text().splitlines()[1:]]
    of = {label: [file for file, other in rows if other == label] for label in ("man", "snake")}
    files = [of["man"][0], of["man"][1], of["snake"][0]]
    rival = IHKS(samples=200, n_words=10)
    distances = rival.compare([rival.describe(spem.read(folder / file, voxels=500)) for file in files])
    assert distances[0, 1] < min(distances[0, 2], distances[1, 2])


def test_times_at_which_all_heat_is_even_count_for_nothing() -> None:
    """Of balls the longest times are the same everywhere: they are left as they are."""
    rival = IHKS(n_words=2)
    even = np.ones((4, 1), np.float32)
    first, second = (np.hstack([values[:, None].astype(np.float32), even]) for values in np.eye(4)[:2])
    distances = rival.compare([first, first, second])
    assert np.isfinite(distances).all()
    np.testing.assert_array_equal(distances[0, 1], 0)


@pytest.mark.parametrize(
    ("parameter", "value"), [("n_pairs", 1), ("n_times", 0), ("n_words", 0), ("softness", -1.0)]
)
def test_numbers_out_of_range_are_refused(parameter: str, value: float) -> None:
    """When the system is made, by the name of the parameter."""
    with pytest.raises(ParameterError, match=f"{parameter}={value}.* expected at least"):
        IHKS(**{parameter: value})  # type: ignore[arg-type]
