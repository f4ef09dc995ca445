"""The commands, and what becomes of errors: one line on stderr and an exit status."""

from __future__ import annotations

import functools
import os
import sys
import traceback
from collections.abc import Callable
from typing import Annotated, Any

import typer

from spem import __version__
from spem.cli.demo import demo
from spem.cli.encode import encode
from spem.cli.fields import field, maps
from spem.cli.info import info
from spem.cli.output import complain
from spem.cli.search import evaluate, search
from spem.errors import SpemError

DONE, PARTIAL, NOTHING, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    name="spem",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)


def _print_version(wanted: bool) -> None:
    """Print the version, and do nothing else."""
    if wanted:
        typer.echo(f"spem {__version__}")
        raise typer.Exit


@app.callback()
def _spem(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    """Screened Poisson hyperfields: fields, SPEM maps, codes and search for shapes of any dimension.

    SHAPE is an image (PNG, GIF, JPEG, BMP, TIFF, WebP, PNM), a volume (NPY, NPZ, NIfTI, TIFF stack) or a mesh
    (OBJ, OFF, PLY, STL, GLB).

    \b
    Examples:
      spem demo                                   a collection, its codes, answers, scores and pictures
      spem info hand.png                          what was read, what was repaired
      spem field hand.png --rho 4 --rho 16 -o hand.npz --plot hand.png
      spem encode shapes/ -o shapes.spem          codes of a folder
      spem search shapes.spem query.obj           the most similar shapes

    Exit status: 0 all done; 1 some shapes failed, the others are saved; 2 wrong usage, or nothing could be
    done; 130 interrupted.
    """  # noqa: D301


def guarded(function: Callable[..., None]) -> Callable[..., None]:
    """Turn whatever a command raises into one line on stderr and an exit status.

    Parameters
    ----------
    function
        A command.

    Examples
    --------
    >>> guarded(lambda: typer.echo("done"))()
    done
    """

    @functools.wraps(function)
    def command(*args: Any, **options: Any) -> None:
        try:
            function(*args, **options)
            sys.stdout.flush()
        except typer.Exit:
            raise
        except BrokenPipeError:
            # The reader has gone; nothing may be written to the pipe again, not even at exit.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(DONE) from None
        except KeyboardInterrupt as stop:
            complain(str(stop) or "interrupted")
            raise typer.Exit(INTERRUPTED) from None
        except SpemError as error:
            _refuse(str(error))
        except MemoryError:
            _refuse("out of memory; use fewer voxels, or fewer workers (-j)")
        except Exception as error:  # noqa: BLE001
            _refuse(
                f"unexpected {type(error).__name__}: {error}; please report it (SPEM_DEBUG=1 tells where)"
            )

    return command


def _refuse(message: str) -> None:
    """Write a message on one line and exit; with SPEM_DEBUG=1 after the traceback."""
    if os.environ.get("SPEM_DEBUG") == "1":
        traceback.print_exc()
    complain(" ".join(message.split()))
    raise typer.Exit(NOTHING) from None


for _command in (info, field, maps, encode, search, evaluate, demo):
    app.command()(guarded(_command))


def run() -> None:
    """Run the command line on the arguments of the process, and exit with its status."""
    app()
