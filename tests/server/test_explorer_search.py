"""Search in a browser: a dropped file, similar shapes, comparison, addresses and files to keep."""

from __future__ import annotations

import csv
import re
import urllib.parse
from pathlib import Path

import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
from playwright.sync_api import expect


def test_dropped_file_finds_itself_first(tabs, explored, drop):
    """A file that is dropped on the page is sent, searched for, and its own shape comes first."""
    page = tabs.open("map")
    drop(page, explored.folder / "images" / "hand_02.png")
    answers = page.locator(".answer")
    answers.first.wait_for()
    expect(page.get_by_role("heading", level=1)).to_have_text("hand_02")
    expect(answers).to_have_count(12)
    expect(answers.first).to_contain_text("hand_02")
    assert float(answers.first.locator(".distance").inner_text().split()[-1]) < 1e-3
    assert [name[:4] for name in page.locator(".answer .name").all_inner_texts()[:3]] == ["hand"] * 3
    assert "job" in urllib.parse.parse_qs(urllib.parse.urlsplit(page.url).query)
    expect(page.locator(".overlay")).not_to_be_visible()
    shared = tabs.open(page.url)
    expect(shared.locator(".answer")).to_have_count(12)
    expect(shared.get_by_role("heading", level=1)).to_have_text("hand_02")


def test_overlay_says_what_is_taken(tabs):
    """While a file hovers over the page, kinds and limits are told; the Escape key takes that away."""
    page = tabs.open()
    data = page.evaluate_handle(
        "() => { const d = new DataTransfer(); d.items.add(new File(['x'], 'a.png')); return d; }"
    )
    page.dispatch_event("body", "dragenter", {"dataTransfer": data})
    expect(page.locator(".overlay.shown")).to_contain_text(".obj")
    expect(page.locator(".overlay.shown")).to_contain_text("up to 67 MB")
    page.keyboard.press("Escape")
    expect(page.locator(".overlay")).not_to_be_visible()


def test_solid_is_searched_for_with_the_model_of_solids(tabs, explored):
    """A mesh that is chosen while silhouettes are looked at is searched for among the solids."""
    page = tabs.open()
    page.locator("#file").set_input_files(explored.folder / "meshes" / "fish_01.obj")
    page.locator(".answer").first.wait_for()
    expect(page.locator(".answer")).to_have_count(3)
    expect(page.locator(".answer").first).to_contain_text("fish_01")
    expect(page.get_by_label("Model")).to_have_value(explored.solid)


def test_file_that_cannot_be_taken_is_told(tabs, tmp_path):
    """A kind that is not read is refused before it is sent; a damaged file is told as the server tells it."""
    page = tabs.open()
    text = tmp_path / "notes.docx"
    text.write_text("words")
    page.locator("#file").set_input_files(text)
    expect(page.locator(".panel.failed")).to_contain_text("notes.docx is of no kind that is read here")
    damaged = tmp_path / "torn.png"
    damaged.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    page.locator("#file").set_input_files(damaged)
    expect(page.locator("main, .panel.failed").filter(has_text="torn.png")).to_be_visible()
    expect(page.locator("body")).not_to_contain_text("Traceback")
    tabs.allowed = ("422", "415", "400")


def test_job_that_is_not_kept_is_told(tabs):
    """An address of answers that are gone says so, and leads back."""
    page = tabs.open("?job=0123456789abcdef01234567")
    expect(page.get_by_role("heading", name="These answers are no longer kept")).to_be_visible()
    page.get_by_role("link", name="See all shapes").click()
    expect(page.locator(".count")).to_have_text("12 shapes")
    tabs.allowed = ("404",)


