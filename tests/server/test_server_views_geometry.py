"""The view of the geometry: what a browser draws lies where the shape is."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import spem
from spem.errors import ParameterError, ShapeError
from spem.server.arrays import pack_arrays
from spem.server.views import VIEWS
from spem.server.views.options import coarser_shape
from spem.server.views.outline import mesh_of

view = VIEWS["geometry"]


@pytest.fixture(scope="module")
def ball():
    """Return a ball of anisotropic spacing."""
    return spem.Shape.from_mask(spem.synthetic.ball(8.0, 1.0).mask, (1.0, 1.0, 0.5))


def test_contour_of_a_disk_lies_on_its_circle():
    """Points of the contour, put back into coordinates, are at the radius to second order."""
    header, arrays = view(spem.synthetic.disk(radius=10.0, spacing=0.5), {})
    points = np.asarray(header["origin"]) + arrays["contour"] * np.asarray(header["spacing"])
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 10.0, atol=0.02)


def test_contours_are_closed_one_after_the_other():
    """An annulus has two, steps along each are no longer than the diagonal of a voxel."""
    _, arrays = view(spem.synthetic.annulus(0.5, 1.0, 0.05), {})
    start = arrays["contour_start"]
    assert len(start) == 3
    assert start[-1] == len(arrays["contour"])
    for first, stop in itertools.pairwise(start):
        line = arrays["contour"][first:stop]
        assert np.linalg.norm(np.roll(line, -1, axis=0) - line, axis=1).max() < np.sqrt(2)


def test_nodes_of_contour_points_are_next_to_them():
    """A boundary point lies on an edge from its node: at most a voxel away, along one axis."""
    _, arrays = view(spem.synthetic.star_polygon(5, 2), {})
    step = arrays["contour"] - arrays["node"][arrays["contour_node"]]
    assert np.abs(step).max() <= 1.0
    assert (np.count_nonzero(np.abs(step) > 1e-5, axis=1) == 1).all()


def test_patches_of_contours_are_the_sources_of_the_field():
    """Every patch has points, and they are numbered along the contours."""
    header, arrays = view(spem.synthetic.disk(radius=40.0, spacing=1.0), {})
    assert header["n_patches"] == 200
    assert np.unique(arrays["contour_patch"]).tolist() == list(range(200))


def test_mesh_of_a_ball_is_on_its_sphere(ball):
    """Vertices are in indices of an anisotropic grid, and their nodes lie next to them."""
    header, arrays = view(ball, {})
    middle = np.asarray(header["grid"]) / 2 - 0.5
    radius = np.linalg.norm(arrays["vertex"] - middle, axis=1)
    np.testing.assert_allclose(radius, 8.0, atol=0.6)
    step = np.linalg.norm(arrays["vertex"] - arrays["node"][arrays["vertex_node"]], axis=1)
    assert step.max() < 2.0
    assert arrays["face"].max() == len(arrays["vertex"]) - 1


def test_patches_of_vertices_are_compact(ball):
    """Vertices of a patch lie together: two hundred on a sphere span a small angle each."""
    header, arrays = view(ball, {})
    middle = np.asarray(header["grid"]) / 2 - 0.5
    direction = (arrays["vertex"] - middle) * header["spacing"]
    for patch in range(0, header["n_patches"], 40):
        own = direction[arrays["vertex_patch"] == patch]
        assert np.linalg.norm(own - own.mean(axis=0), axis=1).max() < 3.0


def test_fine_meshes_are_decimated_and_coarse_ones_refined():
    """A mesh far finer than the grid loses faces, one of long edges gains them, and the header says so."""
    shape = spem.synthetic.ball(10.0, 1.0)
    surface = spem.boundary_surface(shape)
    coarse = spem.shapes.remeshing.decimate(surface, 50)
    assert len(mesh_of(replace(shape, surface=coarse)).faces) > 4 * len(coarse.faces)
    fine = spem.shapes.remeshing.subdivide(surface, 8 * len(surface.vertices))
    header, arrays = view(replace(shape, surface=fine), {})
    assert len(arrays["face"]) < 30_000 < len(fine.faces)
    assert "decimated" in header["repairs"][-1]
    assert header["axes"] == ["x", "y", "z"]


def test_large_shapes_are_shown_coarser():
    """With fewer nodes allowed the grid is another one, and lies where the shape is."""
    shape = spem.synthetic.disk(radius=40.0, spacing=1.0)
    header, arrays = view(shape, {"max_nodes": 1000})
    assert header["coarser"]
    assert len(arrays["node"]) == pytest.approx(1000, rel=0.02)
    points = np.asarray(header["origin"]) + arrays["contour"] * np.asarray(header["spacing"])
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 40.0, rtol=0.01)


def test_all_views_have_the_same_coarse_grid():
    """Views of equal shapes, unpacked anew each time, have one grid; another shape has its own."""
    one, same, other = (spem.synthetic.disk(radius=r, spacing=1.0) for r in (20.0, 20.0, 21.0))
    assert coarser_shape(one, 200) is coarser_shape(same, 200)
    assert coarser_shape(one, 200) is not coarser_shape(other, 200)
    for name, key in (("field", "basis"), ("parts", "node_part")):
        _, arrays = VIEWS[name](one, {"max_nodes": 200})
        assert len(arrays[key]) == len(view(one, {"max_nodes": 200})[1]["node"])


@pytest.mark.parametrize("shape", [spem.Shape.from_mask(np.ones(9)), spem.Shape.from_mask(np.ones((3,) * 4))])
def test_other_dimensions_have_no_picture(shape):
    """Shapes of one and four dimensions are refused, and what can be had of them is said."""
    with pytest.raises(ShapeError, match=rf"no view of {shape.ndim}-D shapes; fields, maps and parts can be"):
        view(shape, {})


@pytest.mark.parametrize("most", [0, 1.5, "1000", True, 10**9])
def test_options_out_of_range_are_refused(most):
    """A number of nodes that is none, or too many, is named."""
    with pytest.raises(ParameterError, match=r"max_nodes=.*expected a whole number from 100 to 2000000"):
        view(spem.synthetic.disk(radius=5.0, spacing=1.0), {"max_nodes": most})


def test_replies_go_over_the_wire(ball):
    """Headers are JSON and arrays of the kinds that bodies have."""
    assert len(pack_arrays(*view(ball, {}))) < 200_000
