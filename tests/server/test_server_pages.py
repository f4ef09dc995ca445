"""The explorer's document and files over HTTP: what is served, how it is cached, and what is not served."""

from __future__ import annotations

import asyncio
import re

import pytest

pytest.importorskip("fastapi", reason="the server needs fastapi: pip install 'spem[server]'")
from fastapi import FastAPI

from spem.server.pages import Assets, page_routes

httpx = pytest.importorskip("httpx", reason="no httpx: pip install httpx")
MARKUP = re.compile(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(")


@pytest.fixture(scope="module")
def assets():
    """Return the files of the explorer."""
    return Assets.load()


class Client:
    """Asks an app without a server."""

    def __init__(self, app):
        self.transport = httpx.ASGITransport(app)

    def get(self, path, headers=None):
        """Return the answer to one request."""

        async def asked():
            async with httpx.AsyncClient(transport=self.transport, base_url="http://localhost") as client:
                return await client.get(path, headers=headers)

        return asyncio.run(asked())


@pytest.fixture(scope="module")
def client(assets):
    """Return a client of an app that has the explorer's pages alone."""
    app = FastAPI()
    app.include_router(page_routes(assets))
    return Client(app)


@pytest.mark.parametrize("path", ["/", "/map", "/shape/0123456789abcdef0123"])
def test_every_page_is_the_same_document(client, path):
    """All pages are one document with a strict policy, asked for again each time but not sent again."""
    answer = client.get(path)
    assert answer.status_code == 200
    assert answer.text == client.get("/").text
    assert answer.headers["cache-control"] == "no-cache"
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert "unsafe" not in answer.headers["content-security-policy"]
    again = client.get(path, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_document_has_no_scripts_or_styles_of_its_own(client):
    """Scripts and styles come from files, as the policy asks, which are there and may be kept for ever."""
    text = client.get("/").text
    assert not re.search(r"<script(?![^>]*\bsrc=)", text)
    assert not re.search(r"\son\w+=|\sstyle=|<style", text)
    addresses = re.findall(r'(?:src|href)="(static/[^"]+)"', text)
    assert len(addresses) >= 8
    for address in addresses:
        answer = client.get("/" + address)
        assert answer.status_code == 200
        assert "immutable" in answer.headers["cache-control"]


def test_modules_import_files_that_are_there(assets):
    """Whatever a module imports is among the files, so that no page breaks when it is opened."""
    for name, asset in assets.files.items():
        if name.endswith(".js"):
            imports = re.findall(r'(?:from|import|import\()\s*"\./([\w.]+)"', asset.content.decode())
            assert {one for one in imports if assets.find(one) is None} == set(), name


def test_modules_make_no_markup_of_strings(assets):
    """No script writes markup or code that could hold what a name says."""
    for name, asset in assets.files.items():
        if name.endswith(".js"):
            assert not MARKUP.search(asset.content.decode()), name


def test_nothing_but_the_files_is_served(client):
    """Paths that lead elsewhere, the raw document and files of other kinds are not found."""
    for path in ("../pages.py", "%2e%2e/pages.py", "index.html", "pages.py", "__init__.py", "a/b/c", ""):
        assert client.get(f"/static/{path}").status_code == 404


def test_files_are_compressed_for_those_that_take_it(client, assets):
    """A script is sent under gzip where that is taken, and as it is elsewhere."""
    script = assets.files["shape_page.js"].content
    packed = client.get("/static/shape_page.js", headers={"Accept-Encoding": "gzip"})
    plain = client.get("/static/shape_page.js", headers={"Accept-Encoding": "identity"})
    assert packed.headers["content-encoding"] == "gzip"
    assert "content-encoding" not in plain.headers
    assert packed.content == plain.content == script
    assert len(assets.files["shape_page.js"].compressed) < len(script) / 2


def test_unversioned_addresses_are_asked_for_again(client):
    """An address without the version is not kept without asking."""
    assert client.get("/static/app.js").headers["cache-control"] == "no-cache"
    assert client.get("/static/0123/app.js").headers["cache-control"] == "no-cache"


def test_server_under_a_path(assets):
    """Behind a proxy that strips a path the addresses begin with it, and it cannot break out of them."""
    text = assets.document('/shapes"/').content.decode()
    assert '<base href="/shapes&quot;/">' in text
    assert '<base href="/">' in assets.document("").content.decode()
