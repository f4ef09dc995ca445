"""Patches: connected, of nearly equal area, along the surface, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse.csgraph import connected_components

import spem
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.points import boundary_points, point_graph
from spem.fields.operator import assemble
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, disk, n_ball, shell

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=5)).filter(np.any)
MODELS = ["surface", "voxel"]


def _pieces(sources) -> int:
    """Number of connected pieces that the patches are in."""
    graph = point_graph(sources.system, sources.points.edge_point).tocoo()
    same = sources.group[graph.row] == sources.group[graph.col]
    within = scipy.sparse.coo_array((graph.data[same], (graph.row[same], graph.col[same])), shape=graph.shape)
    return connected_components(within)[0]


def _inequality(sources) -> float:
    """Largest area in means."""
    return float(sources.measure.max() / sources.measure.mean())


def _spread(sources) -> float:
    """Mean square distance from the centroids of patches, in that of flat disks of their area."""
    points, area = sources.points, sources.measure
    sums = [np.bincount(sources.group, points.measure * x) / area for x in points.position.T]
    apart = np.square(points.position - np.stack(sums, axis=1)[sources.group]).sum(axis=1)
    return float(2 * np.pi * (points.measure @ apart) / np.square(area).sum())


@settings(max_examples=40, deadline=None)
@given(MASKS, st.sampled_from(MODELS), st.integers(0, 99))
def test_any_number_of_patches_of_any_shape(mask, boundary, seed):
    """Each number from that of pieces to that of points is given, no patch is empty or in two pieces."""
    system = assemble(Shape.from_mask(mask), boundary)
    points = boundary_points(system)
    rng = np.random.default_rng(seed)
    count = int(rng.integers(points.n_contours, points.n_points + 1))
    patches = patch_sources(system, count, rng)
    assert patches.n_sources == count
    assert np.all(np.bincount(patches.group, minlength=count) > 0)
    assert np.array_equal(patches.contour[patches.group], points.contour)
    _, first = np.unique(patches.group, return_index=True)
    assert np.all(np.diff(first) > 0)
    if mask.ndim > 2:
        assert _pieces(patches) == count


@pytest.mark.parametrize("boundary", MODELS)
@pytest.mark.parametrize("count", [20, 60, 200])
def test_patches_of_a_sphere_are_equal_connected_and_compact(boundary, count):
    """Largest area within a tenth of the mean, one piece each, not much wider than disks."""
    patches = patch_sources(assemble(ball(1.0, 0.06, offset=0.2), boundary), count)
    assert _pieces(patches) == count
    assert _inequality(patches) < 1.11
    assert _spread(patches) < 1.25


@pytest.mark.parametrize("boundary", MODELS)
def test_arcs_of_a_contour_are_equal(boundary):
    """Arcs differ by one point or so in length, and are runs of points."""
    patches = patch_sources(assemble(disk(1.0, 0.02), boundary), 30)
    assert _inequality(patches) < 1.1
    assert np.count_nonzero(np.diff(patches.group)) == 29
    turned = patch_sources(patches.system, 30, np.random.default_rng(3))
    assert np.count_nonzero(np.diff(turned.group)) == 30
    assert _inequality(turned) < 1.1


def test_pieces_share_patches_by_area():
    """Both circles of a ring have arcs of one length, both spheres of a shell patches of one area."""
    for shape, count in ((annulus(0.5, 1.0, 0.02), 30), (shell(0.5, 1.0, 0.1), 50)):
        patches = patch_sources(assemble(shape), count)
        wanted = [20, 10] if shape.ndim == 2 else [40, 10]
        assert np.bincount(patches.contour).tolist() == wanted
        assert _inequality(patches) < 1.15


def test_patches_in_four_dimensions():
    """The boundary of a 4-ball is divided as well."""
    patches = patch_sources(assemble(n_ball(1.0, 0.25, ndim=4)), 30)
    assert _pieces(patches) == 30
    assert _inequality(patches) < 1.2


def test_no_patch_jumps_between_two_fingers():
    """Patches as long as fingers two voxels apart stay on one of them, but for those at the root."""
    mask = np.ones((40, 6, 14), bool)
    mask[:30, :, 6:8] = False
    patches = patch_sources(assemble(Shape.from_mask(mask)), 40)
    assert _pieces(patches) == 40
    row, side = patches.points.position[:, 0], patches.points.position[:, 2] > 6.5
    for patch in range(40):
        here = patches.group == patch
        if row[here].max() < 28:
            assert len(np.unique(side[here])) == 1


def test_seeds_draw_and_defaults_stay():
    """The same seed gives the same patches, another seed others, and no seed always the same."""
    system = assemble(ball(1.0, 0.1))
    drawn = [patch_sources(system, 25, np.random.default_rng(s)).group for s in (1, 1, 2)]
    assert np.array_equal(drawn[0], drawn[1])
    assert not np.array_equal(drawn[0], drawn[2])
    assert np.array_equal(patch_sources(system, 25).group, patch_sources(system, 25).group)


def test_one_pixel_is_one_patch_or_four():
    """The boundary of a single node can be divided into as many patches as it has points."""
    system = assemble(Shape.from_mask(np.ones((1, 1))), "voxel")
    for count in range(1, 5):
        assert patch_sources(system, count).n_sources == count


@pytest.mark.parametrize(
    ("count", "message"),
    [
        (1000, "cube: the boundary has 54 points, too few for 1000 patches; ask for at most 54"),
        (0, "whole number from 1 to 54, got 0"),
        (2.5, "whole number from 1 to 54, got 2.5"),
        ("many", "whole number from 1 to 54, got 'many'"),
        (True, "whole number from 1 to 54, got True"),
    ],
)
def test_impossible_numbers_are_refused(count, message):
    """The line says how many patches can be had."""
    with pytest.raises(ParameterError, match=message):
        patch_sources(assemble(Shape.from_mask(np.ones((3, 3, 3)), name="cube"), "voxel"), count)


def test_fewer_patches_than_pieces_are_refused():
    """A patch lies in one piece of boundary, so a shell has two at least."""
    with pytest.raises(ParameterError, match="2 separate pieces, too many for 1 patches; ask for at least 2"):
        patch_sources(assemble(shell(0.5, 1.0, 0.2)), 1)


@pytest.mark.data
@pytest.mark.parametrize("boundary", MODELS)
def test_patches_of_a_horse(data_dir, boundary):
    """200 patches of a real animal are connected, compact and within three tenths of the mean."""
    shape = spem.read(data_dir / "horse_poses" / "1.obj")
    patches = patch_sources(assemble(shape, boundary), 200)
    assert _pieces(patches) == 200
    assert _inequality(patches) < 1.3
    assert _spread(patches) < 1.3
