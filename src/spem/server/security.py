"""Who may do what: the write token, names that the server answers to, requests of other sites, headers."""

from __future__ import annotations

import hmac
import ipaddress
import re
from collections.abc import Iterable, Mapping

from spem.server.refusals import Refusal

#: What any answer may load and do that is opened as a page: nothing.
CONTENT_POLICY = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
#: What the explorer's document may: its own scripts, styles and pictures, and asking this server.
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'self'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS: tuple[tuple[bytes, bytes], ...] = (
    (b"content-security-policy", CONTENT_POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"DENY"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"permissions-policy", b"camera=(), geolocation=(), microphone=()"),
)
# A name or an address, and perhaps a port.
_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[\w.-]+)(?::\d{0,5})?", re.ASCII)
_READING = ("GET", "HEAD", "OPTIONS")
_OWN = (b"same-origin", b"none")


def require_token(header: str | None, token: str | None) -> None:
    """Raise unless a request carries the token for writing; compared in constant time.

    Parameters
    ----------
    header
        The request's ``Authorization``.
    token
        The token of the server; None where nothing may be written.

    Raises
    ------
    Refusal
        403 where writing is off, 401 where the token is missing or wrong.

    Examples
    --------
    >>> require_token("Bearer 0123456789abcdef", "0123456789abcdef")
    """
    if token is None:
        raise Refusal(403, "this server only reads; start it with a token for writing")
    scheme, _, given = (header or "").partition(" ")
    right = hmac.compare_digest(given.strip().encode(), token.encode())
    if scheme.lower() != "bearer" or not right:
        raise Refusal(401, "a token is needed: Authorization: Bearer TOKEN", {"WWW-Authenticate": "Bearer"})


def host_allowed(host: bytes, names: Iterable[str]) -> bool:
    """Tell whether a ``Host`` header names this server.

    A page that had its own name rebound to this address still sends its name, so only names that are known
    pass; addresses always do, since a name cannot be rebound into one.

    Examples
    --------
    >>> host_allowed(b"127.0.0.1:8321", ()), host_allowed(b"evil.example", ("localhost",))
    (True, False)
    """
    name = host.decode("latin-1").lower()
    parts = _HOST.fullmatch(name)
    return parts is not None and (parts[1] in names or _is_address(parts[1].strip("[]")))


def _is_address(text: str) -> bool:
    """Tell whether a text is an address of IPv4 or IPv6."""
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True


def require_own_site(method: str, headers: Mapping[bytes, bytes]) -> None:
    """Raise when the page of another site sends what is more than reading.

    Browsers name the site that a request comes from; programs do not, and pass.

    Raises
    ------
    Refusal
        403 for other sites.
    """
    if method in _READING:
        return
    site, origin = headers.get(b"sec-fetch-site"), headers.get(b"origin")
    foreign = site not in _OWN if site is not None else False
    if origin is not None and origin.partition(b"://")[2] != headers.get(b"host"):
        foreign = True
    if foreign:
        raise Refusal(403, "requests of other sites are refused")
