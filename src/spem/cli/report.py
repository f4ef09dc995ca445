"""The pictures and figures of a collection's report, gathered from its codes and files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from spem.cli.output import complain, counted
from spem.codes.features import band_maps, sweep_bands
from spem.codes.sources import read_shapes, source_name
from spem.codes.workers import run_all
from spem.errors import SpemError
from spem.plots.figures import map_picture
from spem.plots.report import write_report
from spem.plots.thumbnails import thumbnail
from spem.retrieval.evaluation import precision_recall

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from spem.codes.codes import Codes
    from spem.codes.settings import Settings
    from spem.retrieval.evaluation import Scores

# Enough for a picture of a hundred pixels.
THUMBNAIL_VOXELS = 4000
# Maps are shown of the first shape of so many classes.
MAP_PICTURES = 6
SHOWN_MAPS = 4


def write_collection_report(
    path: Path,
    codes: Codes,
    classes: list[str],
    scores: Scores,
    *,
    distances: NDArray[np.float64],
    title: str,
    size_alone: Scores | None = None,
    jobs: int = 1,
) -> Path:
    """Write the report of a collection; files that are gone have no picture.

    Parameters
    ----------
    path
        HTML file to write.
    codes
        The collection.
    classes
        Class of each row.
    scores
        Scores of the collection.
    distances
        ``(n, n)`` distances between its shapes.
    title
        Heading of the page.
    size_alone
        Scores of a ranking by size, as a control.
    jobs
        Number of processes.

    Returns
    -------
    pathlib.Path
        The file written.
    """
    pictures = _thumbnails(codes, jobs)
    drawn = [pictures.get(key) for key in zip(codes.paths, codes.names, strict=True)]
    _tell_missing(codes, drawn)
    shown = [classes.index(label) for label in dict.fromkeys(classes)][:MAP_PICTURES]
    return write_report(
        path,
        title=title,
        names=codes.names,
        labels=classes,
        thumbnails=drawn,
        map_pictures=[_map_picture(codes, row) if row in shown else None for row in range(max(shown) + 1)],
        scores=scores,
        size_alone=size_alone,
        curve=precision_recall(distances, classes),
        distances=distances,
        settings=codes.model.settings.to_json() | {"model": codes.model.digest},
        failures=[(failure.path, failure.reason) for failure in codes.failures],
    )


@dataclass(frozen=True)
class _Draw:
    """Draw the small pictures of all shapes of a file, by name."""

    settings: Settings

    def __call__(self, path: str) -> dict[str, bytes]:
        source = Path(path)
        found = read_shapes(source, self.settings)
        shapes = ((suffix, shape) for suffix, shape in found if not isinstance(shape, SpemError))
        return {source_name(source) + suffix: thumbnail(shape) for suffix, shape in shapes if shape.ndim <= 3}


def _thumbnails(codes: Codes, jobs: int) -> dict[tuple[str, str], bytes]:
    """Draw every shape whose file is still there."""
    draw = _Draw(replace(codes.model.settings, voxels=THUMBNAIL_VOXELS))
    paths = list(dict.fromkeys(path for path in codes.paths if Path(path).is_file()))
    outcomes = run_all(draw, paths, jobs)
    return {(path, name): png for path, drawn, _ in outcomes for name, png in (drawn or {}).items()}


def _tell_missing(codes: Codes, drawn: list[bytes | None]) -> None:
    """Tell how many shapes have no picture, and why the first has none."""
    missing = [path for path, png in zip(codes.paths, drawn, strict=True) if png is None]
    if missing:
        why = "cannot be drawn" if Path(missing[0]).is_file() else "is not there"
        of = f"{len(missing)} of {counted(len(drawn), 'shape')}"
        complain(f"{of} could not be drawn for the report: {missing[0]} {why}")


def _map_picture(codes: Codes, row: int) -> bytes | None:
    """Draw the leading maps of one shape in its first band; None where its file is gone, or no maps are."""
    source = Path(codes.paths[row])
    maps = [part.settings for part in codes.model.parts if part.settings.features == "spem"]
    if not maps:
        return None
    settings = replace(maps[0], n_maps=min(SHOWN_MAPS, maps[0].n_maps))
    try:
        for suffix, shape in read_shapes(source, settings):
            wanted = source_name(source) + suffix == codes.names[row]
            if wanted and not isinstance(shape, SpemError) and shape.ndim <= 3:
                return map_picture(band_maps(sweep_bands(shape, settings), settings))
    except SpemError:
        pass
    return None
