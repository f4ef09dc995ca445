"""The page of one shape in a browser: pictures, slider, points, sources, parts, files, comparison."""

from __future__ import annotations

import io
import json
import re
import urllib.parse
import urllib.request

import numpy as np
import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
from playwright.sync_api import expect

# From a move of the slider to its picture on the screen.
MILLISECONDS = 100.0


@pytest.fixture
def fetch(explored):
    """Return what asks the server for the body of a path."""

    def fetched(path):
        with urllib.request.urlopen(explored.address + path, timeout=60) as reply:  # noqa: S310
            return reply.read()

    return fetched


@pytest.fixture
def flat(fetch):
    """Return the id of a silhouette of a hand."""
    return json.loads(fetch("api/shapes?label=hand&limit=1"))["shapes"][0]["id"]


@pytest.fixture
def solid(fetch, explored):
    """Return the path of the page of a solid."""
    listed = json.loads(fetch(f"api/shapes?model={explored.solid}&label=dog&limit=1"))
    return f"shape/{listed['shapes'][0]['id']}?model={explored.solid}"


@pytest.fixture
def open_shape(tabs):
    """Return what opens the page of a shape and waits for its picture."""

    def opened(path, **options):
        page = tabs.open(path, **options)
        expect(page.locator(".shape-bar-title")).not_to_be_empty()
        return page

    return opened


def _query(page):
    return urllib.parse.parse_qs(urllib.parse.urlsplit(page.url).query)


def _pixels(page, selector=".shape-canvas"):
    return page.eval_on_selector(selector, "(canvas) => canvas.toDataURL()")


def _slide(page, place):
    """Move the slider and wait until its picture is there; return the milliseconds."""
    page.eval_on_selector(".shape-figure", "(figure) => delete figure.dataset.milliseconds")
    script = "(slider, place) => { slider.value = place; slider.dispatchEvent(new Event('input')); }"
    page.eval_on_selector("#shape-rho", script, place)
    page.wait_for_selector(".shape-figure[data-milliseconds]")
    return float(page.get_attribute(".shape-figure", "data-milliseconds"))


def _quickly(page):
    """Say whether a move of the slider is shown in time; other processes may hold up most of several."""
    return min(_slide(page, place) for place in (2, 9.5, 30, 44.4, 51, 58)) < MILLISECONDS


def _contour_place(page, body, point):
    """Return where a point of the contour is on the screen."""
    from spem.server.arrays import unpack_arrays

    contour = unpack_arrays(body)[1]["contour"].astype(float)
    low, high = contour.min(axis=0), contour.max(axis=0)
    box = page.locator(".shape-canvas").bounding_box()
    room = np.array([box["height"], box["width"]])
    scale = np.min((room - 28) / (high - low))
    place = room / 2 + (contour[point] - (low + high) / 2) * scale
    return {"x": place[1], "y": place[0]}


def test_slider_moves_the_picture_within_a_tenth_of_a_second(open_shape, flat):
    """Each move of the slider recolours the picture and tells the new ρ, in less than 100 ms."""
    page = open_shape(f"shape/{flat}")
    before, said = _pixels(page), page.locator(".shape-rho").inner_text()
    assert _quickly(page)
    assert _pixels(page) != before
    assert page.locator(".shape-rho").inner_text() != said
    expect(page).to_have_url(re.compile("[?&]rho="))
    page.locator("#shape-rho").press("ArrowRight")
    assert page.locator("#shape-rho").input_value() == "59"


def test_click_shows_the_profile_that_python_computes(open_shape, explored, flat, tmp_path):
    """A click on the picture shows the field of that node against ρ, to the digits of float32, and as CSV."""
    import spem
    from spem.index.index import Index
    from spem.index.row import unpack

    page = open_shape(f"shape/{flat}")
    page.locator(".shape-canvas").click()
    expect(page.locator(".shape-point .shape-note")).to_contain_text("Node")
    node = int(_query(page)["node"][0])
    field = spem.sweep(unpack(Index.open(explored.index).get(flat, model=explored.flat).shape))
    truth = field.fields()
    cells = page.locator(".shape-table td")
    table = cells.evaluate_all("(all) => all.map((cell) => Number(cell.dataset.value))")
    shown = np.reshape(table, (-1, 7))
    np.testing.assert_allclose(shown[:, 0], field.rho, rtol=1e-6)
    np.testing.assert_allclose(shown[:, 1], truth[node], atol=1e-5)
    np.testing.assert_allclose(shown[:, 4], np.median(truth, axis=0), atol=1e-5)
    page.locator(".shape-profile summary").click()
    with page.expect_download() as begun:
        page.get_by_role("button", name="Profile as CSV").click()
    begun.value.save_as(tmp_path / "profile.csv")
    saved = np.genfromtxt(tmp_path / "profile.csv", delimiter=",", names=True)
    np.testing.assert_allclose(saved["v"], truth[node], atol=1e-5)
    assert begun.value.suggested_filename.endswith(f"-node-{node}.csv")


