"""Pictures of parts: regions, boundaries, components, several shapes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from spem.decomposition.parts import Parts
from spem.errors import ParameterError, ShapeError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.plots.boundary_lines import draw_boundary
from spem.plots.layout import colour_key, panels
from spem.plots.part_components import figure_components
from spem.plots.part_pictures import TONE, draw_parts, picture_parts
from spem.plots.parts import figure_parts
from spem.plots.style import INK, NO_PART, PART_COLOURS, new_figure, part_colours
from spem.shapes.shape import Shape


def halves(*shape: int, over: str = "region", name: str = "bar") -> Parts:
    """Make a box whose halves along the last axis are parts 0 and 1; its first node is in none."""
    box = Shape.from_mask(np.ones(shape), name=name)
    sources = point_sources(assemble(box))
    middle = box.points[:, -1].mean()
    nodes = (box.points[:, -1] > middle).astype(np.int32)
    ends = (sources.position[:, -1] > middle).astype(np.int32)
    weights = [np.stack([labels == 0, labels == 1]).astype(float) for labels in (nodes, ends)]
    nodes[0] = -1
    components, basis = weights if over == "region" else weights[::-1]
    return Parts(sources, np.inf, over, components, basis, nodes, ends, np.array([0.5, 0.5]))


def drawn(parts: Parts, **options: object):
    """Draw parts on an axis of their own."""
    ax = new_figure(3, 3).add_subplot()
    return draw_parts(parts, ax, **options), ax


def test_region_has_the_colours_of_its_parts():
    """Left of the border one colour, right of it the other, grey where there is no part; nothing between."""
    image, _ = drawn(halves(6, 12), boundary=False)
    pixels = image.get_array()
    colours = np.unique(pixels[pixels[..., 3] == 1][:, :3], axis=0)
    assert np.array_equal(colours, np.unique(part_colours([0, 1, -1]), axis=0))
    rows, columns = pixels.shape[:2]
    assert np.allclose(pixels[rows // 2, columns // 4, :3], part_colours([0])[0])
    assert np.allclose(pixels[rows // 2, 3 * columns // 4, :3], part_colours([1])[0])


def test_boundary_stands_out_from_its_region():
    """With the boundary drawn, the region is toned down and the lines have the full colours."""
    image, ax = drawn(halves(6, 12))
    pixels = image.get_array()
    full = part_colours([1])[0]
    assert np.allclose(pixels[pixels.shape[0] // 2, -200, :3], full + TONE * (1 - full))
    lines = ax.collections[0]
    colours = {tuple(colour) for colour in lines.get_colors().round(6)}
    assert colours == {tuple(np.round(to_rgba(PART_COLOURS[j]), 6)) for j in (0, 1)}


def test_stretches_of_a_boundary_cover_it():
    """The coloured stretches are together as long as the outline, and each lies beside its source."""
    parts = halves(8, 20)
    ax = new_figure(3, 3).add_subplot()
    lines = draw_boundary(parts.sources, part_colours(parts.source_labels), ax)
    whole = draw_boundary(parts.sources, part_colours(np.zeros_like(parts.source_labels)), ax)

    def length(drawn):
        return sum(np.linalg.norm(np.diff(path.vertices, axis=0), axis=1).sum() for path in drawn.get_paths())

    assert length(lines) == pytest.approx(length(whole))
    for path, colour in zip(lines.get_paths(), lines.get_colors(), strict=True):
        side = int(path.vertices[:, 0].mean() > 9.5)
        assert np.allclose(colour[:3], part_colours([side])[0])


def test_stretches_without_a_source_are_left_out():
    """Where no source lies there is no line."""
    parts = halves(8, 20)
    right = parts.sources.select(np.flatnonzero(parts.source_labels == 1))
    ax = new_figure(3, 3).add_subplot()
    lines = draw_boundary(right, np.zeros((right.n_sources, 3)), ax)
    assert min(path.vertices[:, 0].min() for path in lines.get_paths()) > 8.5


@pytest.mark.parametrize(("colours", "widths"), [(np.zeros((1, 3)), 1.0), (np.zeros((56, 3)), [1.0, 2.0])])
def test_colours_and_widths_of_a_boundary_are_counted(colours, widths):
    """Each source needs one of each."""
    ax = new_figure(3, 3).add_subplot()
    with pytest.raises(ParameterError, match="56 sources need as many colours and widths"):
        draw_boundary(halves(8, 20).sources, colours, ax, widths=widths)


def test_numbers_stand_in_their_parts():
    """Each part bears its label inside itself; without room, none is written."""
    parts = halves(8, 20)
    _, ax = drawn(parts)
    places = {text.get_text(): text.get_position() for text in ax.texts}
    assert set(places) == {"0", "1"}
    assert places["0"][0] < 9.5 < places["1"][0]
    _, tight = drawn(halves(2, 300))
    assert not tight.texts
    _, bare = drawn(parts, numbers=False)
    assert not bare.texts


def test_numbers_can_be_read_on_dark_parts():
    """On the full blue the number is white, on the orange it is ink."""
    _, ax = drawn(halves(8, 20), boundary=False)
    assert {text.get_text(): text.get_color() for text in ax.texts} == {"0": "white", "1": INK}


def test_key_names_each_label_once_for_all_shapes():
    """Of several shapes the key has every label that occurs, in order, in the colours of the pictures."""
    one, two = halves(4, 8, name="one"), halves(4, 10, name="two").relabelled([-1, 0, 1])
    figure = figure_parts([one, two])
    [key] = figure.legends
    assert [text.get_text() for text in key.get_texts()] == ["0", "1", "2", "none"]
    faces = [patch.get_facecolor() for patch in key.get_patches()]
    assert faces == [to_rgba(colour) for colour in (*PART_COLOURS[:3], NO_PART)]
    assert [ax.get_title() for ax in figure.axes] == ["one", "two"]


def test_key_of_one_shape_tells_sizes():
    """The share of each part in the nodes, and of those in none."""
    key = figure_parts(halves(5, 10)).legends[0]
    words = [text.get_text().split() for text in key.get_texts()]
    assert [(word[0], word[1]) for word in words] == [("0", "48"), ("1", "50"), ("none", "2")]


def test_names_of_shapes_are_no_formulas():
    """A file name with dollars is written as it is; titles that are given may hold formulas."""
    shapes = [halves(4, 8, name="$x_{^$"), halves(4, 8, name="$y")]
    figure = figure_parts(shapes)
    figure.canvas.draw()
    assert [ax.get_title() for ax in figure.axes[:2]] == ["$x_{^$", "$y"]
    assert figure_parts(shapes, ["$x$", "$y$"]).axes[0].title.get_parse_math()


def test_titles_stand_level():
    """Shapes of different proportions share panels of one height, the picture in the middle."""
    figure = figure_parts([halves(4, 12, name="wide"), halves(12, 4, name="tall")])
    figure.canvas.draw()
    tops = {round(ax.get_position().y1, 6) for ax in figure.axes}
    assert len(tops) == 1


@pytest.mark.parametrize("end", ["", "  100 %"])
@pytest.mark.parametrize("entries", [1, 7, 30])
def test_a_key_fits_beside_its_panels(entries, end):
    """However many entries, the key stays in the figure and off the panels."""
    words = [f"{j}{end}" for j in range(entries)]
    figure, axes = panels(2, key=words)
    key = colour_key(figure, part_colours(np.arange(entries)), words)
    figure.canvas.draw()
    box = key.get_window_extent()
    assert box.x0 > axes[-1].get_window_extent().x1
    assert box.x1 < figure.bbox.x1 < box.x1 + figure.dpi * 0.4
    assert 0 <= box.y0 < box.y1 <= figure.bbox.y1


def test_bodies_are_drawn_as_surfaces():
    """A box in space shows both colours, lit, and no other."""
    parts = halves(6, 6, 12)
    picture = picture_parts(parts.shape, parts.node_labels, view=(0, 0), size=(120, 80))
    solid = picture[picture[..., 3] == 255][:, :3].astype(float)
    hue = solid / solid.max(axis=1, keepdims=True)
    for label in (0, 1):
        colour = part_colours([label])[0]
        assert (np.abs(hue - colour / colour.max()).max(axis=1) < 0.02).mean() > 0.3
    figure = figure_parts([parts, parts], columns=1)
    assert [ax.images[0].get_array().shape[2] for ax in figure.axes] == [4, 4]


@pytest.mark.parametrize("over", ["region", "boundary"])
@pytest.mark.parametrize("shape", [(9,), (5, 10), (4, 4, 8)])
def test_components_have_a_panel_each(shape, over):
    """In one, two and three dimensions, titled with label and intensity; absent parts have none."""
    parts = halves(*shape, over=over)
    figure = figure_components(parts)
    assert [ax.get_title() for ax in figure.axes] == ["0   50 %", "1   50 %"]
    gone = parts.relabelled([-1, 1])
    assert [ax.get_title() for ax in figure_components(gone).axes] == ["1   50 %"]


def test_components_are_drawn_where_they_weigh():
    """The weights of the nodes are the picture, those of the sources the width of the outline."""
    parts = halves(5, 10)
    ax = figure_components(parts).axes[1]
    picture = ax.images[0].get_array()
    assert (picture[3, 1:5] == 0).all()
    assert (picture[3, 7:11] == 1).all()
    lines = ax.collections[0]
    wide = [path.vertices[:, 0].mean() > 4.5 for path in lines.get_paths()]
    assert (np.array(lines.get_linewidths()) > 1).tolist() == wide


def test_a_line_is_a_band():
    """A shape of one dimension shows its parts side by side, clear outside."""
    image, _ = drawn(halves(6))
    pixels = image.get_array()[0]
    assert pixels[:, 3].tolist() == [0, 1, 1, 1, 1, 1, 1, 0]
    assert np.allclose(pixels[1:7, :3], part_colours([-1, 0, 0, 1, 1, 1]))


def test_shapes_of_four_dimensions_are_refused():
    """There is no picture of them, and the message says so."""
    four = halves(2, 2, 2, 2)
    for draw in (figure_parts, figure_components, drawn):
        with pytest.raises(ShapeError, match="this one has 4"):
            draw(four)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"titles": ["a", "b"]}, "1 shapes need as many titles, not 2"),
        ({"meshes": []}, "as many meshes, not 0"),
    ],
)
def test_titles_and_meshes_are_counted(options, message):
    """Each shape needs one, or none is given."""
    with pytest.raises(ParameterError, match=message):
        figure_parts([halves(4, 4)], **options)


def test_nothing_to_draw_is_refused():
    """A figure of no shape at all is an error."""
    with pytest.raises(ParameterError, match="nothing to draw"):
        figure_parts([])


@pytest.mark.parametrize("label", [-5, -1, 0, 19, 20, 45])
def test_colours_depend_on_the_label_alone(label):
    """Whatever else is asked for, a label has its colour; beyond the palette it begins anew."""
    colour = part_colours([3, label])[1]
    assert np.array_equal(colour, part_colours(label))
    assert np.array_equal(colour, part_colours(label % 20 if label >= 0 else -1))


def test_toys_need_no_sources():
    """A shape in space needs nothing but labels, so any labels of nodes can be drawn."""
    toy = SimpleNamespace(shape=Shape.from_mask(np.ones((3, 3, 3))), node_labels=np.zeros(27, int))
    assert len(figure_parts(toy).axes) == 1
