"""The sections of a report that hold numbers and maps; each takes what it shows and gives HTML."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from spem.plots.markup import data_uri, number, section, table, text
from spem.plots.report_curve import curve_svg
from spem.plots.report_gallery import Gallery
from spem.retrieval.evaluation import MEASURES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from spem.retrieval.evaluation import PrecisionRecall, Scores

MAP_PICTURES = 24


def scores_section(scores: Scores | None, curve: PrecisionRecall | None) -> str:
    """Return the mean scores and the precision-recall curve.

    Examples
    --------
    >>> scores_section(None, None)
    ''
    """
    cards = ""
    if scores is not None:
        means = [(name, MEASURES.get(name, name), value) for name, value in scores.mean().items()]
        means.append(("BE", "bull's eye", scores.bulls_eye))
        cards = "".join(
            f'<div class="card"><dt><abbr title="{text(said)}">{text(name)}</abbr></dt>'
            f"<dd>{number(value)}<small> %</small></dd></div>"
            for name, said, value in means
        )
        cards = f'<dl class="cards">{cards}</dl>\n'
    picture = "" if curve is None else f'<figure class="curve">{curve_svg(curve)}</figure>'
    return section("Scores", cards, picture)


def classes_section(scores: Scores | None, labels: Sequence[str] | None) -> str:
    """Return the table of scores for each class, sorted by a press on a title.

    Examples
    --------
    >>> classes_section(None, None)
    ''
    """
    if scores is None or labels is None:
        return ""
    sizes = Counter(labels)
    measures = list(scores.mean())
    rows = [
        [text(label), str(sizes[str(label)]), *(number(values[m]) for m in measures)]
        for label, values in scores.per_class().items()
    ]
    titles = [f'<abbr title="{text(MEASURES.get(m, m))}">{text(m)}</abbr>' for m in measures]
    caption = "Scores of each class in percent"
    return section("Classes", table(caption, ["class", "shapes", *titles], rows, sortable=True))


def maps_section(gallery: Gallery, pictures: Sequence[bytes | None]) -> str:
    """Return pictures of the maps of some shapes.

    Examples
    --------
    >>> maps_section(Gallery(["a"], None, [None]), [None])
    ''
    """
    figures = [
        f'<figure class="maps"><img src="{data_uri(png)}" alt="SPEM maps of {text(gallery.names[i])}" '
        f'loading="lazy"><figcaption>{_titled(gallery, i)}</figcaption></figure>\n'
        for i, png in enumerate(pictures)
        if png is not None
    ]
    if len(figures) > MAP_PICTURES:
        step = len(figures) / MAP_PICTURES
        figures = [figures[int(k * step)] for k in range(MAP_PICTURES)]
    return section("Maps", f'<div class="strips">\n{"".join(figures)}</div>' if figures else "")


def settings_section(settings: Mapping[str, object]) -> str:
    """Return what the collection was described with.

    Examples
    --------
    >>> settings_section({"n_maps": 4}).count("<tr>")
    2
    """
    rows = [[text(name), text(value)] for name, value in settings.items()]
    return section(
        "Settings", table("What the codes were made with", ["setting", "value"], rows) if rows else ""
    )


def failures_section(failures: Sequence[tuple[object, str]]) -> str:
    """Return the files that were left out, and why.

    Examples
    --------
    >>> failures_section([("a.png", "empty")]).count("<tr>")
    2
    """
    rows = [[text(path), text(reason)] for path, reason in failures]
    title = f"Left out: {len(rows)}"
    return section(title, table("Files that could not be used", ["file", "reason"], rows) if rows else "")


def _titled(gallery: Gallery, i: int) -> str:
    """Return the name and class of a shape."""
    label = "" if gallery.labels is None else f" <small>{text(gallery.labels[i])}</small>"
    return text(gallery.names[i]) + label
