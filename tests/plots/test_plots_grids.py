"""Maps of several shapes in a grid, bases in a grid, joint histograms, and level surfaces."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.errors import ParameterError, ShapeError
from spem.plots.basis_grid import draw_bases
from spem.plots.joint import draw_joint_histogram, figure_joint_histograms
from spem.plots.level_surfaces import picture_levels
from spem.plots.map_grid import figure_map_grid
from spem.plots.style import new_figure


@pytest.fixture(scope="module")
def disks() -> list[spem.Maps]:
    return [spem.maps(spem.synthetic.disk(radius=r, spacing=1.0), 3, rho=[1.0, 2.0, 4.0]) for r in (6.0, 9.0)]


def test_a_column_of_maps_shares_one_colour_scale(disks):
    """So the same colour is the same value in every shape."""
    figure = figure_map_grid(disks, ["small", "large"], which=[1])
    ends = [ax.images[0].get_clim() for ax in figure.axes[:2]]
    reach = max(np.abs(maps.values[:, 1]).max() for maps in disks)
    assert ends[0] == ends[1] == pytest.approx((-reach, reach))
    assert [ax.get_ylabel() for ax in figure.axes[:2]] == ["small", "large"]


@pytest.mark.parametrize("ndim", [1, 3])
def test_maps_of_curves_and_solids_stand_in_a_grid_too(ndim):
    """A panel for each map of each shape, and a scale below each column of pictures."""
    shape = spem.synthetic.n_ball(radius=5.0, spacing=1.0, ndim=ndim)
    figure = figure_map_grid([spem.maps(shape, 2)])
    assert len(figure.axes) == (2 if ndim == 1 else 4)
    figure.draw_without_rendering()


def test_a_grid_of_maps_needs_a_name_for_each_shape(disks):
    """Names too few, or no shape at all."""
    with pytest.raises(ParameterError, match="expected a name for each"):
        figure_map_grid(disks, ["small"])
    with pytest.raises(ParameterError, match="expected a name for each"):
        figure_map_grid([])


def test_bases_are_coloured_by_a_number_a_shape(disks):
    """A curve for each shape in each panel, the first and the last of different colours."""
    figure = new_figure(5, 2)
    draw_bases(disks, [6, 9], figure, label="radius")
    curves = figure.axes[0].lines[1:]
    assert len(curves) == 2
    assert not np.allclose(curves[0].get_color(), curves[1].get_color())
    with pytest.raises(ParameterError, match="a number for each"):
        draw_bases(disks, [6], figure, label="radius")


def test_empty_bins_of_a_joint_histogram_stay_white():
    """They are masked, so that a scale of logarithms has no zero."""
    image = draw_joint_histogram([[0.5, 0.0], [0.25, 0.25]], ((0, 1), (0, 1)), new_figure(2, 2).add_subplot())
    assert image.get_array().mask.T.tolist() == [[False, True], [False, False]]


def test_joint_histograms_stand_beside_their_solids():
    """Two shapes a pair: eight panels and a gap in a row, and a scale."""
    ball = spem.maps(spem.synthetic.ball(radius=4.0, spacing=1.0), 4)
    figure = figure_joint_histograms([ball] * 4, ["a", "b", "c", "d"])
    assert [ax.get_title() for ax in figure.axes if ax.get_title()] == ["a", "b", "c", "d"]


def test_level_surfaces_are_seen_through_the_shape():
    """Red inside, the pale shape around it, nothing beyond; and no blue where both thresholds are one."""
    ball = spem.synthetic.ball(radius=8.0, spacing=1.0)
    inward = 8.0 - np.linalg.norm(ball.points, axis=1)
    picture = picture_levels(ball, inward, (4.0, 4.0), size=(81, 81)).astype(float)
    middle, rim, corner = picture[40, 40], picture[40, 8], picture[0, 0]
    assert middle[0] > 1.3 * middle[2]
    assert middle[3] == 255
    assert 0 < rim[3] < 255
    assert rim[2] > rim[0]
    assert corner[3] == 0


def test_level_surfaces_are_of_solids():
    """Of a disk there are lines."""
    disk = spem.synthetic.disk(radius=5.0, spacing=1.0)
    with pytest.raises(ShapeError, match="a surface is drawn of a shape of 3 dimensions"):
        picture_levels(disk, np.zeros(disk.n_nodes), (-1.0, 1.0))
