"""The token, names that rebound pages cannot use, other sites, and messages without folders."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("starlette")

from spem.errors import ParameterError
from spem.server.options import ServerOptions
from spem.server.refusals import Refusal, plain
from spem.server.security import host_allowed, require_own_site, require_token

TOKEN = "0123456789abcdef"  # noqa: S105


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=40))
def test_no_other_token_passes(given_):
    """Only the token itself opens; any other text is refused, of whatever letters."""
    header = f"Bearer {given_}"
    if given_.strip() == TOKEN:
        require_token(header, TOKEN)
    else:
        with pytest.raises(Refusal, match="token is needed"):
            require_token(header, TOKEN)


def test_without_a_token_nobody_writes():
    """A server without a token refuses whatever comes, even nothing."""
    for header in (None, "Bearer ", "Bearer None"):
        with pytest.raises(Refusal, match="only reads"):
            require_token(header, None)


@pytest.mark.parametrize(
    ("host", "allowed"),
    [
        (b"localhost", True),
        (b"localhost:8321", True),
        (b"LOCALHOST", True),
        (b"shapes.example", True),
        (b"10.0.0.7:80", True),
        (b"[::1]:8321", True),
        (b"localhost.evil.example", False),
        (b"127.0.0.1.evil.example", False),
        (b"127.0.0.1@evil.example", False),
        (b"[::1].evil.example", False),
        (b"[evil]", False),
        (b"a:b:c", False),
        (b"", False),
    ],
)
def test_only_known_names_and_addresses(host, allowed):
    """A name passes when it is known; an address always does, since no name can be rebound into one."""
    assert host_allowed(host, {"localhost", "shapes.example"}) is allowed


def test_pages_of_this_server_may_send():
    """The explorer and programs may send; pages of other sites may not."""
    own = {b"host": b"localhost:1", b"origin": b"http://localhost:1", b"sec-fetch-site": b"same-origin"}
    require_own_site("POST", own)
    require_own_site("POST", {b"host": b"localhost:1"})
    require_own_site("GET", {b"origin": b"http://evil"})
    for change in ({b"origin": b"http://localhost:2"}, {b"sec-fetch-site": b"same-site"}):
        with pytest.raises(Refusal, match="other sites"):
            require_own_site("DELETE", own | change)


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ("/srv/a b/cat.obj: no faces", None),
        ("/home/me/cat.obj: no faces", "cat.obj: no faces"),
        ("cannot read '/home/me/cat.obj'", "cannot read 'cat.obj'"),
        (r"C:\Users\me\cat.obj: no faces", "cat.obj: no faces"),
        ("s of 3/4 and 1 / 2", "s of 3/4 and 1 / 2"),
        ("a\nb", "a b"),
    ],
)
def test_messages_lose_their_folders(message, told):
    """Of a path only its last name is told."""
    assert plain(message) == told if told is not None else "/srv" not in plain(message)


@pytest.mark.parametrize("token", ["geheim-schlüssel-für-alle", "a-token-with-a-line\nend-in-it", "short"])
def test_tokens_that_no_request_can_carry_are_refused(token):
    """A token that could never match is refused before the server starts."""
    with pytest.raises(ParameterError, match="the token has"):
        ServerOptions(token=token)
