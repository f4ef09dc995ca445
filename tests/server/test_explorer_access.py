"""The explorer for everyone: axe's findings, phones, both themes, keys alone, and a strict policy."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
from playwright.sync_api import expect

GRAVE = ("serious", "critical")
# Two frames later all colours and places are the new ones.
SETTLED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


@pytest.fixture(scope="session")
def first(explored):
    """Return the id of a silhouette and of a solid."""
    from spem.index.index import Index

    index = Index.open(explored.index, create=False)
    return tuple(index.rows(limit=1, model=model)[0].id for model in (explored.flat, explored.solid))


def _pages(explored, first):
    flat, solid = first
    return {
        "gallery": ("", ".card img"),
        "nothing found": ("?q=nowhere", ".notice"),
        "map": ("map", "canvas[data-listed]"),
        "answers": (f"?like={flat}", ".answer"),
        "comparison": (f"?like={flat}&compare={flat}", "dialog canvas"),
        "silhouette": (f"shape/{flat}", "main canvas"),
        "parts": (f"shape/{flat}?show=parts", "main canvas"),
        "solid": (f"shape/{solid}?model={explored.solid}", "main canvas"),
    }


PAGES = ("gallery", "nothing found", "map", "answers", "comparison", "silhouette", "parts", "solid")


def _grave(axe, page, **options):
    """Return the serious and critical findings of axe on a page."""
    found = axe.Axe().run(page, options=options or None).response["violations"]
    return [
        f"{one['id']}: {one['help']}: {node['html'][:120]}"
        for one in found
        if one["impact"] in GRAVE
        for node in one["nodes"]
    ]


@pytest.mark.parametrize("name", PAGES)
def test_page_is_for_everyone(tabs, explored, first, name):
    """Axe finds nothing serious or critical, nor too little contrast in the dark; a phone is wide enough."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="no axe-playwright-python")
    path, ready = _pages(explored, first)[name]
    # axe is put into the page, which its policy would refuse.
    page = tabs.open(path, bypass_csp=True, reduced_motion="reduce")
    page.locator(ready).first.wait_for()
    assert _grave(axe, page) == []
    page.emulate_media(color_scheme="dark")
    expect(page.locator("html")).to_have_attribute("data-theme", "dark")
    page.evaluate(SETTLED)
    assert _grave(axe, page, runOnly=["color-contrast"]) == []
    page.set_viewport_size({"width": 360, "height": 740})
    page.evaluate(SETTLED)
    assert page.evaluate("document.documentElement.scrollWidth") <= 360


def test_axe_would_find_what_is_wrong(tabs):
    """A picture without words is found, so that nothing found means something."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="no axe-playwright-python")
    page = tabs.open("?q=nowhere", bypass_csp=True)
    page.locator(".notice").wait_for()
    page.evaluate("document.querySelector('main').append(new Image())")
    assert any("image-alt" in one for one in _grave(axe, page))


def test_theme_follows_the_system_until_one_is_chosen(tabs):
    """The page is dark where the system is; the button turns it light, and it stays so."""
    page = tabs.open(color_scheme="dark")
    ground = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(ground)
    assert max(map(int, re.findall(r"\d+", dark))) < 60
    page.get_by_role("button", name="Use the light theme").click()
    assert min(map(int, re.findall(r"\d+", page.evaluate(ground)))) > 200
    page.reload()
    assert min(map(int, re.findall(r"\d+", page.evaluate(ground)))) > 200
    expect(page.get_by_role("button", name="Use the dark theme")).to_be_visible()


def test_keys_alone_lead_to_the_content(tabs):
    """The first stop of the Tab key skips to the content; every stop after it can be seen."""
    page = tabs.open()
    page.locator(".card").first.wait_for()
    page.keyboard.press("Tab")
    expect(page.locator(".skip")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.locator("#main")).to_be_focused()
    for _ in range(5):
        page.keyboard.press("Tab")
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_pages_announce_themselves(tabs):
    """Going to a page puts the focus on its heading and says its title; the navigation tells where one is."""
    page = tabs.open()
    page.locator(".card").first.wait_for()
    page.get_by_role("link", name="Map", exact=True).click()
    expect(page.locator("h1")).to_be_focused()
    expect(page.locator("#announcer")).to_have_text("Map · spem")
    expect(page.get_by_role("link", name="Map", exact=True)).to_have_attribute("aria-current", "page")


def test_policy_lets_nothing_foreign_in(tabs):
    """Pages load from the server alone, and scripts in the page are refused."""
    page = tabs.open("about:blank")
    hosts: list[str] = []
    page.on("request", lambda request: hosts.append(request.url))
    answer = page.goto("")
    page.locator(".card").first.wait_for()
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self';" in policy
    assert {url.partition("/static")[0].partition("/api")[0] for url in hosts} <= {
        tabs.address.rstrip("/"),
        tabs.address,
    }
    page.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), {text: 'window.ran = 1'}))"
    )
    assert page.evaluate("window.ran") is None
    tabs.allowed = ("Content Security Policy",)


def test_page_that_was_left_changes_nothing(tabs):
    """What a page was waiting for is dropped when it is left: the title stays that of the one shown."""
    page = tabs.open()
    held = []
    page.route("**/api/shapes/*", lambda route: held.append(route))
    with page.expect_request("**/api/shapes/*"):
        page.locator("a.card").first.click()
    expect(page.locator(".page-shape")).to_be_attached()
    page.get_by_role("link", name="Map", exact=True).click()
    expect(page).to_have_title("Map · spem")
    with page.expect_response("**/api/shapes/*"):
        held[0].continue_()
    page.wait_for_timeout(200)
    expect(page).to_have_title("Map · spem")
    expect(page).to_have_url(tabs.address + "map")


def test_address_that_is_no_text_leads_nowhere(tabs):
    """A path whose escapes are no text is told to lead nowhere, as any other one."""
    page = tabs.open("shape/%E0%A4%A")
    expect(page.get_by_role("heading", name="No such page")).to_be_visible()
