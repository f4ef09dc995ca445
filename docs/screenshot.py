"""Take the picture of the explorer for the README, with Chromium: python docs/screenshot.py."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import spem
from spem.shapes.creatures import write_collection

FOLDER = Path(__file__).parent / "images"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = ("--no-sandbox", "--disable-background-networking", "--use-angle=swiftshader")
KINDS = ("dog", "elephant", "giraffe", "lizard", "octopus")
SIZE = {"width": 1280, "height": 1105}
START = 60.0


def main(folder: Path = FOLDER, *, voxels: int = 15_000, n_per_class: int = 3) -> None:
    """Serve an index of made solids, and take a picture of the page of one."""
    with tempfile.TemporaryDirectory() as made:
        root = Path(made)
        rng = np.random.default_rng(1)
        (meshes,) = write_collection(root, n_per_class=n_per_class, kinds=KINDS, rng=rng, images=False)
        index = spem.Index.open(root / "index")
        index.add(meshes, labels=meshes / "labels.csv", voxels=voxels)
        shown = index.rows("name = 'dog_01'")[0].id
        command = [sys.executable, "-m", "spem", "serve", str(root / "index"), "--port", "0"]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as server:
            try:
                address = "http" + next(server.stdout or iter(())).split("http", 1)[1].split()[0].rstrip("/")
                _wait(address)
                picture = _take(f"{address}/shape/{shown}?show=field&node=4000")
            finally:
                server.terminate()
    folder.mkdir(exist_ok=True)
    picture.save(folder / "explorer.png", optimize=True)


def _wait(address: str) -> None:
    """Wait until the server answers."""
    deadline = time.monotonic() + START
    while time.monotonic() < deadline:
        try:
            with urllib.request.urlopen(f"{address}/ready", timeout=5):  # noqa: S310
                return
        except OSError:
            time.sleep(0.2)
    msg = f"{address}: no answer in {START:g} s"
    raise TimeoutError(msg)


def _take(address: str) -> Image.Image:
    """Take the picture of a page, once all of it is drawn."""
    browser = next(filter(None, map(shutil.which, BROWSERS)))
    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=browser, args=list(ARGUMENTS))
        page = started.new_page(viewport=SIZE)
        page.goto(address)
        page.wait_for_load_state("networkidle", timeout=60_000)
        page.wait_for_timeout(2000)
        taken = page.screenshot()
        started.close()
    return Image.open(BytesIO(taken)).convert("RGB")


if __name__ == "__main__":
    main()
