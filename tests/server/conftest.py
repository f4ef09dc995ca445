"""A running server on a small made collection, and a browser to look at it; one of each for all tests."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_ARGUMENTS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
_PATIENCE = 60.0
_KINDS = ("dog", "hand", "fish")


@dataclass(frozen=True)
class Explored:
    """A server that runs.

    Parameters
    ----------
    address
        Where it answers, ending in a slash.
    flat, solid
        Digests of the models of silhouettes and of solids.
    folder
        Where the files are that the index was made of: ``images/*.png`` and ``meshes/*.obj``.
    index
        Folder of the index.
    """

    address: str
    flat: str
    solid: str
    folder: Path
    index: Path


@pytest.fixture(scope="session")
def explored(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Explored]:
    """Return a server on twelve silhouettes and three solids, each with a model of its own."""
    for package in ("lancedb", "fastapi", "uvicorn", "prometheus_client"):
        pytest.importorskip(package, reason=f"the server needs {package}: pip install 'spem[server]'")
    folder = tmp_path_factory.mktemp("explored")
    flat, solid = _collection(folder)
    with (folder / "log").open("w") as log:
        command = [sys.executable, "-m", "spem", "serve", str(folder / "index"), "--port", "0", "--rate", "0"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        try:
            yield Explored(_address(process, folder / "log"), flat, solid, folder, folder / "index")
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.communicate(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()


def _collection(folder: Path) -> tuple[str, str]:
    """Make files and an index of them; return the digests of its two models."""
    import spem
    from spem.index.index import Index
    from spem.shapes.creatures import write_collection

    rng = np.random.default_rng(3)
    (images,) = write_collection(folder, n_per_class=4, kinds=_KINDS, rng=rng, meshes=False)
    (meshes,) = write_collection(folder, n_per_class=1, kinds=_KINDS, rng=rng, images=False)
    index = Index.open(folder / "index")
    sizes: dict[str, Any] = {"features": "spem", "n_centers": 4}
    flat = index.add(images, labels=images / "labels.csv", voxels=1200, **sizes)
    solids = spem.encode(meshes, voxels=1500, **sizes).model
    return flat.model, index.add(meshes, model=solids, labels=meshes / "labels.csv").model


def _address(process: subprocess.Popen[str], log: Path) -> str:
    """Return where the server says that it answers, once it does."""
    assert process.stdout is not None
    line = process.stdout.readline()
    assert "http" in line, f"the server did not start: {line}{log.read_text()}"
    address = "http" + line.split("http", 1)[1].split()[0].rstrip("/") + "/"
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline:
        try:
            with urllib.request.urlopen(address + "ready", timeout=5):  # noqa: S310
                return address
        except OSError:
            time.sleep(0.1)
    raise AssertionError(log.read_text())


# Playwright keeps an event loop running in this thread: later modules need one of their own.
@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Return a Chromium that is started once in a module."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright: pip install playwright")
    found = os.environ.get("SPEM_BROWSER") or next(filter(None, map(shutil.which, _BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser: install one of {', '.join(_BROWSERS)}, or set SPEM_BROWSER to its path")
    playwright.expect.set_options(timeout=15_000)
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=found, args=list(_ARGUMENTS))
        yield started
        started.close()


@dataclass
class Tabs:
    """Opens pages, and keeps what they complain about.

    Parameters
    ----------
    browser
        The browser.
    address
        Where the server answers.
    complaints
        Errors of the console and of scripts, and answers of the server with a status of an error.
    allowed
        Parts of complaints that a test brings about on purpose.
    """

    browser: Any
    address: str
    complaints: list[str] = field(default_factory=list)
    allowed: tuple[str, ...] = ()
    _contexts: list[Any] = field(default_factory=list)

    def open(self, path: str = "", **options: Any) -> Any:
        """Open a page in a context of its own; options are Playwright's of contexts."""
        size = options.pop("viewport", {"width": 1200, "height": 850})
        context = self.browser.new_context(viewport=size, base_url=self.address, **options)
        context.set_default_timeout(20_000)
        self._contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: self._hear(message.type, message.text))
        page.on("pageerror", lambda error: self._hear("error", str(error)))
        page.on("response", lambda answer: self._hear_status(answer.status, answer.url))
        page.goto(path)
        return page

    def _hear(self, kind: str, text: str) -> None:
        if kind == "error":
            self.complaints.append(text)

    def _hear_status(self, status: int, url: str) -> None:
        if status >= 400:
            self.complaints.append(f"{status} {url}")

    def close(self) -> None:
        """Close what was opened."""
        for context in self._contexts:
            context.close()

    def unexpected(self) -> list[str]:
        """Return the complaints that no test asked for."""
        return [one for one in self.complaints if not any(part in one for part in self.allowed)]


@pytest.fixture
def tabs(browser: Any, explored: Explored) -> Iterator[Tabs]:
    """Return what opens pages; a test fails whose pages complain."""
    opened = Tabs(browser, explored.address)
    yield opened
    opened.close()
    assert opened.unexpected() == []


@pytest.fixture
def drop() -> Callable[[Any, Path], None]:
    """Return what drops a file on a page."""

    def dropped(page: Any, path: Path) -> None:
        script = """([name, bytes]) => {
            const data = new DataTransfer();
            data.items.add(new File([new Uint8Array(bytes)], name));
            return data;
        }"""
        data = page.evaluate_handle(script, [path.name, list(path.read_bytes())])
        page.dispatch_event("body", "dragenter", {"dataTransfer": data})
        page.wait_for_selector(".overlay.shown")
        page.dispatch_event("body", "drop", {"dataTransfer": data})

    return dropped
