"""The sections of a report that hold numbers and maps; each takes what it shows and gives HTML."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from spem.plots.markup import data_uri, natural, number, section, table, text
from spem.plots.report_curve import curve_svg
from spem.plots.report_gallery import Gallery
from spem.retrieval.evaluation import E_ANSWERS, MEASURES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from spem.retrieval.evaluation import PrecisionRecall, Scores

MAP_PICTURES = 24


def scores_section(
    scores: Scores | None, curve: PrecisionRecall | None, size_alone: Scores | None = None
) -> str:
    """Return the mean scores, each named once in words, and the precision-recall curve beside them.

    What size alone would score stands below them, as a control.

    Examples
    --------
    >>> scores_section(None, None)
    ''
    """
    cards = "" if scores is None else _cards(scores, size_alone)
    picture = "" if curve is None else f'<figure class="curve">{curve_svg(curve)}</figure>'
    return section("Scores", f'<div class="scores">\n{cards}{picture}</div>' if cards or picture else "")


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
    rows = []
    for label, values in sorted(scores.per_class().items(), key=lambda row: natural(row[0])):
        size = sizes[str(label)]
        cells = [number(values[m]) for m in measures]
        rows.append([text(label), str(size), *cells, number(_largest_e(size, len(labels)))])
    titles = [f'<abbr title="{text(MEASURES.get(m, m))}">{text(m)}</abbr>' for m in measures]
    titles.append('<abbr title="E of perfect answers">E max</abbr>')
    caption = "Scores of each class in percent; E max is the E of perfect answers in a class of this size"
    return section("Classes", table(caption, ["class", "shapes", *titles], rows, sortable=True))


def maps_section(gallery: Gallery, pictures: Sequence[bytes | None]) -> str:
    """Return pictures of the maps of some shapes.

    Examples
    --------
    >>> maps_section(Gallery(["a"], None, [None]), [None])
    ''
    """
    order = gallery.labels or gallery.names
    shown = [(i, png) for i, png in enumerate(pictures) if png is not None]
    figures = [
        f'<figure class="maps"><figcaption>{_titled(gallery, i)}</figcaption>'
        f'<img src="{data_uri(png)}" alt="SPEM maps of {text(gallery.names[i])}" loading="lazy"></figure>\n'
        for i, png in sorted(shown, key=lambda one: natural(order[one[0]]))
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
    """Class of a shape above its name."""
    if gallery.labels is None:
        return text(gallery.names[i])
    return f"class {text(gallery.labels[i])}<br><small>{text(gallery.names[i])}</small>"


def _cards(scores: Scores, size_alone: Scores | None) -> str:
    """Mean scores and what they are called; the E of perfect answers beside E."""
    means = [(name, MEASURES.get(name, name), value) for name, value in scores.mean().items()]
    means.append(("BE", "bull's eye", scores.bulls_eye))
    most = number(_mean_largest_e([str(label) for label in scores.labels]))
    beside = {"E": f'<small class="most">of {most} %</small>'}
    cards = "".join(
        f'<div class="card"><dt><abbr title="{text(said)}">{text(name)}</abbr></dt>'
        f"<dd>{number(value)}<small> %</small>{beside.get(name, '')}</dd></div>"
        for name, said, value in means
    )
    words = ", ".join(f"<dfn>{text(name)}</dfn> {text(said)}" for name, said, _ in means)
    legend = (
        f"{words}. Perfect answers give 100 %, but for E, which looks at {E_ANSWERS} answers: with classes"
        f" of these sizes they give {most} %."
    )
    control = "" if size_alone is None else f'\n<p class="note">{_control(size_alone)}</p>'
    return f'<div><dl class="cards">{cards}</dl>\n<p class="note">{legend}</p>{control}</div>\n'


def _control(scores: Scores) -> str:
    """Say what a ranking by size alone scores."""
    means = [*scores.mean().items(), ("BE", scores.bulls_eye)]
    told = ", ".join(f"{text(name)} {number(value)}" for name, value in means)
    return f"As a control: a ranking by the size of the shapes and nothing else gives {told}."


def _largest_e(n_class: int, n_shapes: int) -> float:
    """E of a perfect answer, in percent: 2R / (R + 32) for R others of the class, fewer than 32."""
    relevant, answers = n_class - 1, min(E_ANSWERS, n_shapes - 1)
    return 200 * min(relevant, answers) / max(relevant + answers, 1)


def _mean_largest_e(labels: Sequence[str]) -> float:
    """Mean E of perfect answers to all queries that have something to find, in percent."""
    sizes = [size for size in Counter(labels).values() if size > 1]
    return sum(size * _largest_e(size, len(labels)) for size in sizes) / max(sum(sizes), 1)
