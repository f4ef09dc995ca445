"""
Figure 5: the field of one boundary point
=========================================

Light up one point of the boundary, on the tip of the little finger, and leave the rest dark (2.2). Its
field falls so steeply that only its logarithm can be seen. It falls along every finger and hardly across
the palm: in a strip of width w the slowest fall is exp(−π s/w), with or without screening, because a walk
that sets out from the source is lost at the sides. So the logarithm measures a distance in which fingers
are long and the palm is small: parts come apart (2.3, 3.2).

Streamlines follow the gradient from all over the hand to the source, in the middle of the fingers.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.fields.gradients import source_gradient
from spem.fields.superposition.fields import SourceFields
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.limbs import fingers
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.sources import figure_source
from spem.plots.style import COLOURS, framed, new_figure

# Distances from the source over which a fall is measured, in pixels: beyond the source, within a finger.
RANGE = (4.0, 20.0)
LITTLE, THUMB = 0, 4


def make(data: Data) -> Finding:
    """Compare the fall of log v in fingers with that in the palm, of one source and of two."""
    found = chosen(data, "hand")
    hand = found.shapes[0]
    limbs = fingers(hand)
    every = spem.sources(hand)
    tip, _ = every.nearest(hand.points[limbs.tip(LITTLE)])
    away = np.linalg.norm(every.position[:, None] - hand.points[~limbs.core], axis=2).min(axis=1)
    fields = spem.source_fields(every.select([int(tip[0]), int(away.argmax())]))
    steep = np.linalg.norm(source_gradient(fields, 0), axis=1)
    over = {"fingers": float(np.median(steep[~limbs.core])), "palm": float(np.median(steep[limbs.core]))}
    slopes, width = [slope(fields, source) for source in (0, 1)], limbs.width(LITTLE)
    pictures = (
        Picture(
            "field",
            figure_source(fields, 0, window=limbs.window(THUMB)),
            "Left: log v of a source on the little finger, with lines of equal value; middle: directions "
            "of its gradient in the thumb; right: streamlines to the source.",
        ),
        Picture("fall", figure_fall(fields), "The largest log v at each distance from its source."),
    )
    numbers = {
        "slope": {"from finger": slopes[0], "from palm": slopes[1]} | {f"in {k}": v for k, v in over.items()},
        "finger_width": width,
        "slope_times_width_over_pi": slopes[0] * width / np.pi,
        "least_log": fields.log[0].min(),
    }
    return Finding(found.source, fall_claims(over, slopes, width), pictures, numbers=numbers)


def fall_claims(over: dict[str, float], slopes: list[float], width: float) -> tuple[Claim, ...]:
    """Judge the falls against each other and against that in a strip."""
    rate = slopes[0] * width / np.pi
    return (
        judged(
            "The field of a point on a finger falls sharply over the fingers, much less over the palm (2.3).",
            "sharp against much less steep",
            f"median |∇ log v| {over['fingers']:.2f} a pixel in fingers, {over['palm']:.2f} in the palm",
            over["fingers"] > 2 * over["palm"],
            note="The palm is less than twice as wide as a finger.",
        ),
        judged(
            "From a point at the side of the palm the slope of fall is much less steep (2.3).",
            "much less steep",
            f"log v falls by {slopes[0]:.2f} per pixel from the tip of the little finger, by "
            f"{slopes[1]:.2f} from the palm's side",
            slopes[0] > 2 * slopes[1],
            note="Near a point the field falls with the distance from it, wherever it stands.",
        ),
        judged(
            "The field of a single source decays exponentially (2.3).",
            "exponential decay",
            f"along the finger, {width:.1f} pixels wide, the rate is {rate:.2f} times π/width",
            0.7 < rate < 1.4,
            note="The finger is no straight strip.",
        ),
    )


def envelope(fields: SourceFields, source: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the largest log v at each distance from a source, in steps of a pixel."""
    away = fields.sources.system.shape.points - fields.sources.position[source]
    step = np.linalg.norm(away, axis=1).astype(int)
    top = np.full(int(step.max()) + 1, -np.inf)
    np.maximum.at(top, step, fields.log[source])
    return np.arange(0.5, top.size), top


def slope(fields: SourceFields, source: int) -> float:
    """Return by how much log v falls per pixel where it falls least."""
    away, top = (values[int(RANGE[0]) : int(RANGE[1])] for values in envelope(fields, source))
    return float(-np.polyfit(away, top, 1)[0])


def figure_fall(fields: SourceFields) -> Figure:
    """Draw the fall of both sources."""
    ax = (figure := new_figure(4.0, 2.8)).add_subplot()
    for source, name in enumerate(("tip of the little finger", "side of the palm")):
        ax.plot(*envelope(fields, source), color=COLOURS[source], label=name)
    ax.axvspan(*RANGE, color="#eef1f4", zorder=0)
    ax.legend(fontsize=7, frameon=False)
    framed(ax, "distance from the source (pixels)", "largest log v")
    return figure


if __name__ == "__main__":
    finding = present(make)
