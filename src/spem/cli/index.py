"""``spem index``: what an index holds, its labels, and whether it is whole."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.options import Json
from spem.cli.output import check_target, complain, counted, print_json, print_table
from spem.errors import ParameterError

if TYPE_CHECKING:
    from spem.index.index import Index
    from spem.index.row import Row

# `spem index check` found something.
_NOT_WHOLE = 1
_SHOWN = 1000

Address = Annotated[
    str,
    typer.Argument(metavar="DB", help="Folder of the index, or its address such as s3://bucket/shapes."),
]
Where = Annotated[
    str | None,
    typer.Option(metavar="SQL", help="Only rows such as \"label = 'cat' AND metadata.site = 'Oslo'\"."),
]
ModelName = Annotated[
    str | None, typer.Option("--model", metavar="DIGEST", help="The model, where the index has several.")
]

group = typer.Typer(
    name="index",
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Keep a collection of shapes in an index: add, list, label, check, export.",
)


def opened(address: str) -> Index:
    """Open an index that is there."""
    from spem.index.index import Index

    return Index.open(address, create=False)


def list_rows(
    db: Address,
    where: Where = None,
    sort: Annotated[str, typer.Option(help="Column that orders the rows.")] = "name",
    descending: Annotated[bool, typer.Option("--descending", help="Largest, or last, first.")] = False,
    limit: Annotated[int, typer.Option(min=0, help="Rows to tell; 0 is all.")] = _SHOWN,
    models: Annotated[bool, typer.Option("--models", help="List the models instead.")] = False,
    model: ModelName = None,
    json: Json = False,
) -> None:
    """List the shapes of an index, or its models.

    Filters are SQL over the columns id, hash, name, path, label, ndim, n_nodes, volume and added;
    metadata.KEY is the value of a key.

    \b
    Examples:
      spem index list shapes.db
      spem index list shapes.db --where "label = 'cat'" --sort volume
      spem index list shapes.db --models
    """  # noqa: D301
    index = opened(db)
    if models:
        _list_models(index, json=json)
        return
    rows = index.rows(where, sort=sort, descending=descending, limit=limit or None, model=model)
    if json:
        print_json([record(row) for row in rows])
        return
    cells = [(row.name, row.label, str(row.n_nodes), f"{row.volume:.6g}", row.id, row.path) for row in rows]
    print_table(("name", "label", "nodes", "volume", "id", "path"), cells, left=(0, 1, 4, 5))
    total = index.count(where, model=model)
    if total > len(rows):
        complain(f"{len(rows)} of {counted(total, 'shape')}; --limit 0 lists all")


def _list_models(index: Index, *, json: bool) -> None:
    """Print the models of an index."""
    from dataclasses import asdict

    known = index.models()
    if json:
        print_json([asdict(one) for one in known])
        return
    cells = [(m.digest, m.features, str(m.ndim or ""), str(m.n_code), str(m.n_shapes)) for m in known]
    print_table(("model", "features", "ndim", "code", "shapes"), cells, left=(0, 1))


def record(row: Row) -> dict[str, Any]:
    """Return what is told of a row, as plain values."""
    names = ("id", "name", "path", "label", "ndim", "n_nodes", "volume", "hash")
    facts = {name: getattr(row, name) for name in names}
    added = row.added.isoformat()
    return facts | {"copies": list(row.copies), "metadata": dict(row.metadata), "added": added}


def remove(
    db: Address,
    shapes: Annotated[list[str] | None, typer.Argument(metavar="[ID|PATH]...", help="Ids or paths.")] = None,
    where: Where = None,
    all_rows: Annotated[
        bool, typer.Option("--all", help="All shapes, and the model with them; name it with --model.")
    ] = False,
    model: ModelName = None,
) -> None:
    """Remove shapes from an index; their files stay.

    \b
    Examples:
      spem index remove shapes.db 9f86d081884c7d659a2f
      spem index remove shapes.db shapes/old.obj
      spem index remove shapes.db --where "label = 'draft'"
      spem index remove shapes.db --model 1f0b9c4d2e7a --all
    """  # noqa: D301
    index = opened(db)
    if bool(shapes) + (where is not None) + all_rows != 1 or (all_rows and model is None):
        msg = "give the ids or paths of shapes, or --where, or --model with --all, and one of these alone"
        raise ParameterError(msg)
    if all_rows and model is not None:
        removed = index.drop(model)
    elif where is not None:
        removed = index.remove(where=where, model=model)
    else:
        removed = index.remove(index.find(shapes or [], model=model), model=model)
    typer.echo(f"removed {counted(removed, 'shape')}")


def label(
    db: Address,
    labels: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE]", help="Lines 'file,label', or a Princeton classification (.cla)."),
    ] = None,
    where: Where = None,
    name: Annotated[str | None, typer.Option("--as", metavar="LABEL", help="Label of all rows.")] = None,
    meta: Annotated[
        list[str] | None, typer.Option("--meta", metavar="KEY=VALUE", help="Metadata; KEY= takes it away.")
    ] = None,
    model: ModelName = None,
) -> None:
    """Label shapes by a file, or give those that a filter lets through a label and metadata.

    \b
    Examples:
      spem index label shapes.db labels.csv
      spem index label shapes.db --where "name LIKE 'cat%'" --as cat --meta site=Oslo
    """  # noqa: D301
    index = opened(db)
    metadata = parse_metadata(meta or [])
    if (labels is None) == (name is None and not metadata) or (labels is not None and where is not None):
        msg = "give a FILE of labels, or --as or --meta, with --where for some of the shapes"
        raise ParameterError(msg)
    unused: list[str] = []
    if labels is not None:
        changed, unused = index.label(labels, model=model)
    else:
        changed = index.annotate(where=where, label=name, metadata=metadata, model=model)
    if unused:
        complain(f"{labels}: {counted(len(unused), 'label')} without a shape, such as {unused[0]}")
    typer.echo(f"changed {counted(changed, 'shape')}")


def parse_metadata(pairs: list[str]) -> dict[str, str | None]:
    """Return KEY=VALUE as a table; an empty value is None.

    Examples
    --------
    >>> parse_metadata(["site=Oslo", "draft="])
    {'site': 'Oslo', 'draft': None}
    """
    table: dict[str, str | None] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not key or not equals:
            msg = f"--meta {pair}: expected KEY=VALUE such as site=Oslo"
            raise ParameterError(msg)
        table[key] = value or None
    return table


def export(
    db: Address,
    output: Annotated[
        Path, typer.Argument(metavar="FILE", help="File to write: .csv, .parquet, or .spem for codes.")
    ],
    where: Where = None,
    codes: Annotated[bool, typer.Option("--codes", help="Write the codes too.")] = False,
    model: ModelName = None,
) -> None:
    """Write the shapes of an index to a table, or their codes to a file for spem evaluate.

    \b
    Examples:
      spem index export shapes.db shapes.csv
      spem index export shapes.db shapes.parquet --codes
      spem index export shapes.db shapes.spem && spem evaluate shapes.spem --labels labels.csv
    """  # noqa: D301
    from spem.index.exporting import EXPORT_SUFFIXES

    check_target(output, EXPORT_SUFFIXES)
    written = opened(db).export(output, where=where, with_codes=codes, model=model)
    typer.echo(f"wrote {output}: {counted(written, 'shape')}")


def check(
    db: Address,
    files: Annotated[
        bool, typer.Option("--files", help="Look at the files too: gone, or changed since.")
    ] = False,
    repair: Annotated[
        bool, typer.Option("--repair", help="Remove rows that are damaged or there twice.")
    ] = False,
    json: Json = False,
) -> None:
    """Read all of an index and tell what is wrong; exit status 1 where something is.

    \b
    Examples:
      spem index check shapes.db
      spem index check shapes.db --files
    """  # noqa: D301
    from dataclasses import asdict

    index = opened(db)
    findings = index.check(files=files, repair=repair)
    if json:
        print_json([asdict(one) for one in findings])
    else:
        for one in findings:
            typer.echo(str(one))
        total = "nothing is wrong" if not findings else counted(len(findings), "finding")
        typer.echo(f"{counted(len(index), 'shape')} of {counted(len(index.models()), 'model')}: {total}")
    if findings:
        raise typer.Exit(_NOT_WHOLE)


#: Commands of the group, under the names that they have there; other modules have more.
COMMANDS = {"list": list_rows, "remove": remove, "label": label, "export": export, "check": check}
