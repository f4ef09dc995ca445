"""Depth images: closed forms, coverings, upright surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from spem.rivals.depth_views import depth_views, upright
from spem.rivals.view_sphere import axis_symmetries, geodesic_sphere, view_permutations
from spem.shapes.surface import Surface

WINDOW = 1.1


def box(sides: tuple[float, float, float]) -> Surface:
    """A box about the origin."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(sides) / 2
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return Surface(corners, np.array(faces))


def icosphere() -> Surface:
    """A sphere of radius 1 of 20,480 triangles."""
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(5)
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64))


def centres(side: int) -> NDArray[np.float64]:
    """Coordinates of pixel centres along one axis of the window."""
    return (np.arange(side) - (side - 1) / 2) * 2 * WINDOW / side


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_box_has_its_closed_form(axis: int) -> None:
    """Along an axis, pixels within the other two half sides have the depth of the near face."""
    sides = (1.0, 0.7, 0.4)
    image = depth_views(box(sides), np.eye(3)[axis : axis + 1], 64)[0]
    covers = [np.count_nonzero(np.abs(centres(64)) <= side / 2) for side in np.delete(sides, axis)]
    assert set(np.unique(image)) == {0, round(128 + 127 * sides[axis] / 2)}
    assert sorted([image.any(axis=0).sum(), image.any(axis=1).sum()]) == sorted(covers)
    assert np.count_nonzero(image) == covers[0] * covers[1]


def test_a_sphere_has_its_closed_form_from_everywhere() -> None:
    """Depth is that of the sphere within two grey levels, away from its edge, in each of 66 views."""
    views = depth_views(icosphere(), geodesic_sphere(), 48)
    x = centres(48)
    radius = np.hypot(x[:, None], x)
    inside = radius < 0.9
    wanted = 128 + 127 * np.sqrt(1 - radius[inside] ** 2)
    assert np.abs(views[:, inside] - wanted).max() < 2
    assert not views[:, radius > 1].any()


def test_the_order_of_triangles_does_not_matter() -> None:
    """Hidden triangles stay hidden, whichever is drawn first and whichever way it is wound."""
    surface = box((1.0, 0.7, 0.4))
    other = Surface(surface.vertices, surface.faces[::-1, ::-1].copy())
    views = geodesic_sphere()
    assert np.array_equal(depth_views(surface, views, 40), depth_views(other, views, 40))


def test_neighbouring_triangles_leave_no_gap() -> None:
    """The image of a convex surface has no empty pixel within a row of it."""
    for image in depth_views(icosphere(), geodesic_sphere()[:30], 96):
        covered = image > 0
        first, last = covered.argmax(axis=1), 95 - covered[:, ::-1].argmax(axis=1)
        rows = covered.any(axis=1)
        assert (covered.sum(axis=1)[rows] == (last - first + 1)[rows]).all()


def test_views_follow_a_surface_that_is_turned() -> None:
    """A quarter turn of the surface moves its images to the permuted views, but for turns of the images."""
    rng = np.random.default_rng(0)
    corners = rng.uniform(-0.5, 0.5, (12, 3))
    surface = Surface(corners, np.arange(12).reshape(4, 3))
    before = depth_views(surface, geodesic_sphere(), 50)
    for number in (5, 17):
        turned = Surface(corners @ axis_symmetries()[number].T, surface.faces)
        after = depth_views(turned, geodesic_sphere(), 50)
        for image, seen in zip(before, after[view_permutations()[number]], strict=True):
            assert min(np.count_nonzero(np.rot90(image, k) != seen) for k in range(4)) < 4


def test_upright_forms_forget_place_turn_and_size() -> None:
    """A turned, shifted and scaled surface comes out the same, up to the directions of the axes."""
    rng = np.random.default_rng(3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    surface = box((1.0, 0.7, 0.4))
    surface = Surface(surface.vertices + 0.1 * rng.normal(size=(8, 3)), surface.faces)
    other = Surface(5 * surface.vertices @ turn.T + 7, surface.faces)
    assert np.allclose(np.abs(upright(surface).vertices), np.abs(upright(other).vertices))
    assert np.isclose(np.linalg.norm(upright(other).vertices, axis=1).max(), 1)


def test_upright_forms_do_not_depend_on_triangles() -> None:
    """Splitting one face in many leaves the axes where they are."""
    surface = box((1.0, 0.7, 0.4))
    middle = surface.vertices[surface.faces[0]].mean(axis=0)
    a, b, c = surface.faces[0]
    faces = np.concatenate([surface.faces[1:], [[a, b, 8], [b, c, 8], [c, a, 8]]])
    split = Surface(np.concatenate([surface.vertices, middle[None]]), faces)
    assert np.allclose(np.abs(upright(split).vertices[:8]), np.abs(upright(surface).vertices))
