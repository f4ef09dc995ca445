"""What a server is told when it starts: where it listens, what it allows, how much it takes on."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from spem.errors import ParameterError

LOOPBACK = ("127.0.0.1", "::1", "localhost")
_LEAST_TOKEN = 16
_LARGEST_PORT = 65535


@dataclass(frozen=True, kw_only=True)
class ServerOptions:
    """The settings of a server.

    Parameters
    ----------
    host, port
        Address to listen at; port 0 takes a free one.
    token
        Secret that writing asks for, of 16 characters or more; None switches writing off.
    hosts
        Further names that a browser may call the server by; addresses, ``localhost`` and `host` always may.
    proxies
        Addresses of proxies whose ``X-Forwarded-For`` is believed.
    root_path
        Path that a proxy strips, such as ``"/shapes"``.
    upload_bytes
        Largest file that is taken.
    voxels
        Largest number of voxels that an uploaded shape may have.
    seconds
        Longest time of one task on untrusted data; a task over it is killed.
    memory
        Largest memory of a process that reads untrusted data, in bytes.
    n_workers
        Number of these processes.
    queue
        Number of jobs, and of requests for views, that may wait; more are told to come again.
    rate
        Requests a second of one client, in the long run; 0 for any number. Four seconds' worth may come
        at once.
    view_bytes
        Memory for views that were computed before.
    finish_seconds
        How long running jobs may go on when the server stops; later they are queued for its next start.
    state
        Folder of jobs that outlive the server; a temporary one where it is None.

    Raises
    ------
    ParameterError
        When one of them is out of its range.

    Examples
    --------
    >>> ServerOptions(port=8000).loopback
    True
    """

    host: str = "127.0.0.1"
    port: int = 8321
    token: str | None = field(default=None, repr=False)
    hosts: tuple[str, ...] = ()
    proxies: tuple[str, ...] = ()
    root_path: str = ""
    upload_bytes: int = 64 << 20
    voxels: int = 250_000
    seconds: float = 120.0
    memory: int = 4 << 30
    n_workers: int = 2
    queue: int = 16
    rate: float = 100.0
    view_bytes: int = 256 << 20
    finish_seconds: float = 10.0
    state: Path | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port <= _LARGEST_PORT:
            msg = f"port={self.port}: expected 0 to {_LARGEST_PORT}"
            raise ParameterError(msg)
        if self.token is not None and not (self.token.isascii() and self.token.isprintable()):
            msg = "the token has characters that no header carries; expected ASCII on one line"
            raise ParameterError(msg)
        if self.token is not None and len(self.token) < _LEAST_TOKEN:
            msg = f"the token has {len(self.token)} characters; expected {_LEAST_TOKEN} or more"
            raise ParameterError(msg)
        if self.root_path and not self.root_path.startswith("/"):
            msg = f"root_path={self.root_path!r}: expected a path such as /shapes"
            raise ParameterError(msg)
        for name in ("upload_bytes", "voxels", "seconds", "memory", "n_workers", "queue"):
            if not getattr(self, name) > 0:
                msg = f"{name}={getattr(self, name)!r}: expected more than zero"
                raise ParameterError(msg)
        for name in ("rate", "view_bytes", "finish_seconds"):
            if not getattr(self, name) >= 0:
                msg = f"{name}={getattr(self, name)!r}: expected zero or more"
                raise ParameterError(msg)

    @property
    def loopback(self) -> bool:
        """Whether only this machine can reach the server."""
        return self.host in LOOPBACK or self.host.startswith("127.")
