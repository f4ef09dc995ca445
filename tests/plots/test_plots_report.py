"""Thumbnails and the report of a collection."""

from __future__ import annotations

import re
from collections import Counter
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from spem.errors import LabelError, ParameterError, ShapeError
from spem.plots.report import write_report
from spem.plots.thumbnails import thumbnail
from spem.retrieval.evaluation import evaluate, precision_recall
from spem.shapes.shape import Shape

VOID = {"meta", "img", "br", "image", "use", "path", "polyline"}
EVIL = '<script>alert("1")</script>&.png'


class Page(HTMLParser):
    """What a page holds, and whether its elements are well nested."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.source = page.read_text(encoding="utf-8")
        self.open: list[str] = []
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(self.source)
        assert self.open == []

    def handle_starttag(self, tag, attrs) -> None:
        """Note an element and wait for its end."""
        self.tags[tag] += 1
        self.attributes.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs) -> None:
        """Note an element that ends itself."""
        self.tags[tag] += 1
        self.attributes.append((tag, dict(attrs)))

    def handle_endtag(self, tag) -> None:
        """Check that the innermost open element ends."""
        assert self.open.pop() == tag

    def handle_data(self, data) -> None:
        """Note words."""
        self.words.append(data)


@pytest.fixture
def collection() -> dict:
    """Return twelve shapes of three classes on a line, one of them with a name that attacks."""
    rng = np.random.default_rng(0)
    labels = [f"class {i // 4}" for i in range(12)]
    position = np.arange(12) + rng.normal(size=12)
    distances = np.abs(position[:, None] - position)
    names = [EVIL, *(f"shape {i}" for i in range(1, 12))]
    picture = thumbnail(Shape.from_mask(np.ones((5, 7))), 24)
    return {
        "title": "A <title>",
        "names": names,
        "labels": labels,
        "thumbnails": [picture] * 11 + [None],
        "map_pictures": [picture, None, picture],
        "scores": evaluate(distances, labels),
        "curve": precision_recall(distances, labels),
        "distances": distances,
        "settings": {"ρ": "8 values", "<b>": 1},
        "failures": [(EVIL, "the file is empty")],
    }


def test_page_is_whole_and_well_nested(tmp_path: Path, collection: dict) -> None:
    """A report parses, has a heading for each part, and captions on its tables."""
    page = Page(write_report(tmp_path / "r.html", **collection))
    assert page.tags["h1"] == 1
    assert page.tags["h2"] == 7
    assert page.tags["table"] == page.tags["caption"] == 3
    headline = "".join(page.words)
    assert "12 shapes in 3 classes" in headline
    for value in collection["scores"].mean().values():
        assert f"{value:.1f}" in headline


def test_nothing_is_fetched(tmp_path: Path, collection: dict) -> None:
    """A report names no address: pictures are data, and a policy forbids everything else."""
    page = Page(write_report(tmp_path / "r.html", **collection))
    assert not re.search(r"https?:|url\(|@import", page.source)
    for tag, attributes in page.attributes:
        for name in ("src", "href"):
            if name in attributes:
                assert attributes[name].startswith(("data:image/png;base64,", "#shape-")), tag
    assert "default-src 'none'" in page.source


def test_text_is_escaped(tmp_path: Path, collection: dict) -> None:
    """Names, titles, settings and reasons are text, never markup."""
    page = Page(write_report(tmp_path / "r.html", **collection))
    assert page.tags["script"] == 1
    assert page.tags["b"] == 0
    assert page.tags["title"] == 2  # the page's and the curve's
    assert "<script>alert" not in page.source


def test_every_picture_has_words(tmp_path: Path, collection: dict) -> None:
    """Images have alternative text, drawn ones a label, and answers say right or wrong in words."""
    page = Page(write_report(tmp_path / "r.html", **collection))
    for tag, attributes in page.attributes:
        if tag == "img":
            assert attributes["alt"]
        if attributes.get("role") == "img":
            assert attributes.get("aria-label") or attributes.get("aria-labelledby")
    said = Counter(a["aria-label"] for _, a in page.attributes if a.get("class") == "mark")
    assert set(said) <= {"same class", "another class"}
    assert said["same class"] > 0


def test_each_picture_is_embedded_once(tmp_path: Path, collection: dict) -> None:
    """A shape shown in several places is stored once, and every reference has its picture."""
    page = Page(write_report(tmp_path / "r.html", **collection))
    stored = {a["id"] for tag, a in page.attributes if tag == "image"}
    shown = {a["href"].removeprefix("#") for tag, a in page.attributes if tag == "use"}
    assert page.tags["image"] == len(stored) == 11
    assert shown == stored


def test_large_collections_stay_small(tmp_path: Path) -> None:
    """Of a thousand shapes only some two hundred are embedded."""
    n = 1000
    page = Page(
        write_report(
            tmp_path / "r.html",
            title="many",
            names=[f"s{i}" for i in range(n)],
            labels=[i % 50 for i in range(n)],
            thumbnails=[np.zeros((2, 2, 4), np.uint8)] * n,
        )
    )
    assert page.tags["image"] == 200
    assert "and 16 more" in page.source


def test_report_without_labels(tmp_path: Path) -> None:
    """Shapes of no known class still have a page; names that are not text are replaced."""
    page = Page(write_report(tmp_path / "r.html", title="t", names=["a\udcff"], thumbnails=[None]))
    assert "1 shape" in "".join(page.words)
    assert page.tags["h2"] == 1


def test_worst_and_best_queries(tmp_path: Path) -> None:
    """The query whose class comes last is listed first among the worst, its answers nearest first."""
    position = np.array([0.0, 1, 2, 10, 11, 12, 1.5])
    labels = ["a", "a", "a", "b", "b", "b", "b"]
    distances = np.abs(position[:, None] - position)
    page = write_report(
        tmp_path / "r.html",
        title="t",
        names=list("tuvwxyz"),
        labels=labels,
        thumbnails=[None] * 7,
        distances=distances,
    ).read_text(encoding="utf-8")
    first = page[page.index("Answered worst") :]
    order = re.findall(r"<figcaption>(?:<span[^>]*>.</span> )?(\w)</figcaption>", first)
    assert order[:4] == ["z", "u", "v", "t"]


def test_report_that_cannot_be_written_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page is replaced whole or not at all."""
    page = tmp_path / "r.html"
    page.write_text("old")
    monkeypatch.setattr("os.fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(ParameterError, match=r"r\.html: cannot be written \(No space left\)"):
        write_report(page, title="t", names=["a"], thumbnails=[None])
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_mismatched_numbers_are_refused(tmp_path: Path, collection: dict) -> None:
    """Labels, pictures and distances of other numbers than the names raise one clear line."""
    with pytest.raises(LabelError, match="12 shapes need 12 labels, not 3"):
        write_report(tmp_path / "r.html", **{**collection, "labels": ["a"] * 3})
    with pytest.raises(ParameterError, match="12 names need 12 thumbnails"):
        write_report(tmp_path / "r.html", **{**collection, "thumbnails": []})
    with pytest.raises(ParameterError, match=r"distances between 12 shapes are \(12, 12\)"):
        write_report(tmp_path / "r.html", **{**collection, "distances": np.ones((2, 2))})
    with pytest.raises(ParameterError, match="must be a PNG file"):
        write_report(tmp_path / "r.html", **{**collection, "thumbnails": [b"GIF8"] * 12})


@pytest.mark.parametrize("grid", [(9,), (6, 14), (5, 6, 9)])
def test_thumbnails_are_small_squares(grid: tuple[int, ...]) -> None:
    """A thumbnail is a square PNG, opaque in the middle and clear in the corner, and small."""
    png = thumbnail(Shape.from_mask(np.ones(grid)), 64)
    pixels = np.asarray(Image.open(BytesIO(png)))
    assert pixels.shape == (64, 64, 4)
    assert pixels[32, 32, 3] == 255
    assert pixels[0, 0, 3] == 0
    assert len(png) < 6000


def test_thumbnail_keeps_orientation() -> None:
    """The corner of an L stays at the bottom left."""
    shape = Shape.from_mask(np.kron([[1, 0, 0], [1, 0, 0], [1, 1, 1]], np.ones((6, 6))))
    opacity = np.asarray(Image.open(BytesIO(thumbnail(shape, 60))))[..., 3]
    assert opacity[45, 45] == opacity[15, 15] == 255
    assert opacity[15, 45] == 0


def test_thumbnail_of_four_dimensions_is_refused() -> None:
    """Shapes of more than three dimensions have no picture."""
    with pytest.raises(ShapeError, match="dimensions can be drawn"):
        thumbnail(Shape.from_mask(np.ones((2, 2, 2, 2))))


def test_classes_are_in_natural_order(tmp_path: Path) -> None:
    """Class 2 comes before class 10, in the table and in the gallery."""
    labels = ["10", "10", "2", "2", "1", "1"]
    distances = np.abs(np.subtract.outer(np.arange(6.0), np.arange(6.0)))
    page = write_report(
        tmp_path / "r.html",
        title="t",
        names=list("uvwxyz"),
        labels=labels,
        thumbnails=[None] * 6,
        map_pictures=[thumbnail(Shape.from_mask(np.ones((2, 2))), 8), None] * 3,
        scores=evaluate(distances, labels),
    ).read_text(encoding="utf-8")
    assert re.findall(r'<th scope="row">(\d+)</th>', page) == ["1", "2", "10"]
    assert re.findall(r"<summary>(\d+) ", page) == ["1", "2", "10"]
    assert re.findall(r"<figcaption>class (\d+)<br>", page) == ["1", "2", "10"]


def test_perfect_answers_show_nothing_wrong(tmp_path: Path) -> None:
    """Where every class comes first, no query is worst, no answer wrong, and E at its largest."""
    labels = ["a"] * 3 + ["b"] * 4
    position = np.array([0.0, 1, 2, 50, 51, 52, 53])
    distances = np.abs(position[:, None] - position)
    page = write_report(
        tmp_path / "r.html",
        title="t",
        names=list("tuvwxyz"),
        labels=labels,
        thumbnails=[None] * 7,
        scores=evaluate(distances, labels),
        distances=distances,
    ).read_text(encoding="utf-8")
    assert "Answered worst" not in page
    assert "Every query was answered perfectly" in page
    assert 'class="wrong"' not in page
    [e] = re.findall(r'([\d.]+)<small> %</small><small class="most">of ([\d.]+) %', page)
    assert e[0] == e[1]


def test_answers_shown_are_few(tmp_path: Path) -> None:
    """An imperfect query shows two answers more than its class has others, and is not called 100 %."""
    labels = ["a"] * 2 + ["b"] * 6
    position = np.array([0.0, 5, 4, 10, 11, 12, 13, 14])
    distances = np.abs(position[:, None] - position)
    page = write_report(
        tmp_path / "r.html",
        title="t",
        names=list("stuvwxyz"),
        labels=labels,
        thumbnails=[None] * 8,
        distances=distances,
    ).read_text(encoding="utf-8")
    worst = page[page.index("Answered worst") : page.index("Answered best")]
    for query in worst.split('<div class="query">')[1:]:
        others = 1 if "class a" in query else 5
        assert query.count("<li") == min(others + 2, 7)
        assert "<small>100 %" not in query
