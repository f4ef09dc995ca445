"""The explorer's document and static files, with caching; the pages themselves are drawn in the browser."""

from __future__ import annotations

import gzip
import hashlib
import html
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from typing import Annotated

from fastapi import APIRouter, Header, Request, Response

from spem.server.security import PAGE_POLICY

_TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".html": "text/html; charset=utf-8",
}
_FOREVER = "public, max-age=31536000, immutable"
_ASK_AGAIN = "no-cache"
# Below this many bytes compression saves no packet.
_WORTH_COMPRESSING = 1024


@dataclass(frozen=True, eq=False)
class Asset:
    """A file that is served as it is.

    Parameters
    ----------
    content
        Its bytes.
    media_type
        What the browser takes it for.
    """

    content: bytes
    media_type: str

    @cached_property
    def etag(self) -> str:
        """Tag of this content, quoted."""
        return f'"{hashlib.sha256(self.content).hexdigest()[:20]}"'

    @cached_property
    def compressed(self) -> bytes | None:
        """The content under gzip, or None where that saves nothing."""
        return gzip.compress(self.content, 6, mtime=0) if len(self.content) > _WORTH_COMPRESSING else None

    def respond(self, caching: str, known: str, encodings: str) -> Response:
        """Return the answer to a request that knows these tags and takes these encodings."""
        headers = {"Cache-Control": caching, "ETag": self.etag, "Vary": "Accept-Encoding"}
        if self.etag in known:
            return Response(status_code=304, headers=headers)
        if "gzip" in encodings and self.compressed is not None:
            headers["Content-Encoding"] = "gzip"
            return Response(self.compressed, headers=headers, media_type=self.media_type)
        return Response(self.content, headers=headers, media_type=self.media_type)


@dataclass(frozen=True, eq=False)
class Assets:
    """The files of the explorer: those of the package, no other ones.

    Parameters
    ----------
    files
        Content by name, all that may be asked for.

    Examples
    --------
    >>> "index.html" in Assets.load().files
    True
    """

    files: dict[str, Asset]
    _documents: dict[str, Asset] = field(default_factory=dict, repr=False)

    @classmethod
    def load(cls) -> Assets:
        """Read the files of the package."""
        folder = resources.files("spem.server") / "static"
        found = {entry.name: entry for entry in folder.iterdir() if entry.is_file()}
        return cls(
            {
                name: Asset(found[name].read_bytes(), _TYPES[suffix])
                for name in sorted(found)
                if (suffix := "." + name.rpartition(".")[2]) in _TYPES
            }
        )

    @cached_property
    def version(self) -> str:
        """Digest of all files; part of their addresses, so that they may be kept for ever."""
        digest = hashlib.sha256()
        for name, asset in self.files.items():
            digest.update(name.encode() + asset.content)
        return digest.hexdigest()[:12]

    def find(self, name: str) -> Asset | None:
        """Return a file by its name, or None where there is none to serve."""
        return self.files.get(name)

    def document(self, root_path: str) -> Asset:
        """Return the one document of all pages, for a server under this path."""
        if root_path not in self._documents:
            text = self.files["index.html"].content.decode()
            base = html.escape(root_path.rstrip("/") + "/", quote=True)
            text = text.replace("{{base}}", base).replace("{{version}}", self.version)
            self._documents[root_path] = Asset(text.encode(), _TYPES[".html"])
        return self._documents[root_path]


def page_routes(assets: Assets | None = None) -> APIRouter:
    """Return the routes of the explorer: its pages, and the files that they load.

    Parameters
    ----------
    assets
        The files; read from the package where they are not given.
    """
    router = APIRouter(include_in_schema=False)
    served = assets or Assets.load()

    def page(
        request: Request,
        if_none_match: Annotated[str, Header()] = "",
        accept_encoding: Annotated[str, Header()] = "",
    ) -> Response:
        document = served.document(str(request.scope.get("root_path", "")))
        response = document.respond(_ASK_AGAIN, if_none_match, accept_encoding)
        response.headers["Content-Security-Policy"] = PAGE_POLICY
        return response

    for path in ("/", "/map", "/shape/{row_id}"):
        router.add_api_route(path, page, methods=["GET", "HEAD"])

    def static(
        name: str,
        version: str = "",
        if_none_match: Annotated[str, Header()] = "",
        accept_encoding: Annotated[str, Header()] = "",
    ) -> Response:
        asset = served.find(name)
        if asset is None or name == "index.html":
            return Response('{"error": "no such file"}', 404, media_type="application/json")
        caching = _FOREVER if version == served.version else _ASK_AGAIN
        return asset.respond(caching, if_none_match, accept_encoding)

    # Modules import each other by relative addresses, so that the version has to be in the path.
    for path in ("/static/{name}", "/static/{version}/{name}"):
        router.add_api_route(path, static, methods=["GET", "HEAD"])
    return router
