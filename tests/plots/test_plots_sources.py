"""Pictures of single-source fields: lines of equal value, arrows, streamlines, and the paper's figures."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from matplotlib.axes import Axes
from PIL import Image

from spem.errors import ParameterError, ShapeError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.streamlines import source_streamlines
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.plots.sources import (
    figure_measurements,
    figure_solid_source,
    figure_source,
    figure_superposition,
)
from spem.plots.streams import draw_contours, draw_directions, draw_streamlines, mark_source
from spem.plots.style import figure_png, new_figure
from spem.shapes.shape import Shape
from spem.shapes.synthetic import disk, interval


@pytest.fixture
def ax() -> Axes:
    """Return an empty axis."""
    return new_figure(3, 3).add_subplot()


def _fields(mask, rho=np.inf) -> SourceFields:
    """Solve for every boundary point of a mask."""
    return solve_sources(point_sources(assemble(Shape.from_mask(mask, name="blob"), "voxel")), rho)


def _inked(figure) -> float:
    """Return the share of a figure that is drawn upon."""
    return float((np.asarray(Image.open(BytesIO(figure_png(figure, dpi=60))))[..., 3] > 0).mean())


def test_contours_are_where_the_values_are(ax):
    """Lines of equal distance from the middle of a disk are circles, in the colours of their levels."""
    shape = disk(1.0, (0.05, 0.04), offset=0.3)
    drawn = draw_contours(shape, np.linalg.norm(shape.points, axis=1), ax, levels=[0.25, 0.75], limits=(0, 1))
    radii = [np.linalg.norm(path.vertices, axis=1) for path in drawn.get_paths()]
    assert [float(r.mean()) for r in radii] == pytest.approx([0.25, 0.75], abs=5e-3)
    assert drawn.get_array().tolist() == [0.25, 0.75]
    assert drawn.get_clim() == (0, 1)


def test_contours_end_a_margin_below_the_outline(ax):
    """Lines that cross a square end as deep as the margin; those that run along its side are left out."""
    shape = Shape.from_mask(np.ones((20, 20)))
    drawn = draw_contours(shape, shape.points[:, 1], ax, levels=[0.2, 9.5], margin=1)
    (path,) = drawn.get_paths()
    assert np.allclose(path.vertices[:, 0], 9.5)
    assert path.vertices[:, 1].min() == 19 - path.vertices[:, 1].max() == 1
    assert drawn.get_array().tolist() == [9.5]


def test_contours_pass_over_unreached_components(ax):
    """Where a field is zero no line is drawn and nothing warns."""
    fields = _fields([[1, 1, 1, 1, 0, 0, 1, 1], [1, 1, 1, 1, 0, 0, 1, 1]])
    drawn = draw_contours(fields.sources.system.shape, fields.log[0], ax, levels=6)
    assert drawn.get_paths()
    assert max(path.vertices[:, 0].max() for path in drawn.get_paths()) < 5


def test_arrows_point_along_the_axes_of_the_picture(ax):
    """The component along axis 0 goes down, that along axis 1 right; a window keeps the nodes in it."""
    shape = Shape.from_mask(np.ones((5, 6)), spacing=(2.0, 1.0))
    arrows = draw_directions(shape, np.tile([0.25, -0.75], (30, 1)), ax, window=((1, 5), (2, 4.5)))
    assert arrows.N == 2 * 3
    assert (arrows.U == -0.75).all()
    assert (arrows.V == 0.25).all()
    assert ax.get_ylim() == (5, 1)
    assert ax.get_xlim() == (2, 4.5)
    assert draw_directions(shape, np.zeros((30, 2)), ax, every=2).N < 12


def test_streamlines_are_drawn_in_xy(ax):
    """Points (row, column) become x = column, y = row."""
    fields = _fields(np.ones((3, 9)))
    lines = source_streamlines(fields, 0, [26, 4])
    drawn = draw_streamlines(fields.sources.system.shape, lines, ax)
    assert [path.vertices.tolist() for path in drawn.get_paths()] == [
        line[:, ::-1].tolist() for line in lines
    ]
    assert mark_source([1.0, 2.0], ax).get_ydata().tolist() == [1.0]


def test_figure_of_a_source_has_three_panels():
    """Figure 5 of an L: values with lines, arrows in a window at its far end, streamlines to the source."""
    mask = np.zeros((20, 20))
    mask[:, :7] = mask[13:] = 1
    fields = _fields(mask)
    figure = figure_source(fields, 0)
    assert _inked(figure) > 0.1
    top, left = figure.axes[1].get_ylim()[1], figure.axes[1].get_xlim()[0]
    assert top > 5
    assert left > 5
    given = figure_source(fields, 0, window=((0, 4), (0, 5)), n_lines=3)
    assert given.axes[1].get_xlim() == (0, 5)
    assert len(given.axes[2].collections[0].get_paths()) == 3


def test_figures_of_shapes_in_pieces():
    """A component without the source is the darkest, has no lines, and breaks nothing."""
    fields = _fields([[1, 1, 1, 1, 0, 0, 1, 1], [1, 1, 1, 1, 0, 0, 1, 1]])
    assert _inked(figure_source(fields, 0)) > 0.02
    assert _inked(figure_measurements(fields, 0)) > 0.02


def test_measurements_share_one_scale():
    """Figure 7: the median and the mean stand side by side, from zero to the greater maximum."""
    figure = figure_measurements(_fields(np.ones((4, 20))), 3)
    limits = {ax.images[0].get_clim() for ax in figure.axes[:2]}
    assert len(limits) == 1
    assert limits.pop()[0] == 0


def test_superposition_reaches_the_boundary():
    """Figure 4: each row sums to its last curve, which is one at both ends."""
    sources = point_sources(assemble(interval(4.0, 0.25)))
    slices = [solve_sources(sources, rho) for rho in (0.5, 2.0, np.inf)]
    figure = figure_superposition(slices)
    assert len(figure.axes) == 9
    for row in range(3):
        one, two, total = (ax.lines[0] for ax in figure.axes[3 * row : 3 * row + 3])
        assert total.get_xdata()[[0, -1]].tolist() == [-2, 2]
        assert total.get_ydata()[[0, -1]].tolist() == [1, 1]
        assert one.get_ydata() + two.get_ydata() == pytest.approx(total.get_ydata(), nan_ok=True)
    assert "ρ = inf" in figure.axes[8].get_title()


def test_superposition_is_broken_between_pieces():
    """In the voxel model too, curves reach the boundary voxels and stop between components."""
    fields = _fields([1, 1, 0, 0, 0, 1, 1], 1.0)
    line = figure_superposition([fields]).axes[-1].lines[0]
    known = dict(zip(line.get_xdata().tolist(), line.get_ydata().tolist(), strict=True))
    assert [x for x, y in known.items() if np.isnan(y)] == [3.0]
    assert known[-1.0] == known[2.0] == known[4.0] == known[7.0] == 1


def test_solids_have_their_own_figure():
    """Log v on the surface of a solid, and streamlines seen through it that end at the mark."""
    fields = _fields(np.ones((4, 5, 9)))
    figure = figure_solid_source(fields, 0, n_lines=9)
    mark = figure.axes[1].lines[0]
    ends = [path.vertices[-1] for path in figure.axes[1].collections[0].get_paths()]
    assert len(ends) == 9
    assert np.ptp(ends, axis=0).max() < 1e-6
    assert ends[0] == pytest.approx([mark.get_xdata()[0], mark.get_ydata()[0]])


def test_bad_arguments_are_refused(ax):
    """Other dimensions, other lengths, empty windows and unknown sources have their line."""
    flat, solid = _fields(np.ones((3, 4))), _fields(np.ones((3, 3, 3)))
    shape = flat.sources.system.shape
    with pytest.raises(ShapeError, match="of 2 dimensions, this one has 3"):
        figure_source(solid, 0)
    with pytest.raises(ShapeError, match="of 2 dimensions, this one has 3"):
        figure_measurements(solid, 0)
    with pytest.raises(ShapeError, match="of 3 dimensions, this one has 2"):
        figure_solid_source(flat, 0)
    with pytest.raises(ShapeError, match="of 1 dimensions, this one has 2"):
        figure_superposition([flat])
    with pytest.raises(ParameterError, match="nothing to draw"):
        figure_superposition([])
    for draw in (figure_source, figure_measurements):
        with pytest.raises(ParameterError, match="source 99, expected 0 to 13"):
            draw(flat, 99)
    with pytest.raises(ParameterError, match=r"blob: vectors must be \(12, 2\)"):
        draw_directions(shape, np.ones((12, 3)), ax)
    with pytest.raises(ParameterError, match="no node of every 1 lies in the window"):
        draw_directions(shape, np.ones((12, 2)), ax, window=((50, 60), (0, 1)))
