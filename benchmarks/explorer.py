"""First page, drop to answers, slider and map of the explorer: ``python benchmarks/explorer.py``.

The collection is made of silhouettes of creatures. Times are wall-clock seconds as a reader has them, server
and browser on one machine, each page in a new window with nothing cached.
"""

from __future__ import annotations

import importlib.util
import os
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from _table import Benchmark, Row

FIRST_PAGE, SLIDER = 2.0, 0.1
SCRIPTS = ("theme", "app", "api", "dom", "router", "gallery", "cards", "upload")
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-quic")
PICTURES = "[...document.querySelectorAll('.grid img')].slice(0, 12).every((one) => one.complete)"
SETTLED = (
    "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
)
PAINT = """async () => {
  const canvas = document.querySelector('canvas.map-canvas');
  const times = [];
  for (let turn = 0; turn < 20; turn += 1) {
    const start = performance.now();
    canvas.dispatchEvent(new KeyboardEvent('keydown', {key: turn % 2 ? '+' : 'ArrowLeft'}));
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    times.push(performance.now() - start);
  }
  return times;
}"""


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("explorer", str(__doc__).splitlines()[0], argv)
    if importlib.util.find_spec("fastapi"):
        sent(benchmark)
    else:
        benchmark.skip("no server: pip install 'spem[server]'")
    found = os.environ.get("SPEM_BROWSER") or next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None or importlib.util.find_spec("playwright") is None:
        benchmark.skip("no browser: install chromium and playwright, or set SPEM_BROWSER to its path")
    else:
        with tempfile.TemporaryDirectory() as folder:
            browse(benchmark, Path(folder), found)
    benchmark.write()


def sent(benchmark: Benchmark) -> None:
    """Tell what the first page loads before its data."""
    from spem.server.pages import Assets

    assets = Assets.load()
    first = {
        "document": ("index.html",),
        "styles": tuple(name for name in assets.files if name.endswith(".css")),
        "scripts": (
            "theme.js",
            "app.js",
            "api.js",
            "dom.js",
            "router.js",
            "gallery.js",
            "cards.js",
            "upload.js",
        ),
    }
    rows: list[Row] = []
    for what, names in first.items():
        files = [assets.files[name] for name in names]
        zipped = sum(len(one.compressed or one.content) for one in files)
        rows.append({"what": what, "files": len(files), "kB": sum(len(one.content) for one in files) / 1e3})
        rows[-1]["kB sent"] = zipped / 1e3
    benchmark.table("what the first page loads", rows)


def browse(benchmark: Benchmark, folder: Path, path: str) -> None:
    """Walk through the explorer and note the times."""
    from playwright.sync_api import sync_playwright

    rounds = 2 if benchmark.quick else 7
    n_shapes = collection(folder, 2 if benchmark.quick else 20)
    benchmark.fact("shapes", n_shapes)
    with serving(folder / "index") as address, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        drops = folder / "images" / "dog_01.png"
        steps = {
            "first page, pictures too": lambda page: first_page(page),
            "drop to answers": lambda page: drop_to_answers(page, drops),
            "first look at a shape": lambda page: shape_page(page),
        }
        times: dict[str, list[float]] = {name: [] for name in steps}
        slides: list[float] = []
        for _ in range(rounds):
            for name, step in steps.items():
                context = browser.new_context(base_url=address, viewport={"width": 1280, "height": 900})
                page = context.new_page()
                times[name].append(step(page))
                if step is steps["first look at a shape"]:
                    slides.extend(slide(page))
                context.close()
        paints = map_of_many(browser, address)
        browser.close()
    times["slider to picture"] = slides
    times["a step of a map of 5,000"] = paints
    rows: list[Row] = [
        {"step": name, "times": len(one), "median": statistics.median(one), "worst": max(one)}
        for name, one in times.items()
    ]
    benchmark.table("seconds", rows)
    benchmark.target(
        "first page, median seconds", statistics.median(times["first page, pictures too"]), FIRST_PAGE
    )
    benchmark.target("slider to picture, median seconds", statistics.median(slides), SLIDER)


def collection(folder: Path, n_per_class: int) -> int:
    """Make silhouettes and an index of them; return their number."""
    from spem.index.index import Index
    from spem.shapes.creatures import write_collection

    kinds = ("dog", "hand", "fish")
    rng = np.random.default_rng(0)
    (images,) = write_collection(folder, n_per_class=n_per_class, kinds=kinds, rng=rng, meshes=False)
    index = Index.open(folder / "index")
    labels = images / "labels.csv"
    return index.add(images, labels=labels, features="spem", n_centers=4, voxels=4000).added


@contextmanager
def serving(index: Path) -> Iterator[str]:
    """Run a server on an index and yield its address."""
    command = [sys.executable, "-m", "spem", "serve", str(index), "--port", "0", "--rate", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        yield process.stdout.readline().split()[-1] if process.stdout else ""
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)


def first_page(page: Any) -> float:
    """Return the seconds until the gallery and the pictures in sight are there."""
    start = time.perf_counter()
    page.goto("")
    page.locator(".grid img").first.wait_for()
    while not page.evaluate(PICTURES):
        page.wait_for_timeout(5)
    return time.perf_counter() - start


def drop_to_answers(page: Any, file: Path) -> float:
    """Return the seconds from the drop of a file to its answers."""
    page.goto("")
    page.locator(".card img").first.wait_for()
    script = """([name, bytes]) => {
      const data = new DataTransfer();
      data.items.add(new File([new Uint8Array(bytes)], name));
      return data;
    }"""
    data = page.evaluate_handle(script, [file.name, list(file.read_bytes())])
    start = time.perf_counter()
    page.dispatch_event("body", "drop", {"dataTransfer": data})
    page.locator(".answer").first.wait_for()
    return time.perf_counter() - start


def shape_page(page: Any) -> float:
    """Return the seconds from a click on a card to the field of the shape; the server may know it by then."""
    page.goto("")
    page.locator("a.card").first.wait_for()
    start = time.perf_counter()
    page.locator("a.card").first.click()
    page.locator("main figure canvas").first.wait_for()
    return time.perf_counter() - start


def slide(page: Any) -> list[float]:
    """Return the seconds from moves of the slider to pictures, as the page measures them."""
    slider = page.locator("#shape-rho")
    slider.focus()
    figure = page.locator("figure[data-milliseconds]")
    times = []
    for _ in range(10):
        page.keyboard.press("ArrowRight")
        page.evaluate(SETTLED)
        times.append(float(figure.get_attribute("data-milliseconds")) / 1e3)
    return times


def map_of_many(browser: Any, address: str) -> list[float]:
    """Return the seconds of steps of a map of 5,000 points, which are made up."""
    chance = random.Random(0)  # noqa: S311
    points = [
        {"id": f"p{i}", "name": f"shape {i}", "label": f"l{i % 30}"}
        | {"x": chance.gauss(0, 1), "y": chance.gauss(0, 1)}
        for i in range(5000)
    ]
    context = browser.new_context(base_url=address, viewport={"width": 1280, "height": 900})
    page = context.new_page()
    body = {"method": "random", "points": points, "total": len(points)}
    page.route("**/api/map*", lambda route: route.fulfill(json=body))
    page.goto("map?pictures=off")
    page.locator("canvas[data-listed]").wait_for()
    times = [milliseconds / 1e3 for milliseconds in page.evaluate(PAINT)]
    context.close()
    return times


if __name__ == "__main__":
    main()
