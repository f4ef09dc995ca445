"""Surfaces, cameras and the rasteriser."""

from __future__ import annotations

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError, ShapeError
from spem.plots.camera import Camera, principal_view, view_rotation
from spem.plots.figures import figure_fields
from spem.plots.level import surface_level
from spem.plots.raster import render_surface, vertex_normals
from spem.plots.style import SOLID, new_figure
from spem.plots.surfaces import draw_surface, picture_surface, shape_surface, surface_values
from spem.shapes.shape import Cuts, Shape


def ball(n: int, radius: float = 1.0, *, cuts: bool = False) -> Shape:
    """Make a ball about the origin on n voxels across, with its exact cuts or none."""
    t = np.linspace(-1.2, 1.2, n) * radius
    h = t[1] - t[0]
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"))
    inside = (grid**2).sum(axis=0) < radius**2
    if not cuts:
        return Shape.from_mask(inside, h, origin=(t[0],) * 3)
    voxel, direction, fraction = [], [], []
    for axis in range(3):
        others = (grid**2).sum(axis=0) - grid[axis] ** 2
        reach = np.sqrt(np.maximum(radius**2 - others, 0))
        for side, sign in enumerate((-1, 1)):
            theta = (reach - sign * grid[axis]) / h
            hit = np.flatnonzero(inside & (theta <= 1))
            voxel.append(hit)
            direction.append(np.full(hit.size, 2 * axis + side, np.uint8))
            fraction.append(theta.ravel()[hit])
    found = Cuts(np.concatenate(voxel), np.concatenate(direction), np.concatenate(fraction))
    return Shape.from_mask(inside, h, origin=(t[0],) * 3, cuts=found)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
SQUARE_FACES = np.array([[0, 1, 2], [0, 2, 3]])
FROM_ABOVE = np.eye(3)


def test_square_fills_its_pixels() -> None:
    """A square seen from above covers the square of pixels that the margin leaves, and no other."""
    opacity = render_surface(SQUARE, SQUARE_FACES, view=FROM_ABOVE, size=(100, 100))[..., 3]
    rows, columns = np.nonzero(opacity == 255)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (3, 96, 3, 96)
    assert (opacity == 255).sum() == 94**2
    assert opacity[:3].max() == 0


def test_up_is_up_and_right_is_right() -> None:
    """Larger values of the second and first coordinate appear higher up and further right."""
    upright = render_surface(SQUARE, SQUARE_FACES, SQUARE[:, 1], view=FROM_ABOVE, size=(60, 60), cmap="gray")
    assert int(upright[8, 30, 0]) > int(upright[52, 30, 0]) + 100
    across = render_surface(SQUARE, SQUARE_FACES, SQUARE[:, 0], view=FROM_ABOVE, size=(60, 60), cmap="gray")
    assert int(across[30, 52, 0]) > int(across[30, 8, 0]) + 100


def test_nearer_face_hides_the_farther() -> None:
    """Of two faces in line the one nearer the viewer is seen, whatever their order."""
    vertices = np.concatenate([SQUARE, np.add(SQUARE, [0, 0, 1])])
    values = np.repeat([0.0, 1.0], 4)
    faces = np.concatenate([SQUARE_FACES, SQUARE_FACES + 4])
    for order in (faces, faces[::-1]):
        picture = render_surface(vertices, order, values, view=FROM_ABOVE, size=(40, 40), cmap="gray")
        assert picture[20, 20, 0] > 200


def test_no_hole_along_shared_edges() -> None:
    """A finely divided square leaves no pixel of its inside open."""
    t = np.linspace(0, 1, 23)
    vertices = np.stack([*np.meshgrid(t, t, indexing="ij"), np.zeros((23, 23))], axis=-1).reshape(-1, 3)
    corner = (np.arange(22)[:, None] * 23 + np.arange(22)).ravel()
    faces = np.concatenate([corner[:, None] + [0, 23, 24], corner[:, None] + [0, 24, 1]])
    opacity = render_surface(vertices, faces, view=FROM_ABOVE, size=(150, 150))[..., 3]
    assert (opacity[6:-6, 6:-6] == 255).all()


