"""The process of a server: its socket, its signals, its end."""

from __future__ import annotations

import signal
import socket
import sys

from threadpoolctl import threadpool_limits

from spem.errors import ParameterError
from spem.index.index import Index
from spem.server.app import create_app
from spem.server.logs import configure
from spem.server.options import ServerOptions

_KEEP_ALIVE = 30
_CONNECTIONS = 1024
_BACKLOG = 512


def listen(options: ServerOptions) -> socket.socket:
    """Open the socket that a server listens at.

    Raises
    ------
    ParameterError
        When the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    # With the protocol named, asyncio sends small answers at once instead of waiting for an acknowledgement.
    opened = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        if sys.platform != "win32":
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((options.host, options.port))
        opened.listen(_BACKLOG)
    except OSError as error:
        opened.close()
        reason = error.strerror or str(error)
        msg = (
            f"{options.host} port {options.port}: {reason.lower()}; give another --port, or 0 for a free one"
        )
        raise ParameterError(msg) from error
    return opened


def run(index: Index, options: ServerOptions, opened: socket.socket) -> None:
    """Serve an index until SIGTERM or SIGINT.

    The server then takes no more requests, finishes those it has, finishes its jobs or puts them back into
    the queue, and ends its worker processes.
    """
    import uvicorn

    config = uvicorn.Config(
        create_app(index, options),
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws="none",
        limit_concurrency=_CONNECTIONS,
        timeout_keep_alive=_KEEP_ALIVE,
        timeout_graceful_shutdown=max(1, round(options.finish_seconds)),
    )
    configure()
    server = uvicorn.Server(config)

    def stop(*_: object) -> None:
        server.should_exit = True

    # The server gives signals back when it has stopped, which would end the process by them and not with 0.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    # Products of search are small; threads of their own would only get in the way of those of requests.
    with opened, threadpool_limits(1):
        server.run(sockets=[opened])
