"""``spem evaluate``: scores of a collection whose labels are known, and the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.index import ModelName
from spem.cli.labelled import Collection, load_labelled
from spem.cli.options import Jobs
from spem.cli.output import (
    check_folder,
    check_target,
    complain,
    counted,
    print_json,
    print_table,
    to_json,
    write_bytes,
)
from spem.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from spem.codes.codes import Codes
    from spem.retrieval.evaluation import Scores

REPORT = "report.html"


def evaluate(
    collection: Collection,
    labels: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Lines 'file,label', or a Princeton classification (.cla). [those of the index]",
        ),
    ] = None,
    model: ModelName = None,
    rerank: Annotated[
        bool, typer.Option("--rerank", help="Score again after diffusion re-ranking, and tell both.")
    ] = False,
    json: Annotated[
        Path | None,
        typer.Option(
            "--json", metavar="FILE", help="Write the scores to FILE as JSON; - is standard output."
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Write report.html, a page on the collection, there."),
    ] = None,
    matched_size: Annotated[
        float | None,
        typer.Option(
            "--matched-size",
            metavar="FACTOR",
            help="Compare shapes of one size: volumes at most FACTOR times each other.",
        ),
    ] = None,
    ignore_unlabelled: Annotated[
        bool, typer.Option("--ignore-unlabelled", help="Leave out shapes that have no label.")
    ] = False,
    split: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Classify too: train on N shapes of each class, test on the others."
        ),
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Number of splits.")] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the splits.")] = 0,
    jobs: Jobs = None,
) -> None:
    """Score a collection whose labels are known.

    NN, FT, ST, E and DCG in percent, each shape being a query in turn, and the bull's-eye score.
    A file is labelled by its path or name; each shape of a label volume by its own, such as teeth-3.
    Codes do not know the size of a shape; what size alone would score is told beside them, as a control.
    With --split also how often a linear support vector machine gives a test shape its class; with --rerank
    the scores after diffusion over the neighbourhoods of the collection too, apart from the others.

    \b
    Examples:
      spem evaluate shapes.spem --labels shapes/labels.csv
      spem evaluate shapes.db
      spem evaluate shapes.spem --labels test.cla --json scores.json --report report/
      spem evaluate shapes.spem --labels shapes/labels.csv --split 10 --repeats 20
      spem evaluate shapes.spem --labels some.csv --ignore-unlabelled --json -
    """  # noqa: D301
    to_stdout = json is not None and str(json) == "-"
    _check_targets(None if to_stdout else json, report, whole=matched_size is None)
    from spem.codes.workers import count_processes
    from spem.retrieval.distances import correlation_distance
    from spem.retrieval.sizes import of_one_size

    codes, classes = load_labelled(collection, labels, model, ignore_unlabelled=ignore_unlabelled)
    distances = correlation_distance(codes.vectors, codes.vectors)
    candidates = None if matched_size is None else of_one_size(codes.volumes, matched_size)
    scores = score(distances, classes, candidates)
    control = size_scores(codes, classes, candidates)
    facts = summary(scores, control)
    if matched_size is not None:
        facts["matched_size"] = matched_size
    if rerank:
        facts["after_diffusion"] = after_diffusion(distances, classes, candidates)
    if split is not None:
        facts["classification"] = classification(codes, classes, split, repeats, seed)
    _tell(facts, json)
    if report is not None:
        from spem.cli.report import write_collection_report

        page = write_collection_report(
            report / REPORT,
            codes,
            classes,
            scores,
            distances=distances,
            title=Path(collection).stem,
            size_alone=control,
            jobs=jobs or count_processes(len(codes)),
        )
        typer.echo(f"wrote {page}", err=to_stdout)


def _check_targets(json: Path | None, report: Path | None, *, whole: bool) -> None:
    """Refuse files that cannot be written, and a report on less than the whole collection."""
    if json is not None:
        check_target(json)
    if report is not None:
        if not whole:
            msg = "--report is a page on the whole collection; leave out --matched-size or --report"
            raise ParameterError(msg)
        check_folder(report)


def after_diffusion(
    distances: NDArray[np.float64], classes: list[str], candidates: NDArray[np.bool_] | None = None
) -> dict[str, float]:
    """Score distances once more, after diffusion re-ranking."""
    from spem.retrieval.diffusion import rerank
    from spem.retrieval.evaluation import evaluate as score_distances

    scores = score_distances(rerank(distances), classes, candidates=candidates)
    return {**scores.mean(), "bulls_eye": scores.bulls_eye}


def size_scores(
    codes: Codes, classes: list[str], candidates: NDArray[np.bool_] | None = None
) -> Scores | None:
    """Score a ranking by volume and nothing else; None where volumes are not known."""
    from spem.retrieval.evaluation import evaluate as score_distances
    from spem.retrieval.sizes import size_distance

    try:
        distances = size_distance(codes.volumes)
    except ParameterError:
        return None
    return score_distances(distances, classes, candidates=candidates)


def classification(codes: Codes, classes: list[str], n_train: int, repeats: int, seed: int) -> dict[str, Any]:
    """Classify codes over several splits, and return what is told of it, in percent."""
    import numpy as np

    from spem.retrieval.classification import classify_vectors

    found = classify_vectors(
        codes.vectors, classes, n_train=n_train, repeats=repeats, rng=np.random.default_rng(seed)
    )
    return {
        "accuracy": found.mean,
        "deviation": found.deviation,
        "n_train": n_train,
        "repeats": repeats,
        "per_class": found.per_class(),
        "mistaken": [{"class": row, "taken_for": column, "count": n} for row, column, n in found.mistaken()],
    }


def _tell(facts: dict[str, Any], json: Path | None) -> None:
    """Print the scores, or write them as JSON to standard output; and to a file where one is named."""
    if json is not None and str(json) == "-":
        print_json(facts)
        return
    if json is not None:
        write_bytes(json, (to_json(facts) + "\n").encode())
    print_scores(facts)
    if json is not None:
        typer.echo(f"wrote {json}")


def score(
    distances: NDArray[np.float64], classes: list[str], candidates: NDArray[np.bool_] | None = None
) -> Scores:
    """Score the distances between shapes by the class of each, and tell of classes of one."""
    from spem.retrieval.evaluation import evaluate as score_distances

    scores = score_distances(distances, classes, candidates=candidates)
    if scores.skipped:
        alone = ", ".join(classes[i] for i in scores.skipped[:3]) + (
            ", ..." if len(scores.skipped) > 3 else ""
        )
        why = "alone in a class of one" if candidates is None else "with no shape of its class and size"
        complain(f"{counted(len(scores.skipped), 'shape')} {why}, not scored: {alone}")
    return scores


def summary(scores: Scores, control: Scores | None) -> dict[str, Any]:
    """Return scores, and those of size alone if known, as the JSON of the command line has them."""
    facts = {
        **scores.mean(),
        "bulls_eye": scores.bulls_eye,
        "n_shapes": len(scores.labels),
        "n_classes": len(set(scores.labels)),
        "n_skipped": len(scores.skipped),
        "per_class": scores.per_class(),
    }
    if control is not None:
        facts["size_alone"] = {**control.mean(), "bulls_eye": control.bulls_eye}
    return facts


def print_scores(facts: dict[str, Any]) -> None:
    """Print the means of all measures, and the bull's-eye score."""
    from spem.retrieval.evaluation import MEASURES

    columns = {name: name for name in MEASURES} | {"bulls_eye": "bull's eye"}
    classes = "1 class" if facts["n_classes"] == 1 else f"{facts['n_classes']} classes"
    size = f", sizes within a factor of {facts['matched_size']:g}" if "matched_size" in facts else ""
    typer.echo(f"{counted(facts['n_shapes'], 'shape')} in {classes}{size}, percent")
    ways = {"codes": facts, "size alone": facts.get("size_alone")}
    ways["codes, diffusion re-ranked"] = facts.get("after_diffusion")
    rows = [(way, *(f"{told[name]:.1f}" for name in columns)) for way, told in ways.items() if told]
    print_table(("", *columns.values()), rows, left=(0,))
    if "classification" in facts:
        told = facts["classification"]
        splits = counted(told["repeats"], "split")
        share = f"{told['accuracy']:.1f} ± {told['deviation']:.1f} percent"
        typer.echo(f"classified {share}: {told['n_train']} of each class for training, {splits}")