def test_ball_is_round_and_lit_from_above_left() -> None:
    """A ball covers the area of its disc, brightest toward the key light."""
    picture = picture_surface(ball(30, cuts=True), view=(0, 0), size=(200, 200))
    radius = 200 * 0.47
    assert (picture[..., 3] / 255.0).sum() == pytest.approx(np.pi * radius**2, rel=0.01)
    light = picture[..., :3].sum(axis=2, dtype=int)
    assert light[60, 70] > light[100, 100] > light[150, 140]


@pytest.mark.parametrize(("cuts", "bound"), [(False, 0.5), (True, 0.12)])
def test_surface_of_a_ball_lies_on_its_sphere(cuts: bool, bound: float) -> None:
    """The surface misses the sphere by less than half a voxel, and by a tenth where cuts are known."""
    shape = ball(30, radius=3.0, cuts=cuts)
    surface = shape_surface(shape)
    error = np.abs(np.linalg.norm(surface.vertices, axis=1) - 3.0) / shape.spacing[0]
    assert error.max() < bound
    normal = vertex_normals(surface.vertices, surface.faces)
    assert ((normal * surface.vertices).sum(axis=1) > 2.8).all()


@pytest.mark.parametrize("toward", [-1.0, 1.0])
def test_cut_takes_away_the_half_toward_the_viewer(toward: float) -> None:
    """A cut surface ends flat on a plane of nodes, is closed, and shows the values of that plane."""
    shape = ball(25)
    surface = shape_surface(shape, 1, toward=(0, toward, 0))
    side = surface.vertices[:, 1] * toward
    plane = side.max()
    assert abs(plane) < shape.spacing[1]
    on_plane = np.isclose(side, plane, atol=1e-9)
    assert on_plane.mean() > 0.1
    shown = surface_values(shape, surface, shape.points[:, 0])
    inner = on_plane & (np.linalg.norm(surface.vertices[:, [0, 2]], axis=1) < 0.8)
    np.testing.assert_allclose(shown[inner], surface.vertices[inner, 0], atol=1e-9)


def test_values_are_read_below_the_surface() -> None:
    """Surface values come from about one voxel inside, never from outside."""
    shape = ball(31, cuts=True)
    shown = surface_values(shape, shape_surface(shape), np.linalg.norm(shape.points, axis=1))
    assert np.abs(shown - (1 - shape.spacing[0])).max() < 0.6 * shape.spacing[0]


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_level_keeps_every_voxel_on_its_side(seed: int) -> None:
    """However thin a shape is, the level is positive inside and negative outside."""
    rng = np.random.default_rng(seed)
    shape = Shape.from_mask(
        np.pad(rng.random((4, 5, 3)) < 0.4, ((0, 1), (0, 0), (0, 0)), constant_values=True)
    )
    level = surface_level(shape)
    np.testing.assert_array_equal(level > 0, shape.mask)
    assert np.abs(level).min() > 0


def test_single_voxel_has_a_surface() -> None:
    """One voxel is drawn, with its value."""
    shape = Shape.from_mask(np.ones((1, 1, 1)))
    surface = shape_surface(shape)
    np.testing.assert_allclose(surface_values(shape, surface, [0.25]), 0.25)


@settings(max_examples=25, deadline=None)
@given(st.floats(-180, 180), st.floats(-89, 89))
def test_views_are_rotations(azimuth: float, elevation: float) -> None:
    """Any elevation and azimuth give a right-handed orthonormal frame with axis 2 upward."""
    rotation = view_rotation((elevation, azimuth))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert rotation[1, 2] >= 0


def test_principal_view_shows_the_broad_side() -> None:
    """The longest extent runs mostly right, the shortest mostly toward the viewer."""
    rng = np.random.default_rng(0)
    rotation = principal_view(rng.normal(size=(400, 3)) * [0.2, 1, 5])
    assert np.abs(rotation).argmax(axis=1).tolist() == [2, 1, 0]
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_camera_keeps_points_in_the_picture() -> None:
    """Every point that a camera was fitted to lands within the picture."""
    points = np.random.default_rng(1).normal(size=(100, 3)) * [1, 20, 3] + 50
    seen = Camera.fit(points, (30, 40), (90, 60)).project(points)
    assert (seen[:, :2] >= 0).all()
    assert (seen[:, :2] <= [90, 60]).all()


