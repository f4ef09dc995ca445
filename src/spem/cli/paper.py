"""``spem paper``: the figures, tables and claims of the paper, made again and judged."""

from __future__ import annotations

import signal
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spem.cli.options import Json
from spem.cli.output import check_folder, complain, counted, print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import FrameType

    from spem.paper.catalogue import Item
    from spem.paper.data import Data
    from spem.paper.runs import Record

REPORT = "index.html"


def paper(
    items: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ITEM]...", help="What to make, or all; without any, they are listed."),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of real shapes. [SPEM_DATA, or shapes made here]"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="A reduced size: seconds for each item.")] = False,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Where to.")] = Path(
        "spem-paper"
    ),
    again: Annotated[
        bool, typer.Option("--again", help="Make again what is there; otherwise it is kept.")
    ] = False,
    json: Json = False,
) -> None:
    """Reproduce the paper: every figure, table and claim, with a verdict on each statement.

    For each item a folder with pictures and the numbers as JSON, and for all of them one HTML report. A run
    that was interrupted goes on where it stopped.

    \b
    Examples:
      spem paper                                   what there is
      spem paper fig13 table1 --data shapes -o out
      spem paper all --quick -o out
    """  # noqa: D301
    from spem.paper.catalogue import ITEMS, choose
    from spem.paper.data import Data

    if not items:
        _list(ITEMS, json=json)
        return
    chosen = choose(items)
    folder = _data_folder(data)
    check_folder(output)
    shapes = Data(folder, quick)
    if folder is not None and not shapes.present:
        complain(f"{folder}: holds none of tari1000, shrec11, …; going on with shapes made here")
    try:
        records = _run(chosen, shapes, output, again=again, quiet=json)
    except KeyboardInterrupt:
        msg = f"interrupted; what is made is kept in {output}, and the same command goes on from there"
        raise KeyboardInterrupt(msg) from None
    _finish(records, shapes, output, json=json)


def _list(items: Sequence[Item], *, json: bool) -> None:
    """Print what there is."""
    rows = [(item.name, item.place, item.words[0].rstrip("."), ", ".join(item.needs)) for item in items]
    if json:
        print_json([dict(zip(("item", "section", "title", "data"), row, strict=True)) for row in rows])
        return
    print_table(("item", "section", "title", "data"), rows, (0, 1, 2, 3))


def _data_folder(data: Path | None) -> Path | None:
    """Return the folder of real shapes: the option, else SPEM_DATA where it is one, else none.

    Raises
    ------
    ParameterError
        If the option names no folder.
    """
    import os

    from spem.errors import ParameterError

    if data is not None:
        if not data.is_dir():
            msg = f"{data}: no such folder; give one that holds tari1000, shrec11, …, or leave --data out"
            raise ParameterError(msg)
        return data
    named = os.environ.get("SPEM_DATA")
    if named and not Path(named).is_dir():
        complain(f"SPEM_DATA: {named} is no folder; going on with shapes made here")
        return None
    return Path(named) if named else None


def _run(items: Sequence[Item], data: Data, output: Path, *, again: bool, quiet: bool) -> list[Record]:
    """Make the items; each tells what it found as soon as it is there."""
    from spem.cli.progress import Bar
    from spem.paper.runs import run

    bar, done = Bar(), 0

    def tell(item: Item, record: Record, kept: bool) -> None:
        nonlocal done
        done += 1
        bar.advance("items", done, len(items))
        if not quiet:
            _tell(item, record, kept)
        if interrupts:
            raise KeyboardInterrupt

    with bar, _interrupts() as interrupts:
        bar.advance("items", 0, len(items))
        return run(items, data, output, again=again, tell=tell)


def _tell(item: Item, record: Record, kept: bool) -> None:
    """Print what an item found, or why it could not be made."""
    if record.failure:
        typer.echo(f"{item.name}: could not be made: {record.failure}")
        return
    seconds = (record.made or {}).get("seconds", 0.0)
    typer.echo(f"{item.name}: {item.words[0].rstrip('.')} ({'kept' if kept else f'{seconds:.1f} s'})")
    for claim in record.claims:
        note = f"; {claim.note}" if claim.note else ""
        typer.echo(f"  {claim.verdict}: {claim.statement} paper: {claim.paper}; ours: {claim.ours}{note}")


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collect interrupts beside raising them: what is raised while an object is freed is lost."""
    came: list[int] = []
    usual = signal.getsignal(signal.SIGINT)
    if not callable(usual) or threading.current_thread() is not threading.main_thread():
        yield came
        return

    def handle(number: int, frame: FrameType | None) -> None:
        came.append(number)
        usual(number, frame)

    signal.signal(signal.SIGINT, handle)
    try:
        yield came
    finally:
        signal.signal(signal.SIGINT, usual)


def _finish(records: Sequence[Record], data: Data, output: Path, *, json: bool) -> None:
    """Write the report on all that is there, say where it is, and fail where something could not be made."""
    from dataclasses import asdict

    from spem.paper.catalogue import ITEMS
    from spem.paper.report import write_report
    from spem.paper.runs import load_all

    made = {record.item: record for record in load_all(ITEMS, output)} | {r.item: r for r in records}
    kept = [item for item in ITEMS if item.name in made]
    absent = sorted({name for item in kept for name in item.needs if data.find(name) is None})
    notes = [data.absent(name) for name in absent]
    report = write_report(output / REPORT, [made[item.name] for item in kept], notes)
    failed = [record for record in records if record.failure]
    if json:
        print_json([asdict(record) for record in records])
    else:
        typer.echo(f"report: {report}")
    if failed:
        complain(f"{counted(len(failed), 'item')} could not be made")
        raise typer.Exit(2 if len(failed) == len(records) else 1)
