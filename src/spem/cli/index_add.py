"""``spem index add``: shapes encoded here or on a cluster, and written to an index as they come."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.index import Address, parse_metadata
from spem.cli.options import Device, Jobs, Json, find_device, tell_idle_device
from spem.cli.output import complain, counted, print_json
from spem.cli.progress import Bar
from spem.cli.settings_options import with_settings

if TYPE_CHECKING:
    from spem.codes.model import Model
    from spem.index.adding import Added
    from spem.index.index import Index


@with_settings
def add(
    db: Address,
    paths: Annotated[
        list[str], typer.Argument(metavar="SHAPES...", help="Files, folders with all below them, patterns.")
    ],
    labels: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Lines 'file,label', or a Princeton classification (.cla)."),
    ] = None,
    meta: Annotated[
        list[str] | None,
        typer.Option("--meta", metavar="KEY=VALUE", help="Metadata of all that is added; may be repeated."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(metavar="CODES|DIGEST", help="Model of a file, or which one of the index."),
    ] = None,
    new_model: Annotated[
        bool, typer.Option("--new-model", help="Learn another model from SHAPES, beside those of DB.")
    ] = False,
    prune: Annotated[
        bool, typer.Option("--prune", help="Drop shapes whose files are no longer in SHAPES.")
    ] = False,
    no_shapes: Annotated[
        bool, typer.Option("--no-shapes", help="Keep codes and pictures only; views need the shapes.")
    ] = False,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Encode on the Dask cluster with this scheduler, tcp://HOST:PORT."
        ),
    ] = None,
    retries: Annotated[
        int, typer.Option(min=0, help="Further tries of a shape whose worker on the cluster died.")
    ] = 2,
    work: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of what is done before there is a model. [DB/work]"),
    ] = None,
    *,
    options: dict[str, Any],
    paper: Annotated[bool, typer.Option("--paper", help="Settings of the paper, section 5.5.")] = False,
    jobs: Jobs = None,
    device: Device = "cpu",
    json: Json = False,
) -> None:
    """Add shapes to an index, and keep it up to date.

    A new index learns its vocabulary from the shapes, as `spem encode` does; after that only files that are
    new or have changed are encoded, and equal files are one row. Rows are written as they come. Files that
    fail are told, one line each, and tried again next time; an interrupted run goes on when the same command
    is given again. With --cluster the workers need spem and the same files, under the same paths.

    \b
    Examples:
      spem index add shapes.db shapes/
      spem index add shapes.db shapes/ --labels shapes/labels.csv --meta site=Oslo
      spem index add shapes.db shapes/ --prune                   follows a folder
      spem index add shapes.db solids/ --new-model               solids beside silhouettes
      spem index add shapes.db solids/ --device cuda             maps on a GPU
      spem index add s3://bucket/shapes scans/ --cluster tcp://head:8786
    """  # noqa: D301
    from spem.codes.settings import Settings
    from spem.codes.sources import count_hidden, find_files
    from spem.codes.workers import count_processes
    from spem.index.index import Index

    where = find_device(device)
    settings = Settings.paper(**options) if paper else None
    Settings.of(options)
    metadata = {key: value or "" for key, value in parse_metadata(meta or []).items()}
    hidden = count_hidden(paths)
    if hidden:
        complain(f"{counted(hidden, 'hidden file')} left out; give such files by name")
    n_jobs = jobs or count_processes(len(find_files(paths)))
    index = Index.open(db)
    with Bar() as bar:
        try:
            added = index.add(
                list(paths),
                model=_model(model),
                new_model=new_model,
                settings=settings,
                labels=labels,
                metadata=metadata,
                n_jobs=n_jobs,
                cluster=cluster,
                device=where,
                retries=retries,
                keep_shapes=not no_shapes,
                prune=prune,
                work=work,
                progress=bar.advance,
                on_failure=bar.fail,
                **({} if paper else options),
            )
        except KeyboardInterrupt:
            msg = f"interrupted; what is done is kept in {db}: give the same command again to go on"
            raise KeyboardInterrupt(msg) from None
    if where is not None:
        tell_idle_device(device, index.model(added.model).settings.features)
    _tell(index, added, paths, json=json)
    if added.failures:
        raise typer.Exit(1)


def _model(name: str | None) -> Model | str | None:
    """Return the model of a file, or the digest of one of the index."""
    from spem.cli.encode import load_model

    return load_model(Path(name)) if name is not None and Path(name).exists() else name


def _tell(index: Index, added: Added, paths: list[str], *, json: bool) -> None:
    """Tell what an addition came to."""
    numbers = {"added": added.added, "updated": added.updated, "unchanged": added.unchanged}
    numbers |= {"removed": added.removed, "failed": len(added.failures)}
    total = index.count(model=added.model)
    address = index.store.address
    if json:
        failures = [{"path": each.path, "reason": each.reason} for each in added.failures]
        facts = {"index": address, "model": added.model, "n_shapes": total, "gone": added.gone}
        print_json(facts | numbers | {"failures": failures})
        return
    if added.gone:
        verb, them = ("is", "it") if added.gone == 1 else ("are", "them")
        complain(
            f"{counted(added.gone, 'file')} of {address} {verb} no longer in {', '.join(paths)};"
            f" --prune removes {them}"
        )
    told = ", ".join(f"{number} {word}" for word, number in numbers.items() if number) or "nothing to do"
    typer.echo(f"{address}: {told}; {counted(total, 'shape')}, model {added.model}")
