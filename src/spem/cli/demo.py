"""``spem demo``: a collection of creatures, from files to codes, answers, scores and pictures."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.encode import encode_paths
from spem.cli.evaluate import REPORT, print_scores, score, size_scores, summary
from spem.cli.options import Json
from spem.cli.output import check_folder, complain, print_json, print_table

if TYPE_CHECKING:
    from spem.codes.codes import Codes
    from spem.codes.model import Model

INDEX = "index"

# Enough for scores that mean something, and for a minute on two cores.
CREATURES_PER_CLASS = 5
KINDS: tuple[str, ...] | None = None
VOXELS = 8000
ANSWERS = 5
RHO = [0.05, 0.1, 0.2, 0.4]
# Whose parts are shown, those that its first poses share: a trunk, a head, a tail and four legs.
DIVIDED = "dog"
POSES = 3
PART_VOXELS = {2: 3000, 3: 6000}
PARTS = {2: 8, 3: 9}


def demo(
    folder: Annotated[Path, typer.Argument(metavar="[FOLDER]", help="Where to.")] = Path("spem-demo"),
    seed: Annotated[int, typer.Option(help="Seed of the collection.")] = 0,
    json: Json = False,
) -> None:
    """Make a collection, and all that can be made of it.

    Creatures as silhouettes and as meshes, their codes, answers to a query, scores, pictures of fields, maps
    and parts, a report, and an index of them all for the explorer.

    \b
    Examples:
      spem demo
      spem demo creatures --seed 7
    """  # noqa: D301
    check_folder(folder)
    import numpy as np

    from spem.shapes.creatures import write_collection

    rng = np.random.default_rng(seed)
    folders = write_collection(folder, n_per_class=CREATURES_PER_CLASS, kinds=KINDS, rng=rng)
    written: list[Path] = []
    facts: dict[str, Any] = {}
    models = []
    for shapes in folders:
        facts[shapes.name], model = _collection(shapes, written, quiet=json)
        models.append(model)
    index, missing = _index(folder / INDEX, folders, models)
    if json:
        print_json(facts | {"written": written, "index": index})
        return
    typer.echo("\npictures and reports:")
    for path in written:
        typer.echo(f"  {path}")
    if index is None:
        complain(f"no index was made: {missing}")
        return
    typer.echo(f"\nto open the explorer on these shapes:\n  {_command()} serve {index} --open")


def _index(folder: Path, folders: Sequence[Path], models: Sequence[Model]) -> tuple[Path | None, str]:
    """Make an index of all shapes, with the model of each collection; or say what it lacks."""
    from spem.errors import MissingExtraError
    from spem.index.index import Index

    try:
        index = Index.open(folder)
    except MissingExtraError as error:
        return None, str(error)
    for shapes, model in zip(folders, models, strict=True):
        index.add(shapes, model=model, labels=shapes / "labels.csv", prune=True)
    return folder, ""


def _command() -> str:
    """Return how this program is called from the shell, where it is not on the path."""
    program = Path(sys.argv[0])
    if program.name != "spem" or shutil.which("spem") == str(program.absolute()):
        return "spem"
    return str(program)


def _collection(shapes: Path, written: list[Path], *, quiet: bool) -> tuple[dict[str, Any], Model]:
    """Encode, search and score one folder of shapes, and draw the first of them."""
    from spem.cli.report import write_collection_report
    from spem.collections import row_keys
    from spem.retrieval.distances import correlation_distance
    from spem.retrieval.labels import match_labels, read_labels

    root = shapes.parent
    codes, _ = encode_paths([str(shapes)], root / f"{shapes.name}.spem", {"voxels": VOXELS}, overwrite=True)
    classes = match_labels(row_keys(codes), read_labels(shapes / "labels.csv"))
    distances = correlation_distance(codes.vectors, codes.vectors)
    scores, control = score(distances, classes), size_scores(codes, classes)
    facts = summary(scores, control)
    if not quiet:
        typer.echo(f"\n{shapes}")
        print_scores(facts)
        _print_answers(codes)
    pictures = [root / f"{shapes.name}-fields.png", root / f"{shapes.name}-maps.png"]
    _draw(Path(codes.paths[0]), *pictures)
    report = root / f"{shapes.name}-{REPORT}"
    title = f"Creatures, {shapes.name}"
    page = write_collection_report(
        report, codes, classes, scores, distances=distances, title=title, size_alone=control
    )
    divided = [path for path, name in zip(codes.paths, classes, strict=True) if name == DIVIDED]
    parts = _divide((divided or codes.paths)[:POSES], root / f"{shapes.name}-parts.png")
    written += [*pictures, *parts, page]
    return facts, codes.model


def _print_answers(codes: Codes) -> None:
    """Print the answers to the first shape as a query."""
    from spem.retrieval.ranking import rank

    answers = rank(codes.vectors[0], codes, ANSWERS)
    typer.echo(f"answers to {codes.names[0]}")
    print_table(
        ("rank", "distance", "name"), [(str(a.rank), f"{a.distance:.4f}", a.name) for a in answers], (2,)
    )


def _draw(path: Path, fields_file: Path, maps_file: Path) -> None:
    """Draw fields and maps of one file."""
    import spem
    from spem.cli.output import write_figure
    from spem.plots.figures import figure_fields, figure_maps

    shape = spem.read(path, voxels=VOXELS)
    rho = [share * shape.size for share in RHO]
    titles = [f"ρ = {share:g} L" for share in RHO]
    write_figure(fields_file, figure_fields(shape, spem.field(shape, rho), titles))
    write_figure(maps_file, figure_maps(spem.maps(shape, 4)))


def _divide(paths: Sequence[str], picture: Path) -> list[Path]:
    """Draw the parts that poses share, those of meshes on a page to be turned too."""
    import spem
    from spem.cli.division import divide
    from spem.cli.part_files import PartFiles
    from spem.cli.parts import PartsRequest
    from spem.shapes.kinds import MESH_SUFFIXES, has_suffix

    solid = all(has_suffix(Path(path), MESH_SUFFIXES) for path in paths)
    files = PartFiles(tuple(paths), None, picture, picture.with_suffix(".html") if solid else None, None)
    ndim = 3 if solid else 2
    shapes = [spem.read(path, voxels=PART_VOXELS[ndim]) for path in paths]
    files.write(divide(shapes, PartsRequest(PARTS[ndim])))
    return files.written()