def test_arrow_keys_move_the_point(open_shape, flat):
    """The arrow keys on the picture choose a node and step from it to the next."""
    page = open_shape(f"shape/{flat}")
    page.locator(".shape-canvas").focus()
    page.keyboard.press("ArrowRight")
    first = int(_query(page)["node"][0])
    page.keyboard.press("ArrowRight")
    assert int(_query(page)["node"][0]) == first + 1
    expect(page.locator(".shape-readout")).to_contain_text("v = ")


def test_maps_and_parts_are_chosen(open_shape, flat):
    """Maps and parts colour the picture; one part can be picked out; k can be set."""
    page = open_shape(f"shape/{flat}")
    page.get_by_role("radio", name="Map").check()
    page.get_by_role("radio", name="P3").check()
    expect(page.locator(".shape-bar-title")).to_contain_text("Map P3")
    low, middle, high = page.locator(".shape-bar-ticks span").all_inner_texts()
    assert (low.replace("−", ""), middle) == (high, "0")
    page.get_by_role("radio", name="Parts").check()
    page.locator("#shape-k").select_option("3")
    expect(page.locator(".shape-legend button")).to_have_count(3)
    whole = _pixels(page)
    page.locator(".shape-legend button").nth(1).click()
    expect(page.locator(".shape-legend button").nth(1)).to_have_attribute("aria-pressed", "true")
    assert _pixels(page) != whole
    page.get_by_label("How strongly the chosen part explains each point").check()
    expect(page.locator(".shape-bar-title")).to_have_text("Strength of part 2")
    state = {"show": ["strength"], "map": ["3"], "k": ["3"], "part": ["2"]}
    assert {key: _query(page).get(key) for key in state} == state


def test_click_on_the_contour_shows_the_log_field_of_its_source(open_shape, fetch, flat):
    """A click on the boundary colours the shape by the logarithm of the field of the patch there."""
    from spem.server.arrays import unpack_arrays

    page = open_shape(f"shape/{flat}")
    body = fetch(f"api/shapes/{flat}/geometry")
    page.locator(".shape-canvas").click(position=_contour_place(page, body, 40))
    patch = int(unpack_arrays(body)[1]["contour_patch"][40])
    expect(page.locator(".shape-bar-title")).to_have_text(f"Log field of source {patch}")
    assert _query(page)["source"] == [str(patch)]
    least = page.locator(".shape-bar-ticks span").first.inner_text()
    truth = unpack_arrays(fetch(f"api/shapes/{flat}/source/{patch}"))[1]["log"]
    assert float(least.replace("−", "-")) == pytest.approx(truth.min(), rel=0.01)


def test_address_reproduces_the_view_and_back_goes_back(open_shape, flat):
    """What is looked at stands in the address; another reader sees the same, and back returns."""
    page = open_shape(f"shape/{flat}")
    start = _pixels(page)
    page.get_by_role("radio", name="Map").check()
    page.get_by_role("radio", name="P2").check()
    page.locator(".shape-canvas").click()
    expect(page).to_have_url(re.compile("[?&]node="))
    other = open_shape(page.url.split("/", 3)[3])
    expect(other.locator(".shape-bar-title")).to_contain_text("Map P2")
    assert _pixels(other) == _pixels(page)
    for _ in range(3):
        page.go_back()
    expect(page.locator(".shape-bar-title")).to_contain_text("Field")
    assert _pixels(page) == start


