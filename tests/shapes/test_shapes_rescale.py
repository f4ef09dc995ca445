"""Shapes on other grids."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError, ShapeError, SizeError
from spem.shapes import synthetic
from spem.shapes.distance import signed_distance
from spem.shapes.images import read_image
from spem.shapes.levels import level_shape
from spem.shapes.rescale import to_inner_distance, to_spacing, to_voxel_budget
from spem.shapes.shape import Cuts, Shape


def ball(radius, n, d, spacing=1.0):
    """Make a ball whose centre lies between voxels."""
    axis = (np.arange(n) - (n - 1) / 2 + 0.23) * spacing
    grid = np.meshgrid(*[axis] * d, indexing="ij")
    return level_shape(radius - np.sqrt(sum(x * x for x in grid)), spacing)


def radii(shape, centre):
    """Distance from a centre to every cut."""
    place = np.stack(np.unravel_index(shape.cuts.voxel, shape.mask.shape), axis=1).astype(float)
    step = np.where(shape.cuts.direction % 2, 1.0, -1.0) * shape.cuts.fraction
    place[np.arange(len(place)), shape.cuts.direction // 2] += step
    return np.linalg.norm(place * shape.spacing + shape.origin - centre, axis=1)


@pytest.mark.parametrize("spacing", [0.3, 0.7, 1.9, (0.5, 1.5)])
def test_a_disk_keeps_its_place_and_radius(spacing):
    """Resampled either way, the disk lies where it lay, to a tenth of an old pixel on average."""
    disk = ball(20.3, 48, 2)
    made = to_spacing(disk, spacing)
    error = radii(made, np.full(2, 23.5 - 0.23)) - 20.3
    assert abs(error.mean()) < 0.05
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert made.report.repairs[0].startswith("resampled from spacing 1 x 1 to ")
    if spacing in (0.3, 0.7):
        assert made.volume == pytest.approx(np.pi * 20.3**2, rel=0.01)


@pytest.mark.parametrize(("d", "voxels"), [(2, 400), (2, 15_000), (3, 3_000), (3, 15_000)])
def test_voxel_budgets_are_met(d, voxels):
    """The number of nodes is within three parts in a hundred of the budget, the volume too."""
    shape = ball(15.2, 36, d)
    made = to_voxel_budget(shape, voxels)
    assert made.n_nodes == pytest.approx(voxels, rel=0.03)
    exact = np.pi * 15.2**2 * (1 if d == 2 else 4 / 3 * 15.2)
    assert made.volume == pytest.approx(exact, rel=0.015)


@pytest.mark.parametrize("distance", [8, 20])
def test_inner_distances_are_met(distance):
    """The deepest node lies as many voxels from the surface as was asked."""
    made = to_inner_distance(ball(15.2, 36, 2, spacing=0.1), distance)
    assert signed_distance(made).max() / made.spacing[0] == pytest.approx(distance, rel=0.015)


@pytest.mark.parametrize("distance", [1, 1.5, 3, 10, 20])
def test_the_deepest_place_is_a_node(distance):
    """However few voxels there are, a node at the deepest place makes the distance what was asked."""
    made = to_inner_distance(synthetic.disk(20, 1), distance)
    assert signed_distance(made).max() / made.spacing[0] == pytest.approx(distance, rel=0.01)
    assert np.array_equal(made.mask, made.mask[::-1, ::-1])
    assert not any("instead of" in phrase for phrase in made.report.repairs)


@pytest.mark.parametrize("distance", [0.8, 0.3, 1e-6, 0, -1, np.nan, "20", True])
def test_inner_distances_under_a_voxel_are_refused(distance):
    """They would say nothing of the shape, and led to grids of any size."""
    with pytest.raises(ParameterError, match=r"inner_radius=.*: expected a number of at least 1, in voxels"):
        to_inner_distance(synthetic.disk(20, 1), distance)


def test_a_shape_that_meets_its_budget_stays_as_it_is():
    """Nothing is sampled twice; unequal steps are made equal all the same."""
    made = to_voxel_budget(ball(15.2, 36, 2), 3000)
    assert to_voxel_budget(made, 3010) is made
    uneven = Shape.from_mask(np.ones((30, 20)), (1.0, 2.0))
    assert to_voxel_budget(uneven, 600).spacing == pytest.approx((2**0.5, 2**0.5), rel=0.05)


def test_a_missed_budget_is_told():
    """Rows of a square come and go together: the nearest grid is kept, and the report has its count."""
    made = to_voxel_budget(Shape.from_mask(np.ones((9, 9))), 7)
    assert made.report.repairs[-1] == f"{made.n_nodes} voxels instead of 7, the nearest that was found"


@pytest.mark.parametrize("voxels", [np.nan, np.inf, 2.5, -3, "many", True])
def test_budgets_are_whole_numbers(voxels):
    """Anything else is refused in one line."""
    with pytest.raises(ParameterError, match=r"voxels=.*: expected a whole number of at least 1"):
        to_voxel_budget(Shape.from_mask(np.ones((9, 9))), voxels)


def test_the_same_spacing_gives_the_same_shape():
    """Nothing is resampled for nothing."""
    shape = ball(5.0, 16, 2)
    assert to_spacing(shape, (1.0, 1.0)) is shape


def test_a_symmetric_shape_stays_symmetric():
    """The new grid is centred on the old one."""
    made = to_spacing(Shape.from_mask(np.ones((9, 14))), 0.37)
    for axis in range(2):
        assert np.array_equal(made.mask, np.flip(made.mask, axis))


def test_a_shape_thinner_than_the_grid_is_refused_with_a_spacing_that_does():
    """The spacing that the message names leaves nodes inside."""
    thin = Shape.from_mask(np.ones((2, 40)), name="hair")
    with pytest.raises(
        ShapeError, match=r"hair: thinner than the new grid.* a spacing of 0.707 or finer"
    ) as caught:
        to_spacing(thin, 3.0)
    assert to_spacing(thin, float(str(caught.value).split("spacing of ")[1].split()[0])).n_nodes > 0


def test_merged_parts_and_lost_volume_are_reported():
    """Inner cuts cannot be resampled, thin parts vanish: the report says both."""
    mask = np.ones((6, 6), bool)
    cuts = Cuts(np.array([8, 14]), np.array([3, 2]), np.array([0.4, 0.4]))
    inner = Shape.from_mask(mask, cuts=Cuts(np.array([8, 9]), np.array([3, 2]), cuts.fraction))
    assert "parts that were closer than a voxel may have merged" in to_spacing(inner, 0.5).report.repairs
    comb = np.zeros((30, 40))
    comb[:12] = 1
    comb[:, ::4] = 1
    assert any(
        "changed the volume" in phrase for phrase in to_spacing(Shape.from_mask(comb), 4.0).report.repairs
    )


def test_arguments_out_of_range_are_refused():
    """Spacings, budgets and distances are positive; grids fit the memory."""
    shape = ball(5.0, 16, 2)
    for spacing in (0.0, -1.0, np.nan, (1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(ParameterError, match="expected one positive number, or 2 of them"):
            to_spacing(shape, spacing)
    with pytest.raises(ParameterError, match="voxels=0: expected a whole number of at least 1"):
        to_voxel_budget(shape, 0)
    with pytest.raises(ParameterError, match="inner_radius=inf: expected a number of at least 1"):
        to_inner_distance(shape, np.inf)
    with pytest.raises(SizeError, match=r"cells need .* the limit is 1 MiB"):
        to_spacing(shape, 0.01, memory_limit=1 << 20)


@pytest.mark.data
def test_real_silhouettes_keep_their_area(data_dir):
    """Twice as fine, a silhouette of one bit keeps its area within one part in a hundred."""
    if not (data_dir / "tari1000").is_dir():
        pytest.skip(f"tari1000 is absent from {data_dir}")
    for index in (1, 9, 11, 40):
        shape = read_image(data_dir / "tari1000" / f"obj{index}_1.png")
        assert to_spacing(shape, 0.5).volume == pytest.approx(shape.volume, rel=0.012)
        assert to_voxel_budget(shape, 6000).n_nodes == pytest.approx(6000, rel=0.03)
