"""``spem index optimize`` and ``spem index duplicates``."""

from __future__ import annotations

import re
from dataclasses import asdict
from datetime import timedelta
from typing import TYPE_CHECKING, Annotated

import typer

from spem.cli.index import Address, ModelName, Where, opened
from spem.cli.options import Json
from spem.cli.output import counted, print_json, print_table
from spem.errors import ParameterError

if TYPE_CHECKING:
    from spem.index.optimizing import Optimized

_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400}
_MEGABYTE = 1e6


def optimize(
    db: Address,
    approximate: Annotated[
        bool | None,
        typer.Option(
            "--approximate/--exact",
            help="Have an approximate index for search, or none. [one beyond 100000 shapes]",
        ),
    ] = None,
    older_than: Annotated[
        str | None,
        typer.Option(metavar="AGE", help="Delete versions older than this: 30s, 15m, 2h or 7d. [1h]"),
    ] = None,
    json: Json = False,
) -> None:
    """Put an index in order after many additions, and make search in a large one quick.

    Small files are joined and old versions deleted. The approximate index, if there is one, takes in what was
    added; its recall is measured against the comparison of all codes, and told.

    \b
    Examples:
      spem index optimize shapes.db
      spem index optimize shapes.db --approximate --older-than 7d
    """  # noqa: D301
    age = None if older_than is None else parse_age(older_than)
    done = opened(db).optimize(approximate=approximate, older_than=age)
    if json:
        print_json([asdict(one) for one in done])
        return
    header = ("model", "shapes", "MB", "search", "recall", "seconds")
    print_table(header, [_cells(one) for one in done], left=(0, 3))


def _cells(one: Optimized) -> tuple[str, ...]:
    """Return what is told of the codes of a model."""
    way = one.approximate
    search, recall = ("exact", "") if way is None else (way.kind, f"{way.recall:.3f}")
    size = f"{one.n_bytes / _MEGABYTE:.1f}"
    return one.model, str(one.n_rows), size, search, recall, f"{one.seconds:.1f}"


def parse_age(text: str) -> timedelta:
    """Return an age such as 15m as a length of time.

    Examples
    --------
    >>> parse_age("2h")
    datetime.timedelta(seconds=7200)
    """
    found = re.fullmatch(r"(\d{1,9})([smhd])", text.strip())
    if found is None:
        msg = f"--older-than {text}: expected a number and a unit, such as 30s, 15m, 2h or 7d"
        raise ParameterError(msg)
    return timedelta(seconds=int(found[1]) * _SECONDS[found[2]])


def duplicates(
    db: Address,
    distance: Annotated[
        float | None,
        typer.Option(help="Correlation distance under which shapes are near-duplicates. [0.05]"),
    ] = None,
    where: Where = None,
    model: ModelName = None,
    json: Json = False,
) -> None:
    """List groups of near-duplicates, and files that are there more than once byte by byte.

    Shapes are in a group when a chain of near ones joins them. The one that stands for a group comes first,
    the others with their distance to it.

    \b
    Examples:
      spem index duplicates shapes.db
      spem index duplicates shapes.db --distance 0.1 --json
    """  # noqa: D301
    from spem.index.duplicates import DISTANCE

    found = opened(db).duplicates(DISTANCE if distance is None else distance, where=where, model=model)
    if json:
        copies = [{"id": row.id, "paths": [row.path, *row.copies]} for row in found.copies]
        print_json(
            {
                "distance": found.distance,
                "method": found.method,
                "groups": found.to_dicts(),
                "copies": copies,
            }
        )
        return
    for place, group in enumerate(found, 1):
        typer.echo(f"group {place}: {counted(len(group.rows), 'shape')}, diameter {group.diameter:.4f}")
        cells = [
            (f"{apart:.4f}", row.name, row.id, row.path)
            for row, apart in zip(group.rows, group.distances, strict=True)
        ]
        print_table(("distance", "name", "id", "path"), cells, left=(1, 2, 3))
    for row in found.copies:
        typer.echo(f"copies: {', '.join((row.path, *row.copies))}")
    near = counted(len(found), "group")
    copied = counted(len(found.copies), "file")
    typer.echo(f"{near} within {found.distance:g}, {found.method}; {copied} with copies")


#: Commands of the group, under the names that they have there.
COMMANDS = {"optimize": optimize, "duplicates": duplicates}
