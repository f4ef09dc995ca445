"""Images, outlines, slices, curves and the figures made of them."""

from __future__ import annotations

from io import BytesIO
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.axes import Axes
from PIL import Image

from spem.errors import ParameterError, ShapeError
from spem.plots.curves import draw_precision_recall
from spem.plots.fields import draw_line, draw_outline, draw_slice, draw_values
from spem.plots.figures import figure_fields, figure_maps, figure_slices, map_name, map_picture
from spem.plots.layout import panels
from spem.plots.profiles import draw_basis, draw_profiles, draw_variance
from spem.plots.style import figure_png, image_png, new_figure
from spem.plots.values import value_limits
from spem.shapes.shape import Cuts, Shape


@pytest.fixture
def ax() -> Axes:
    """Return an empty axis."""
    return new_figure(3, 3).add_subplot()


def elbow() -> Shape:
    """Make an L of five pixels: down the left, then right along the bottom."""
    return Shape.from_mask([[1, 0, 0], [1, 0, 0], [1, 1, 1]], spacing=(2.0, 1.0), name="elbow")


def fake_maps(shape: Shape, n_maps: int = 3) -> SimpleNamespace:
    """Make maps with known values."""
    values = np.sin(np.outer(np.arange(shape.n_nodes), np.arange(1, n_maps + 1)))
    explained = 10.0 ** -np.arange(n_maps)
    return SimpleNamespace(
        shape=shape,
        values=values,
        basis=np.eye(4)[:, :n_maps],
        rho=np.array([1.0, 2, 5, np.inf]),
        explained=explained / explained.sum(),
        variance=explained,
        centred=False,
    )


def test_row_zero_is_at_the_top(ax: Axes) -> None:
    """An image keeps the file's orientation: rows go down, columns right, in spaced coordinates."""
    shape = elbow()
    image = draw_values(shape, np.arange(5), ax)
    left, right, bottom, top = image.get_extent()
    assert top < bottom
    assert (left, right, top, bottom) == (-1.5, 3.5, -3.0, 7.0)
    grid = image.get_array()
    assert grid[1, 1] == 0
    assert grid[3, 3] == 4


def test_colours_end_at_the_outline() -> None:
    """Every pixel within the outline is coloured and none beyond it, with a hole left clear."""
    x, y = np.meshgrid(*[np.arange(-9.0, 10)] * 2, indexing="ij")
    radius = np.hypot(x, y)
    shape = Shape.from_mask((radius < 8.2) & (radius > 3.3))
    figure = new_figure(2, 2)
    figure.set_layout_engine("none")
    ax = figure.add_axes((0, 0, 1, 1))
    draw_values(shape, np.ones(shape.n_nodes), ax)
    opacity = np.asarray(Image.open(BytesIO(figure_png(figure, dpi=100))))[..., 3]
    voxel = 200 / shape.mask.shape[0]
    x, y = np.meshgrid(*[(np.arange(200) - 99.5) / voxel] * 2, indexing="ij")
    radius = np.hypot(x, y)
    assert (opacity[(radius < 7.8) & (radius > 3.7)] == 255).all()
    assert (opacity[(radius > 8.8) | (radius < 2.9)] == 0).all()


def test_signed_values_are_centred(ax: Axes) -> None:
    """Signed values have zero in the middle of a diverging map."""
    image = draw_values(elbow(), [-1, 0, 0.5, 2, 1], ax, symmetric=True)
    assert image.get_clim() == (-2, 2)
    assert image.get_cmap().name == "RdBu_r"


@pytest.mark.parametrize(
    ("values", "symmetric", "wanted"),
    [([0.0, 0.0], True, (-1, 1)), ([2.0, 2.0], False, (2, 3)), ([np.nan, 1, 4], False, (1, 4))],
)
def test_limits_of_flat_values(values: list[float], symmetric: bool, wanted: tuple[float, float]) -> None:
    """Constant and missing values leave a scale of positive width."""
    assert value_limits(values, symmetric=symmetric) == wanted


def test_contours_lie_between_their_values(ax: Axes) -> None:
    """Lines of equal value of a linear function are straight."""
    shape = Shape.from_mask(np.ones((20, 20)))
    draw_values(shape, shape.points[:, 1], ax, contours=True)
    for path in ax.collections[0].get_paths():
        assert np.ptp(path.vertices[:, 0]) < 1e-6