def test_caller_arrays_stay() -> None:
    """Drawing changes neither vertices nor values."""
    vertices, values = SQUARE.copy(), np.arange(4.0)
    render_surface(vertices, SQUARE_FACES, values, size=(20, 20))
    np.testing.assert_array_equal(vertices, SQUARE)
    np.testing.assert_array_equal(values, np.arange(4.0))


def test_plain_surface_has_the_plain_colour() -> None:
    """A face that looks at the viewer keeps its colour as given."""
    picture = render_surface(SQUARE, SQUARE_FACES, view=FROM_ABOVE, size=(40, 40))
    wanted = [int(SOLID[i : i + 2], 16) for i in (1, 3, 5)]
    assert np.abs(picture[20, 20, :3].astype(int) - wanted).max() <= 2


def test_drawn_surface_is_an_image_without_axes() -> None:
    """The artist is an image and the axis shows nothing else."""
    ax = new_figure(2, 2).add_subplot()
    artist = draw_surface(ball(12), None, ax)
    assert artist in ax.images
    assert not ax.axison


@pytest.mark.parametrize(
    ("vertices", "faces", "values", "message"),
    [
        (SQUARE[:, :2], SQUARE_FACES, None, r"vertices and \(m, 3\) faces"),
        (SQUARE, np.empty((0, 3), int), None, "at least one face"),
        (SQUARE, SQUARE_FACES + 2, None, "name some of the 4 vertices"),
        (SQUARE, SQUARE_FACES, [1.0], r"vertex_values must be \(4,\)"),
    ],
)
def test_bad_meshes_are_refused(vertices, faces, values, message) -> None:
    """Arrays that make no mesh raise an error that says which."""
    with pytest.raises(ParameterError, match=message):
        render_surface(vertices, faces, values)


def test_bad_arguments_are_refused() -> None:
    """Flat shapes, wrong views, cuts and sizes each raise one clear line."""
    with pytest.raises(ShapeError, match="3 dimensions, this one has 2"):
        shape_surface(Shape.from_mask(np.ones((2, 2))))
    with pytest.raises(ParameterError, match="elevation, azimuth"):
        view_rotation(np.ones(4))
    with pytest.raises(ParameterError, match="cut must be an axis"):
        shape_surface(ball(8), 3, toward=(1, 1, 1, 1))
    with pytest.raises(ParameterError, match="at least one pixel"):
        render_surface(SQUARE, SQUARE_FACES, size=(0, 5))


def test_finer_grids_give_closer_surfaces() -> None:
    """With exact cuts the error of the surface falls as the grid is refined."""
    errors = []
    for n in (12, 24, 48):
        surface = shape_surface(ball(n, cuts=True))
        errors.append(np.abs(np.linalg.norm(surface.vertices, axis=1) - 1).mean())
    assert all(fine < 0.5 * coarse for coarse, fine in pairwise(errors))


def test_section_has_the_very_colours_of_the_colour_map() -> None:
    """On a plane that cuts a shape open, light and shade change no colour."""
    shape = ball(25)
    picture = picture_surface(
        shape, np.full(shape.n_nodes, 0.3), view=(30, 40), cut=0, limits=(0, 1), size=(80, 80)
    )
    wanted = np.rint(255 * np.array(mpl.colormaps["viridis"](0.3))).astype(int)
    same = (np.abs(picture.astype(int) - wanted) <= 1).all(axis=2)
    assert same.mean() > 0.3


def test_the_surface_of_fields_is_one() -> None:
    """A cube cut open shows the end of the colour map on its whole faces, not the nearest node's value."""
    shape = Shape.from_mask(np.ones((8, 8, 8)))
    picture = figure_fields(shape, np.full((512, 1), 0.2), view=(0, 40)).axes[0].images[0].get_array()
    tints = picture[picture[..., 3] == 255][:, :3].astype(float)
    yellow = tints[:, 0] / tints.max(axis=1) > 0.9
    assert yellow.mean() > 0.15