def test_files_of_what_is_shown_arrive_and_are_sound(open_shape, flat, solid, tmp_path):
    """The picture, fields, maps and parts, and the surface of a solid, can be saved and read."""
    from PIL import Image

    page = open_shape(f"shape/{flat}?show=map&map=2&node=5")
    names = ("Picture, PNG", "Fields, NPZ", "Maps, NPZ", "Parts, NPZ", "Profile, CSV")
    saved = {}
    for name in names:
        with page.expect_download() as begun:
            page.locator(".shape-downloads").get_by_text(name).click()
        begun.value.save_as(tmp_path / "file")
        saved[name] = (tmp_path / "file").read_bytes()
    assert min(Image.open(io.BytesIO(saved["Picture, PNG"])).size) > 300
    assert np.load(io.BytesIO(saved["Fields, NPZ"]))["fields"].shape[1] == 64
    assert np.load(io.BytesIO(saved["Maps, NPZ"]))["maps"].ndim == 2
    assert "labels" in np.load(io.BytesIO(saved["Parts, NPZ"]))
    assert saved["Profile, CSV"].count(b"\n") > 64
    other = open_shape(solid)
    with other.expect_download() as begun:
        other.locator(".shape-downloads").get_by_text("Surface, PLY").click()
    begun.value.save_as(tmp_path / "file")
    assert (tmp_path / "file").read_bytes().startswith(b"ply")


def test_solid_turns_and_is_cut(open_shape, solid):
    """A solid is turned by keys and buttons, picked by a key, cut and recoloured within 100 ms."""
    page = open_shape(solid)
    assert page.locator(".shape-slice").count() == 3
    assert _quickly(page)
    picture = page.locator(".shape-canvas.turning")
    before = picture.screenshot()
    picture.focus()
    page.keyboard.press("ArrowLeft")
    turned = picture.screenshot()
    assert turned != before
    page.get_by_role("button", name="First view").click()
    page.keyboard.press("Tab")
    picture.focus()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("[?&]node="))
    assert len(_query(page)["slice"][0].split(",")) == 3
    page.get_by_role("slider", name="Slice across x").fill("20")
    expect(page).to_have_url(re.compile("[?&]slice=20(,|%2C)"))
    page.get_by_role("radio", name="Source").check()
    expect(page.locator(".shape-bar-title")).to_have_text("Log field of source 0")


def test_without_webgl_slices_stand_in(tabs, solid):
    """Where the browser cannot draw surfaces, the page says so and shows slices."""
    page = tabs.open("about:blank")
    page.add_init_script(
        """const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
            return kind === 'webgl2' ? null : get.call(this, kind, ...rest);
        };"""
    )
    page.goto(solid)
    expect(page.locator(".shape-stage")).to_contain_text("this browser has no WebGL 2")
    assert page.locator(".shape-slice canvas").count() == 3
    before = _pixels(page, ".shape-slice canvas")
    _slide(page, 2)
    assert _pixels(page, ".shape-slice canvas") != before


def test_two_shapes_stand_side_by_side_with_the_words_they_share(open_shape, flat):
    """A neighbour is set beside the shape on one scale, with the visual words that make them alike."""
    page = open_shape(f"shape/{flat}")
    page.locator("[data-compare]").first.click()
    assert _query(page)["compare"]
    pair = page.locator(".shape-pair canvas")
    expect(pair).to_have_count(2)
    expect(page.locator(".shape-why li")).to_have_count(4)
    before = [canvas.screenshot() for canvas in pair.all()]
    page.get_by_role("radio", name="P4").check()
    assert all(canvas.screenshot() != old for canvas, old in zip(pair.all(), before, strict=True))
    marked = pair.first.screenshot()
    page.locator(".shape-why button").first.click()
    assert pair.first.screenshot() != marked
    page.locator(".shape-compared").get_by_role("button", name="Close").click()
    expect(page.locator(".shape-compared")).to_be_hidden()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_page_fits_a_phone_in_both_themes(open_shape, solid, theme):
    """At 360 pixels nothing runs off the page, light or dark, and the controls come before the picture."""
    size = {"width": 360, "height": 740}
    page = open_shape(solid, viewport=size, color_scheme=theme, has_touch=True, is_mobile=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    controls, figure = (page.locator(name).bounding_box() for name in (".shape-controls", ".shape-figure"))
    assert controls["y"] < figure["y"]
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == (
        "rgb(250, 249, 247)" if theme == "light" else "rgb(19, 20, 22)"
    )


def test_shape_without_pictures_keeps_the_rest_of_its_page(tabs, flat):
    """Where a shape cannot be drawn the page says why, and has its report, files and neighbours."""
    tabs.allowed = ("422",)
    page = tabs.open("about:blank")
    why = {"error": "fish: no view of 4-D shapes"}
    page.route("**/geometry", lambda route: route.fulfill(status=422, json=why))
    page.goto(f"shape/{flat}")
    expect(page.locator(".shape > .shape-note")).to_have_text(why["error"])
    expect(page.locator(".shape-report")).to_contain_text("File")
    expect(page.locator(".shape-downloads a")).to_have_count(3)
    expect(page.locator(".shape-strip li")).to_have_count(11)
