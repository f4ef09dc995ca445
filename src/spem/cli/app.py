"""The commands, and what becomes of errors: one line on stderr and an exit status."""

from __future__ import annotations

import functools
import os
import re
import sys
import traceback
from collections.abc import Callable
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from spem import __version__
from spem.cli.demo import demo
from spem.cli.devices import devices
from spem.cli.encode import encode
from spem.cli.evaluate import evaluate
from spem.cli.fields import field
from spem.cli.index import COMMANDS, group
from spem.cli.index_add import add
from spem.cli.index_search import COMMANDS as INDEX_SEARCH
from spem.cli.info import info
from spem.cli.maps import maps
from spem.cli.output import complain
from spem.cli.paper import paper
from spem.cli.parts import parts
from spem.cli.search import search
from spem.cli.serve import serve
from spem.errors import SizeError, SpemError

DONE, PARTIAL, NOTHING, INTERRUPTED = 0, 1, 2, 130

# Typer brings its own click or uses that which is installed; the base is the same in either.
_WrongUsage: Any = typer.BadParameter.__bases__[0]


class _Commands(TyperGroup):
    """The commands; wrong usage is told on one line, as any other error."""

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> Any:
        """Run a command and exit with its status."""
        try:
            status = super().main(*args, **(extra | {"standalone_mode": False}))
        except _WrongUsage as error:
            status = NOTHING
            if type(error).__name__ == "NoArgsIsHelpError":
                error.show()
            else:
                complain(plain_usage(error.format_message()))
        except typer.Abort:
            status = INTERRUPTED
        return sys.exit(status or DONE) if standalone_mode else status


def plain_usage(message: str) -> str:
    """Return what the parser says of wrong usage on one line and in the words of spem.

    Examples
    --------
    >>> plain_usage("Invalid value for '--voxels': Input should be greater than or equal to 1")
    "Invalid value for '--voxels': expected greater than or equal to 1"
    """
    text = message.replace("Value error, ", "").replace("Input should be", "expected")
    return re.sub(r", unable to parse .*", "", " ".join(text.split())).rstrip(".")


app = typer.Typer(
    name="spem",
    cls=_Commands,
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
    """Screened Poisson hyperfields: fields, SPEM maps, parts, codes and search for shapes of any dimension.

    SHAPE is an image (PNG, GIF, JPEG, BMP, TIFF, WebP, PNM), a volume (NPY, NPZ, NIfTI, TIFF stack) or a mesh
    (OBJ, OFF, PLY, STL, GLB).

    \b
    Examples:
      spem demo                                   a collection, its codes, answers, scores and pictures
      spem info hand.png                          what was read, what was repaired
      spem field hand.png --rho 4 --rho 16 -o hand.npz --plot fields.png
      spem parts hand.png -o hand.npz --plot parts.png
      spem encode shapes/ -o shapes.spem          codes of a folder
      spem search shapes.spem query.obj           the most similar shapes
      spem index add shapes.db shapes/            a collection that is kept up to date
      spem serve shapes.db --open                 the explorer in the browser
      spem paper fig13 table1 -o out              figures and tables of the paper, made again

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
            _forget_interrupt()
            raise typer.Exit(INTERRUPTED) from None
        except SizeError as error:
            _refuse(
                f"{error}; a grid that was asked for is smaller with fewer --voxels or a larger --spacing"
            )
        except SpemError as error:
            _refuse(str(error))
        except MemoryError:
            _refuse("out of memory; use fewer voxels, or fewer workers (-j)")
        except Exception as error:  # noqa: BLE001
            _refuse(
                f"unexpected {type(error).__name__}: {error}; please report it (SPEM_DEBUG=1 tells where)"
            )

    return command


def _forget_interrupt() -> None:
    """Let the process end with a status of its own.

    CPython marks an interrupt that comes while text is executed, as dataclasses do at import, as unhandled,
    and would end the process by the signal; the next text that is executed takes the mark away.
    """
    exec("")  # noqa: S102


def _refuse(message: str) -> None:
    """Write a message on one line and exit; with SPEM_DEBUG=1 after the traceback."""
    if os.environ.get("SPEM_DEBUG") == "1":
        traceback.print_exc()
    complain(" ".join(message.split()))
    raise typer.Exit(NOTHING) from None


for _command in (info, field, maps, parts, encode, search, evaluate, demo, paper, serve, devices):
    app.command()(guarded(_command))
_of_group: dict[str, Any] = {"add": add, **COMMANDS, **INDEX_SEARCH}
for _name, _of_index in _of_group.items():
    group.command(_name)(guarded(_of_index))
app.add_typer(group)


def run() -> None:
    """Run the command line on the arguments of the process, and exit with its status."""
    app()
