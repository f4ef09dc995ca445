"""``spem serve``: an index over HTTP, and its explorer in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spem.cli.output import complain
from spem.errors import ParameterError

if TYPE_CHECKING:
    from spem.server.options import ServerOptions

_MIB = 1 << 20


def serve(
    db: Annotated[str, typer.Argument(metavar="DB", help="Folder or address of an index.")],
    host: Annotated[str, typer.Option(help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen at; 0 takes a free one.")
    ] = 8321,
    token_file: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File with the token for writing. [SPEM_TOKEN]")
    ] = None,
    new_token: Annotated[
        bool, typer.Option("--new-token", help="Make a token for writing, and print it.")
    ] = False,
    allow_host: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A name that the server may be called by.")
    ] = None,
    proxy: Annotated[
        list[str] | None,
        typer.Option(metavar="ADDRESS", help="A proxy whose X-Forwarded-For is believed."),
    ] = None,
    root_path: Annotated[str, typer.Option(metavar="PATH", help="Path that a proxy strips.")] = "",
    workers: Annotated[int, typer.Option(min=1, max=256, help="Processes for uploads and views.")] = 2,
    memory: Annotated[int, typer.Option(min=512, help="Memory of each of them, in MiB.")] = 4096,
    seconds: Annotated[float, typer.Option(min=1.0, help="Longest time of one task.")] = 120.0,
    upload: Annotated[int, typer.Option(min=1, help="Largest upload, in MiB.")] = 64,
    voxels: Annotated[int, typer.Option(min=1000, help="Most voxels of an uploaded shape.")] = 250_000,
    queue: Annotated[int, typer.Option(min=1, help="Number of jobs that may wait.")] = 16,
    rate: Annotated[float, typer.Option(min=0.0, help="Requests a second of one client; 0 for any.")] = 100.0,
    state: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of jobs that outlive the server.")
    ] = None,
    browser: Annotated[bool, typer.Option("--open", help="Open the explorer in a browser.")] = False,
) -> None:
    """Serve an index over HTTP, with its explorer.

    Only this machine can reach it, and nobody can write, unless told otherwise. Requests are logged on
    stderr, a line of JSON each. It stops on Ctrl-C or SIGTERM; running jobs finish or are put back.

    \b
    Examples:
      spem serve shapes.db --open
      SPEM_TOKEN=$(cat token) spem serve shapes.db --port 9000
      spem serve s3://bucket/shapes --host 0.0.0.0 --token-file token --allow-host shapes.example.org
    """  # noqa: D301
    from spem.index.extra import require

    for module in ("fastapi", "uvicorn", "prometheus_client", "python_multipart"):
        require(module, "server")
    from spem.index.index import Index
    from spem.server.options import ServerOptions
    from spem.server.running import listen, run
    from spem.server.spool import Spool

    options = ServerOptions(
        host=host,
        port=port,
        token=_token(token_file, new=new_token),
        hosts=tuple(allow_host or ()),
        proxies=tuple(proxy or ()),
        root_path=root_path,
        upload_bytes=upload * _MIB,
        voxels=voxels,
        seconds=seconds,
        memory=memory * _MIB,
        n_workers=workers,
        queue=queue,
        rate=rate,
        state=state,
    )
    index = Index.open(db, create=False)
    if state is not None:
        # told here in one line, and not while the server starts
        Spool(state).close()
    socket = listen(options)
    address = _address(options, socket.getsockname()[1])
    _warn(options)
    typer.echo(f"serving {db} at {address}")
    if browser:
        import webbrowser

        webbrowser.open(address)
    run(index, options, socket)


def _token(file: Path | None, *, new: bool) -> str | None:
    """Return the token for writing: of a file, of the environment, or a new one."""
    import os
    import secrets

    if new:
        token = secrets.token_urlsafe(24)
        typer.echo(f"token for writing: {token}")
        return token
    if file is None:
        return os.environ.get("SPEM_TOKEN") or None
    try:
        return file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{file}: the token cannot be read; give a text file with one line"
        raise ParameterError(msg) from error


def _address(options: ServerOptions, port: int) -> str:
    """Return the address for a browser on this machine."""
    host = options.host if options.loopback else "localhost"
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def _warn(options: ServerOptions) -> None:
    """Say when others can reach the server."""
    if not options.loopback:
        complain(f"{options.host}: everyone who reaches this machine can read and search the index")
        if options.token is None:
            complain("without a token nobody can write; --token-file sets one")