def test_outline_follows_the_cuts(ax: Axes) -> None:
    """The outline of a disc with exact cuts keeps its radius within a tenth of a pixel."""
    t = np.arange(-12.0, 13)
    x, y = np.meshgrid(t, t, indexing="ij")
    inside, voxel, direction, fraction = x**2 + y**2 < 100.3, [], [], []
    for axis, (a, b) in enumerate(((x, y), (y, x))):
        for side, sign in enumerate((-1, 1)):
            theta = np.sqrt(np.maximum(100.3 - b**2, 0)) - sign * a
            hit = np.flatnonzero(inside & (theta <= 1))
            voxel.append(hit)
            direction.append(np.full(hit.size, 2 * axis + side, np.uint8))
            fraction.append(theta.ravel()[hit])
    cuts = Cuts(np.concatenate(voxel), np.concatenate(direction), np.concatenate(fraction))
    lines = draw_outline(Shape.from_mask(inside, origin=(-12.0, -12.0), cuts=cuts), ax)
    [path] = lines.get_paths()
    assert np.abs(np.linalg.norm(path.vertices, axis=1) - np.sqrt(100.3)).max() < 0.12


def test_slice_holds_the_values_of_its_plane(ax: Axes) -> None:
    """A slice across axis 0 has axis 1 down and axis 2 right."""
    shape = Shape.from_mask(np.ones((3, 4, 5)))
    image = draw_slice(shape, shape.points @ [0, 10, 1], ax, axis=0)
    assert image.get_array()[1:-1, 1:-1][3, 2] == 32


def test_line_breaks_where_the_shape_does(ax: Axes) -> None:
    """A one-dimensional shape in two pieces is drawn as two curves."""
    line = draw_line(Shape.from_mask([1, 1, 0, 1], spacing=0.5), [1, 2, 3], ax)
    assert np.isnan(line.get_ydata()).tolist() == [True, False, False, True, False, True]
    assert line.get_xdata()[1] == 0


@pytest.mark.parametrize("grid", [(9,), (6, 7), (4, 5, 6)])
def test_figures_of_every_dimension(grid: tuple[int, ...]) -> None:
    """Fields and maps of one, two and three dimensions give a panel each, with titles, and draw."""
    shape = Shape.from_mask(np.ones(grid))
    maps = fake_maps(shape)
    fields = figure_fields(shape, np.full((shape.n_nodes, 2), 0.5), ["a", "b"])
    assert [a.get_title() for a in fields.axes[:2]] == ["a", "b"]
    figure = figure_maps(maps)
    assert [a.get_title()[:2] for a in figure.axes[:3]] == ["P₁", "P₂", "P₃"]
    assert figure_png(figure, dpi=40).startswith(b"\x89PNG")
    assert map_picture(maps, 2).startswith(b"\x89PNG")


def test_slices_share_one_scale() -> None:
    """The three slices of a long volume are drawn at the same size of voxel."""
    shape = Shape.from_mask(np.ones((3, 4, 12)))
    figure = figure_slices(shape, np.ones(shape.n_nodes))
    widths = {float(np.ptp(a.get_xlim())) for a in figure.axes}
    assert len(widths) == 1
    assert all(a.get_ylim()[0] > a.get_ylim()[1] for a in figure.axes)


def test_even_rows() -> None:
    """Six panels of at most five in a row stand in two rows of three."""
    figure, axes = panels(6, columns=5)
    assert len(axes) == 6
    assert axes[0].get_subplotspec().get_gridspec().get_geometry() == (2, 3)
    figure.draw_without_rendering()
    tops = [round(axis.get_position().y1, 6) for axis in axes]
    assert tops == [tops[0]] * 3 + [tops[3]] * 3
    assert tops[0] > tops[3]


