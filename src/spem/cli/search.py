"""``spem search``: ranked answers to a query."""

from __future__ import annotations

from typing import Annotated

import typer

from spem.cli.options import CodesFile, Json
from spem.cli.output import print_json, print_table


def search(
    codes: CodesFile,
    query: Annotated[
        str, typer.Argument(metavar="QUERY", help="File of a shape, or the name of one among the codes.")
    ],
    k: Annotated[int, typer.Option("-k", min=1, help="Number of answers.")] = 10,
    json: Json = False,
) -> None:
    """Rank the shapes of a collection for a query.

    The nearest comes first. The query is coded with the settings and the vocabulary of the codes. One of
    the collection finds itself.

    \b
    Examples:
      spem search shapes.spem query.obj
      spem search shapes.spem cat_03 -k 5 --json
    """  # noqa: D301
    from spem.collections import search as find

    answers = find(codes, query, k)
    if json:
        print_json(
            [{"rank": a.rank, "name": a.name, "path": a.path, "distance": a.distance} for a in answers]
        )
        return
    rows = [(str(a.rank), f"{a.distance:.4f}", a.name, a.path) for a in answers]
    print_table(("rank", "distance", "name", "path"), rows, left=(2, 3))
