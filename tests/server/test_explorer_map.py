"""The map of the collection in a browser: moved by mouse, keys and buttons, filtered, shared."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
from playwright.sync_api import expect


def _grid(route):
    """Answer with a 5 by 5 grid of two labels."""
    points = [
        {"id": f"p{i}{j}", "name": f"shape {i}{j}", "label": ("even", "odd")[(i + j) % 2], "x": i, "y": j}
        for i in range(5)
        for j in range(5)
    ]
    route.fulfill(json={"method": "grid", "points": points, "total": 25})


@pytest.fixture
def grid(tabs):
    """Return the page of a map whose points are known."""
    tabs.allowed = ("404",)
    page = tabs.open("about:blank")
    page.route("**/api/map*", _grid)
    page.goto("map?pictures=off")
    expect(page.locator("canvas[data-listed='25']")).to_be_visible()
    return page


def _listed(page, number):
    expect(page.locator(f"canvas[data-listed='{number}']")).to_be_visible()


def test_map_has_every_shape_of_the_collection(tabs):
    """The map of the collection lists its shapes, and a name leads to its shape."""
    page = tabs.open("map")
    expect(page.locator(".heading")).to_contain_text("12 shapes")
    _listed(page, 12)
    expect(page.locator(".legend-entry")).to_have_count(3)
    page.get_by_role("link", name="fish_02", exact=True).click()
    expect(page).to_have_url(re.compile("/shape/"))


def test_legend_and_name_filter_the_map(grid):
    """A label of the legend leaves its shapes, a name those that have it, and the address says both."""
    grid.get_by_role("button", name="odd").click()
    _listed(grid, 12)
    assert "label=odd" in grid.url
    grid.get_by_label("Find shapes by name").fill("shape 0")
    _listed(grid, 2)
    assert "q=shape" in grid.url
    grid.reload()
    _listed(grid, 2)
    expect(grid.get_by_role("button", name="odd")).to_have_attribute("aria-pressed", "true")
    grid.get_by_role("button", name="All labels").click()
    _listed(grid, 5)


def test_point_is_told_and_opened(grid):
    """The middle point tells its name where the mouse rests on it, and a click opens it."""
    box = grid.locator("canvas.map-canvas").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    grid.mouse.move(*middle)
    expect(grid.locator(".map-tip")).to_contain_text("shape 22")
    grid.mouse.click(*middle)
    expect(grid).to_have_url(re.compile("/shape/p22"))


def test_map_moves_by_wheel_drag_and_keys(grid):
    """Zooming in leaves fewer shapes in view, dragging moves them, 0 shows all; the address keeps it."""
    box = grid.locator("canvas.map-canvas").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    grid.mouse.move(*middle)
    grid.mouse.wheel(0, -900)
    expect(grid.locator("#in-view")).not_to_have_text("In view: 25")
    expect(grid).to_have_url(re.compile("view="))
    view = grid.url
    grid.mouse.down()
    grid.mouse.move(middle[0] + 2000, middle[1], steps=4)
    grid.mouse.up()
    expect(grid).not_to_have_url(view)
    assert "/shape/" not in grid.url
    grid.locator("canvas.map-canvas").focus()
    grid.keyboard.press("0")
    _listed(grid, 25)
    grid.keyboard.press("+")
    grid.keyboard.press("+")
    grid.keyboard.press("+")
    expect(grid.locator("#in-view")).not_to_have_text("In view: 25")
    grid.get_by_role("button", name="Show all").click()
    _listed(grid, 25)


def test_finger_first_tells_then_opens(tabs):
    """On a touch screen the first touch of a point names it and the second opens it."""
    tabs.allowed = ("404",)
    page = tabs.open("about:blank", has_touch=True, viewport={"width": 360, "height": 740})
    page.route("**/api/map*", _grid)
    page.goto("map?pictures=off")
    _listed(page, 25)
    box = page.locator("canvas.map-canvas").bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.touchscreen.tap(*middle)
    expect(page.locator(".map-tip")).to_contain_text("shape 22")
    assert "/shape/" not in page.url
    page.touchscreen.tap(*middle)
    expect(page).to_have_url(re.compile("/shape/p22"))
