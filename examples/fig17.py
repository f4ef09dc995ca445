"""
Figure 17: classes from moments of nodal domains
================================================

How much do the projections of a shape know that its silhouette does not tell at once? Hu's seven moments are
a weak description of a silhouette. Taken of the nodal domains of its projections instead, and classified
by a linear support vector machine, they tell classes apart far better (5.4). Ten shapes of each class are
drawn for training, the other ten are tested, a hundred times.

Silhouettes have an inner radius of 20 pixels; ρ runs from 2 to 30 pixels, as in Figure 2. Thresholds are
learnt from all shapes, without their labels. The paper does not say how it scaled moments, whose sizes
differ by orders of magnitude, nor projections. Here moments are −sign(h) log₁₀|h|, as is usual, and
projections have root-mean-square one and are cut at the cluster means. The table tries other readings.
"""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from spem.fields.hyperfield import Hyperfield
from spem.paper.data import Data, duplicate_names
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.moments import READINGS, Curves, curves, hyperfields, score_readings
from spem.paper.present import present
from spem.plots.style import COLOURS, TEXT_SIZE, framed, new_figure

BINARY, SINGLE, STACKED = COLOURS[0], COLOURS[1], COLOURS[6]
SOME = ("silhouette", "P₁ alone", "P₉ alone", "P₁ to P₃", "P₁ to P₉")
PLAIN = READINGS[-1]
# Silhouettes of the reduced size.
FEW = 18
# A step down counts as one if it is this many standard errors.
SURE = 2.0


def make(data: Data) -> Finding:
    """Classify silhouettes by moments, with all shapes, without duplicates, and in other readings."""
    found = data.collection("tari1000", ndim=2, voxels=1500, per_class=3 if data.quick else None)
    found = replace(found, items=found.items[:FEW], labels=found.labels[:FEW]) if data.quick else found
    n_train, repeats = (2, 10) if data.quick else (10 if found.real else 3, 100)
    fields = hyperfields(found.items)
    main = figure_curves(fields, found.labels, n_train, repeats)
    chosen = (READINGS[0], PLAIN) if data.quick else READINGS
    # A fifth of the splits tells readings apart.
    others = score_readings(found, fields, chosen, n_train=n_train, repeats=max(repeats // 5, 2))
    rows = dict(others)
    numbers = {"all": main.to_json(), "readings": others}
    full = found.real and not data.quick
    if full:
        kept = [i for i, item in enumerate(found.items) if getattr(item, "name", "") not in duplicate_names()]
        less = figure_curves([fields[i] for i in kept], [found.labels[i] for i in kept], n_train, repeats)
        numbers["without duplicates"] = less.to_json()
        rows["as in the figure, 19 duplicates left out"] = less.some()
    caption = (
        f"Mean accuracy over {repeats} splits, {n_train} shapes of each class for training; bands are one "
        "standard deviation of a split."
    )
    return Finding(
        found.source,
        claims(main, others[PLAIN.name], data, full),
        (Picture("accuracy", chart(main), caption),),
        numbers,
        tables=(table(rows),),
    )


def figure_curves(
    fields: list[Hyperfield], labels: list[str] | tuple[str, ...], n: int, repeats: int
) -> Curves:
    """Return the curves in the reading of the figure, with thresholds learnt from these shapes."""
    return curves(*READINGS[0].moments(fields), labels, n_train=n, repeats=repeats)


def claims(main: Curves, plain: list[float], data: Data, full: bool) -> tuple[Claim, ...]:
    """Set the curves beside what 5.4 says of them."""
    binary, last = main.binary.mean, main.stacked[-1].mean
    single, stacked = (np.array([each.mean for each in found]) for found in (main.single, main.stacked))
    ratio, above = single[-1] / binary, int((single > binary).sum())
    # All vectors are tested on the same splits, so a step is told against its own deviation.
    steps = 100 * np.diff([each.accuracies for each in main.stacked], axis=0)
    step, error = steps.mean(axis=1), steps.std(axis=1, ddof=1) / np.sqrt(steps.shape[1])
    worst = int(step.argmin())
    lifted = (
        "The logarithm makes the moments of silhouettes strong. With moments as they are, cut midway between "
        f"clusters, ρ from 1 to 20: {plain[0]:.0f} % for silhouettes, {plain[1]:.0f} % for P₁ alone, "
        f"{plain[2]:.0f} % for P₉ alone, {plain[-1]:.0f} % for nine."
    )
    fallen = f"Projection {worst + 2} adds more noise than it tells: there is as much of it as of the others."
    absent = data.absent("tari1000") if data.find("tari1000") is None else "A reduced size; run it in full."
    rows = (
        ("Nine projections together reach 80 % (Fig. 17).", "80 %", f"{last:.1f} %", last >= 80, "Below."),
        (
            "The moments of silhouettes reach 30 % (Fig. 17).",
            "30 %",
            f"{binary:.1f} %",
            abs(binary - 30) < 5,
            lifted,
        ),
        (
            "The moments of single projections are more informative than those of silhouettes (5.4).",
            "all nine",
            f"{above} of nine; {single.max():.1f} % against {binary:.1f} % at best",
            above == single.size,
            lifted,
        ),
        (
            "Even the ninth projection alone is almost twice as descriptive as the silhouette (5.4).",
            "almost 2 times",
            f"{ratio:.2f} times",
            ratio > 1.75,
            lifted,
        ),
        (
            "Accuracy grows with every projection that is added (5.4).",
            "monotone",
            f"{stacked[0]:.1f} to {last:.1f} %, least step {step[worst]:+.2f} ± {error[worst]:.2f} points",
            bool((step > -SURE * error).all()),
            fallen,
        ),
    )
    return tuple(
        judged(
            what,
            paper,
            ours if full else "not measured",
            bool(holds),
            note=note if full else absent,
            tested=full,
        )
        for what, paper, ours, holds, note in rows
    )


def table(rows: dict[str, list[float]]) -> Table:
    """Return the accuracies in all readings."""
    caption = (
        "Mean accuracy in percent in other readings of what 5.4 leaves open; each changes one thing but the "
    )
    caption += "one that names several."
    cells = [(name, *(f"{value:.1f}" for value in values)) for name, values in rows.items()]
    return Table(caption, ("reading", *SOME), tuple(cells))


def chart(main: Curves) -> Figure:
    """Draw accuracy against the number of a projection."""
    figure = new_figure(6, 3.6)
    ax = figure.add_subplot()
    number = np.arange(1, len(main.single) + 1)
    lines = (
        ("projections 1 to n together", STACKED, "s", main.stacked),
        ("projection n alone", SINGLE, "o", main.single),
        ("silhouette", BINARY, "", (main.binary,) * number.size),
    )
    for name, colour, marker, found in lines:
        mean, sd = (np.array([getattr(each, what) for each in found]) for what in ("mean", "deviation"))
        ax.fill_between(number, mean - sd, mean + sd, color=colour, alpha=0.12, linewidth=0)
        ax.plot(number, mean, color=colour, marker=marker, markersize=4, linewidth=1.4, label=name)
    framed(ax, "projection n", "accuracy, %")
    ax.set_xticks(number)
    ax.set_ylim(0, 100)
    ax.legend(fontsize=TEXT_SIZE, frameon=False, loc="lower left")
    return figure


if __name__ == "__main__":
    finding = present(make)