@pytest.mark.parametrize("grid", [(9,), (6, 7), (4, 5, 6)])
def test_profiles_go_with_marks_on_the_shape(ax: Axes, grid: tuple[int, ...]) -> None:
    """Each node has a curve over finite ρ and a mark of the same colour on the inset."""
    shape = Shape.from_mask(np.ones(grid))
    rho = np.array([1.0, 10.0, 100.0, np.inf])
    values = np.linspace(0, 1, shape.n_nodes)[:, None] * np.ones(4)
    hyperfield = SimpleNamespace(shape=shape, rho=rho, fields=lambda: values)
    lines = draw_profiles(hyperfield, [0, 3], ax)
    np.testing.assert_allclose(lines[1].get_ydata(), values[3, :3])
    assert ax.get_xscale() == "log"
    marks = [m for m in ax.child_axes[0].lines if m.get_color() == lines[1].get_color()]
    assert len(marks) == 1
    if shape.ndim == 2:
        assert (marks[0].get_xdata()[0], marks[0].get_ydata()[0]) == tuple(shape.points[3][::-1])
    figure_png(ax.figure, dpi=30)


def test_basis_and_variance(ax: Axes) -> None:
    """Basis vectors are drawn over finite ρ; the variance has a bar a map, on a log scale."""
    maps = fake_maps(elbow())
    lines = draw_basis(maps, ax)
    assert [line.get_label() for line in lines] == ["Φ₁", "Φ₂", "Φ₃"]
    assert lines[0].get_xdata().tolist() == [1, 2, 5]
    bars = draw_variance(maps, new_figure(2, 2).add_subplot())
    tops = [b.get_y() + b.get_height() for b in bars]
    np.testing.assert_allclose(tops, maps.explained)


def test_curves_are_told_apart_without_colour(ax: Axes) -> None:
    """Ten precision-recall curves have ten looks, a legend, and axes from 0 to 1."""
    curve = SimpleNamespace(recall=np.array([0.5, 1.0]), precision=np.array([1.0, 0.5]))
    lines = draw_precision_recall({f"run {k}": curve for k in range(10)}, ax)
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 10
    assert len(ax.get_legend().get_texts()) == 10
    assert ax.get_xlim() == (0, 1)


def test_map_names_count_from_one() -> None:
    """The tenth map is called P₁₀."""
    assert map_name(9) == "P₁₀"


def test_what_cannot_be_drawn_is_said(ax: Axes) -> None:
    """Four dimensions, wrong lengths, nodes, titles, planes and pictures raise one clear line each."""
    four = Shape.from_mask(np.ones((2, 2, 2, 2)), name="tesseract")
    with pytest.raises(ShapeError, match=r"tesseract: shapes of 1, 2 and 3 dimensions .*, this one"):
        figure_fields(four, np.ones(16))
    with pytest.raises(ShapeError, match="an image is drawn of a shape of 2 dimensions"):
        draw_values(four, np.ones(16), ax)
    with pytest.raises(ParameterError, match=r"elbow: values must be \(5,\), one a node, not \(4,\)"):
        draw_values(elbow(), np.ones(4), ax)
    with pytest.raises(ParameterError, match=r"elbow: values must be \(5, k\)"):
        figure_fields(elbow(), np.ones((4, 2)))
    with pytest.raises(ParameterError, match="1 fields need as many titles, not 2"):
        figure_fields(elbow(), np.ones(5), ["a", "b"])
    with pytest.raises(ParameterError, match="nodes must be some of 0 to 4"):
        draw_profiles(SimpleNamespace(shape=elbow()), [5], ax)
    with pytest.raises(ParameterError, match="axis 0 has planes 0 to 4, not 9"):
        draw_slice(Shape.from_mask(np.ones((3, 3, 3))), np.ones(27), ax, axis=0, index=9)
    with pytest.raises(ParameterError, match="axis must be 0, 1 or 2, not 3"):
        draw_slice(Shape.from_mask(np.ones((3, 3, 3))), np.ones(27), ax, axis=3)
    with pytest.raises(ParameterError, match="no precision-recall curve"):
        draw_precision_recall({}, ax)
    with pytest.raises(ParameterError, match="nothing to draw"):
        panels(0)
    with pytest.raises(ParameterError, match="a picture is"):
        image_png(np.zeros((3, 3)))


@pytest.mark.data
def test_real_silhouette(data_dir, ax: Axes) -> None:
    """A hand of Kimia's silhouettes is drawn upright, with an outline around its five fingers."""
    pixels = np.array(Image.open(data_dir / "kimia99" / "hand.png"))
    shape = Shape.from_mask(pixels == 255, name="hand")
    image = draw_values(shape, np.ones(shape.n_nodes), ax, contours=False)
    assert image.get_array().shape == shape.mask.shape
    assert len(draw_outline(shape, ax).get_paths()) == 1
