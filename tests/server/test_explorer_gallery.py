"""The gallery in a browser: what is shown, found, filtered, sorted and kept in the address."""

from __future__ import annotations

import re
import time
import urllib.parse

import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
from playwright.sync_api import expect

FIRST_PAGE = 2.0
DRAWING = '<svg xmlns="http://www.w3.org/2000/svg" width="4" height="4"/>'


def _query(page):
    return urllib.parse.parse_qs(urllib.parse.urlsplit(page.url).query)


def _first_page(tabs):
    """Open the gallery with nothing cached; return the page and the seconds until its pictures are there."""
    page = tabs.open("about:blank")
    start = time.perf_counter()
    page.goto("")
    page.locator(".grid img").nth(11).wait_for()
    script = "[...document.querySelectorAll('.grid img')].slice(0, 6).every((one) => one.complete)"
    while not page.evaluate(script):
        page.wait_for_timeout(10)
    return page, time.perf_counter() - start


def test_first_page_is_there_within_two_seconds(tabs):
    """The gallery shows its cards and pictures within two seconds, without a complaint of the browser."""
    page, seconds = _first_page(tabs)
    tries = 1
    # Whatever else runs on the machine may delay one.
    while seconds > FIRST_PAGE and tries < 3:
        page, seconds = _first_page(tabs)
        tries += 1
    assert seconds < FIRST_PAGE
    expect(page.locator(".count")).to_have_text("12 shapes")
    expect(page).to_have_title("Shapes · spem")
    assert page.evaluate("document.querySelector('.grid img').naturalWidth") > 0


def test_search_box_narrows_the_gallery_and_the_address(tabs):
    """Letters of a name leave the shapes that have them, and the address says so."""
    page = tabs.open()
    page.keyboard.press("/")
    expect(page.locator("#q")).to_be_focused()
    page.keyboard.type("fish")
    expect(page.locator(".count")).to_have_text("4 shapes found")
    assert _query(page)["q"] == ["fish"]
    names = page.locator(".card .name").all_inner_texts()
    assert sorted(names) == ["fish_01", "fish_02", "fish_03", "fish_04"]
    page.keyboard.press("Escape")
    expect(page.locator(".count")).to_have_text("12 shapes")


def test_filters_can_be_shared_and_cleared(tabs):
    """An address with a label and an order opens on them; where nothing matches, one click shows all."""
    page = tabs.open("?label=hand&sort=volume")
    expect(page.locator(".count")).to_have_text("4 shapes found")
    expect(page.get_by_label("Label")).to_have_value("hand")
    expect(page.get_by_label("Sort by")).to_have_value("volume")
    page.locator("#q").fill("nowhere")
    expect(page.get_by_role("heading", name="No shape matches")).to_be_visible()
    page.get_by_role("button", name="Show all shapes").click()
    expect(page.locator(".count")).to_have_text("12 shapes")
    assert _query(page) == {"sort": ["volume"]}


def test_model_is_chosen_in_the_bar(tabs, explored):
    """Of an index with several models one is looked at, and the address names it; long names fit a phone."""
    page = tabs.open(f"?model={explored.solid}", viewport={"width": 360, "height": 740})
    expect(page.locator(".count")).to_have_text("3 shapes")
    choice = page.get_by_label("Model")
    expect(choice).to_be_in_viewport()
    choice.evaluate("(box) => box.options[0].append(' and'.repeat(40))")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    choice.select_option(explored.flat)
    expect(page.locator(".count")).to_have_text("12 shapes")
    assert _query(page)["model"] == [explored.flat]


def test_arrow_keys_walk_the_grid(tabs):
    """Arrow keys move between cards by rows and columns, Enter opens one, and the browser goes back."""
    page = tabs.open()
    cards = page.locator("a.card")
    expect(cards).to_have_count(12)
    cards.first.focus()
    page.keyboard.press("ArrowRight")
    expect(cards.nth(1)).to_be_focused()
    page.keyboard.press("ArrowDown")
    columns = page.evaluate(
        "getComputedStyle(document.querySelector('.grid')).gridTemplateColumns.split(' ').length"
    )
    expect(cards.nth(1 + columns)).to_be_focused()
    page.keyboard.press("Home")
    expect(cards.first).to_be_focused()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/shape/"))
    expect(page.get_by_role("heading", level=1)).to_have_text("dog_01")
    page.go_back()
    expect(page.locator(".count")).to_have_text("12 shapes")


def test_long_collections_come_in_pieces(tabs):
    """More shapes than one piece are told and come on demand, after those that are there."""
    page = tabs.open("about:blank")
    page.route("**/api/shapes?*", _many)
    page.route("**/thumbnail.png", lambda route: route.fulfill(body=DRAWING, content_type="image/svg+xml"))
    page.goto("")
    expect(page.locator(".more")).to_contain_text("48 of 100 shown")
    page.get_by_role("button", name="Show 48 more").click()
    expect(page.locator("a.card")).to_have_count(96)
    expect(page.locator("a.card").nth(48)).to_be_focused()
    page.get_by_role("button", name="Show 4 more").click()
    expect(page.locator("a.card")).to_have_count(100)
    expect(page.get_by_role("button", name=re.compile("more"))).to_have_count(0)


def _many(route):
    offset = int(urllib.parse.parse_qs(urllib.parse.urlsplit(route.request.url).query)["offset"][0])
    shapes = [
        {"id": f"none{at}", "name": f"shape {at}", "label": "", "ndim": 4}
        for at in range(offset, min(offset + 48, 100))
    ]
    route.fulfill(json={"total": 100, "shapes": shapes})


def test_failure_is_told_and_can_be_tried_again(tabs):
    """What the server refuses is told in its words; trying again works once it answers."""
    page = tabs.open("about:blank")
    refusal = {"status": 429, "headers": {"Retry-After": "2"}, "json": {"error": "The queue is full."}}
    page.route("**/api/shapes?*", lambda route: route.fulfill(**refusal))
    page.goto("")
    expect(page.locator(".notice")).to_contain_text("The queue is full. Try again in 2 s.")
    page.unroute("**/api/shapes?*")
    page.get_by_role("button", name="Try again").click()
    expect(page.locator(".count")).to_have_text("12 shapes")
    tabs.allowed = ("429",)


def test_address_that_leads_nowhere_is_told(tabs):
    """A shape that is not there is told on its page, which leads back."""
    page = tabs.open("shape/0123456789abcdef0123")
    expect(page.locator("main")).to_contain_text("no such shape")
    tabs.allowed = ("404",)
