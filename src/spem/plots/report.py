"""A collection on one page: a single HTML file that needs nothing else and no network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from spem.errors import LabelError, ParameterError
from spem.files import write_whole
from spem.plots.markup import page
from spem.plots.report_gallery import Gallery, shapes_section
from spem.plots.report_queries import queries_section
from spem.plots.report_sections import (
    classes_section,
    failures_section,
    maps_section,
    scores_section,
    settings_section,
)

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from spem.retrieval.evaluation import PrecisionRecall, Scores


def write_report(
    path: str | PathLike[str],
    *,
    title: str,
    names: Sequence[str],
    thumbnails: Sequence[bytes | NDArray[np.uint8] | None],
    labels: Sequence[Hashable] | None = None,
    map_pictures: Sequence[bytes | None] = (),
    scores: Scores | None = None,
    size_alone: Scores | None = None,
    curve: PrecisionRecall | None = None,
    distances: ArrayLike | None = None,
    settings: Mapping[str, object] | None = None,
    failures: Sequence[tuple[object, str]] = (),
) -> Path:
    """Write a report on a collection as one self-contained HTML file.

    Parameters
    ----------
    path
        File to write; an existing one is replaced at the end, in one step.
    title
        Heading of the page.
    names
        ``(n,)`` name of each shape.
    thumbnails
        ``(n,)`` picture of each shape: a PNG file, an ``(h, w, 4)`` array of bytes, or None.
    labels
        ``(n,)`` class of each shape, where known; without it there are no scores and no queries.
    map_pictures
        Up to `n` PNG files, of the first shapes in order; None where there is none.
    scores, curve
        What `spem.retrieval` makes of the distances and labels.
    size_alone
        What it makes of the sizes of the shapes instead, as a control.
    distances
        ``(n, n)`` distances between shapes, for the queries answered worst and best.
    settings
        What the codes were made with, by name.
    failures
        Files that were left out, each with the reason.

    Returns
    -------
    path
        The file written.

    Raises
    ------
    ParameterError
        If pictures, names and distances do not match in number, or the file cannot be written.
    LabelError
        If there is not one label for each shape.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_report(f"{folder}/a.html", title="Letters", names=["a"], thumbnails=[None])
    ...     page.read_text(encoding="utf-8").count("<h1>Letters</h1>")
    1
    """
    matrix = None if distances is None else np.asarray(distances, np.float64)
    _check(names, thumbnails, labels, map_pictures, matrix)
    words = None if labels is None else [str(label) for label in labels]
    gallery = Gallery(names, words, thumbnails)
    body = [
        scores_section(scores, curve, size_alone),
        queries_section(gallery, matrix),
        classes_section(scores, words),
        maps_section(gallery, map_pictures),
        shapes_section(gallery),
        settings_section(settings or {}),
        failures_section(failures),
        gallery.symbols(),
    ]
    target = Path(path)
    # A file name that is not UTF-8 reaches here with surrogates, which no encoding takes.
    whole = page(
        title, _summary(words, len(names)), "".join(body), style="report.css", script="report.js"
    ).encode("utf-8", "replace")
    write_whole(target, lambda file: file.write(whole))
    return target


def _check(
    names: Sequence[str],
    thumbnails: Sequence[object],
    labels: Sequence[Hashable] | None,
    map_pictures: Sequence[object],
    distances: NDArray[np.float64] | None,
) -> None:
    """Raise unless everything is of the same number of shapes."""
    n = len(names)
    if len(thumbnails) != n or len(map_pictures) > n:
        msg = f"{n} names need {n} thumbnails and at most as many map pictures, not {len(thumbnails)} and "
        msg += f"{len(map_pictures)}; None stands for a missing one"
        raise ParameterError(msg)
    if distances is not None and distances.shape != (n, n):
        msg = f"distances between {n} shapes are ({n}, {n}), not {distances.shape}"
        raise ParameterError(msg)
    if labels is not None and len(labels) != n:
        msg = f"{n} shapes need {n} labels, not {len(labels)}"
        raise LabelError(msg)


def _summary(labels: Sequence[str] | None, n_shapes: int) -> str:
    """How many shapes, and of how many classes."""
    shapes = f"{n_shapes} shape{'' if n_shapes == 1 else 's'}"
    if labels is None:
        return shapes
    n_classes = len(set(labels))
    return f"{shapes} in {n_classes} class{'' if n_classes == 1 else 'es'}"