def test_progress_is_told_and_can_be_cancelled(tabs):
    """Place in the queue, stage and share of a job are shown as they come, and it can be cancelled."""
    page = tabs.open("about:blank")
    states = [
        {"state": "queued", "position": 3, "progress": 0},
        {"state": "running", "stage": "fields", "position": 0, "progress": 0.4},
    ]
    asked: list[str] = []

    def answer(route):
        asked.append(route.request.method)
        if "DELETE" in asked:
            job = {"state": "cancelled", "progress": 0.4}
        else:
            job = states[min(len(asked) // 4, 1)]
        route.fulfill(json={"id": "a", "kind": "search", "error": None, "result": None, **job})

    page.route("**/api/jobs/*", answer)
    page.goto("?job=a")
    expect(page.locator(".stage")).to_have_text("Waiting: 2 before this one")
    expect(page.locator(".stage")).to_have_text("Fields")
    expect(page.get_by_role("progressbar")).to_have_attribute("value", "0.4")
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_role("heading", name="The search was cancelled")).to_be_visible()
    assert "DELETE" in asked


def test_similar_shapes_are_compared_side_by_side(tabs, explored):
    """Of a shape of the collection the others are ranked; one is compared in a dialog that has an address."""
    page = tabs.open("?q=dog_01")
    link = page.locator("a.card").first.get_attribute("href")
    key = link.rsplit("/", 1)[-1].partition("?")[0]
    page.goto(f"?like={key}&k=12")
    expect(page.locator(".answer")).to_have_count(11)
    expect(page.locator(".answer").first).not_to_contain_text("dog_01")
    page.get_by_label("Label").select_option("dog")
    expect(page.locator(".answer")).to_have_count(3)
    page.get_by_role("button", name=re.compile("Compare with dog")).first.click()
    dialog = page.get_by_role("dialog")
    expect(dialog.get_by_role("heading", level=2)).to_contain_text("dog_01 beside dog_")
    expect(dialog.locator("canvas").first).to_be_visible()
    again = tabs.open(page.url)
    expect(again.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    expect(page).not_to_have_url(re.compile("compare"))


def test_back_from_a_file_leads_to_the_answers_of_the_shape_before(tabs, explored, drop):
    """Answers are those of the address, also where a file was searched for in between."""
    page = tabs.open("?q=dog_01")
    key = page.locator("a.card").first.get_attribute("href").rsplit("/", 1)[-1].partition("?")[0]
    page.goto(f"?like={key}")
    expect(page.get_by_role("heading", level=1)).to_have_text("dog_01")
    drop(page, explored.folder / "images" / "hand_02.png")
    expect(page.get_by_role("heading", level=1)).to_have_text("hand_02")
    page.go_back()
    expect(page.get_by_role("heading", level=1)).to_have_text("dog_01")
    expect(page.locator(".answer")).to_have_count(11)


def test_late_answers_do_not_take_the_place_of_new_ones(tabs):
    """Of two filters chosen in a row the second one stays, even where the answer to the first comes later."""
    page = tabs.open("?q=dog_01")
    key = page.locator("a.card").first.get_attribute("href").rsplit("/", 1)[-1].partition("?")[0]
    page.goto(f"?like={key}")
    expect(page.locator(".answer")).to_have_count(11)
    late = []
    page.route("**/neighbours?*label=hand*", lambda route: late.append(route))
    page.get_by_label("Label").select_option("hand")
    page.get_by_label("Label").select_option("fish")
    expect(page.locator(".answer")).to_have_count(4)
    assert len(late) == 1
    late[0].continue_()
    page.wait_for_timeout(300)
    assert {name[:4] for name in page.locator(".answer .name").all_inner_texts()} == {"fish"}


def test_answers_are_kept_as_csv(tabs, tmp_path):
    """The table of answers has what is shown, and opens nothing as a formula."""
    page = tabs.open("about:blank")
    shape = {
        "id": "a",
        "name": "=1+1",
        "label": 'x,"y"',
        "ndim": 2,
        "n_nodes": 5,
        "volume": 2.5,
        "file": "a.png",
    }
    found = {"query": {**shape, "name": "q"}, "method": "exact", "seconds": 0.001}
    answers = [{"rank": 1, "distance": 0.25, "shape": {**shape, "id": "b", "file": "a.png"}}]
    page.route("**/neighbours?*", lambda route: route.fulfill(json={**found, "answers": answers}))
    page.goto("?like=a")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Download CSV").click()
    path = Path(tmp_path, waiting.value.suggested_filename)
    waiting.value.save_as(path)
    assert path.name == "nearest-q.csv"
    (row,) = csv.DictReader(path.read_text(encoding="utf-8").splitlines())
    assert row["name"] == "'=1+1"
    assert row["label"] == 'x,"y"'
    assert (float(row["distance"]), row["rank"], row["file"]) == (0.25, "1", "a.png")
    tabs.allowed = ("404",)
