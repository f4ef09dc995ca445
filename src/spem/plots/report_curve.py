"""The precision-recall curve of a report: an SVG that takes the colours of the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from spem.retrieval.evaluation import PrecisionRecall

WIDTH, HEIGHT = 360.0, 270.0
LEFT, TOP, RIGHT, BOTTOM = 44.0, 10.0, 12.0, 40.0


def curve_svg(curve: PrecisionRecall) -> str:
    """Return precision over recall as inline SVG.

    Parameters
    ----------
    curve
        Recall and precision, both in 0 to 1.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> svg = curve_svg(SimpleNamespace(recall=np.array([0.5, 1.0]), precision=np.array([1.0, 0.6])))
    >>> "196.0,10.0 348.0,98.0" in svg
    True
    """
    recall, precision = np.asarray(curve.recall), np.asarray(curve.precision)
    known = np.isfinite(recall) & np.isfinite(precision)
    points = " ".join(
        f"{_x(r):.1f},{_y(p):.1f}" for r, p in zip(recall[known], precision[known], strict=True)
    )
    said = "; ".join(f"{p:.2f} at recall {r:.2f}" for r, p in _few(recall, precision))
    grid = "".join(_grid_lines(level) for level in np.linspace(0, 1, 6))
    return (
        f'<svg class="curve" viewBox="0 0 {WIDTH:.0f} {HEIGHT:.0f}" role="img" aria-labelledby="curve-title">'
        f'<title id="curve-title">Precision against recall: precision {said}</title>{grid}'
        f'<polyline points="{points}"/>'
        f'<text x="{_x(0.5):.1f}" y="{HEIGHT - 6}" text-anchor="middle">recall</text>'
        f'<text transform="translate(12 {_y(0.5):.1f}) rotate(-90)" text-anchor="middle">precision</text>'
        "</svg>"
    )


def _x(recall: float) -> float:
    """Horizontal position of a recall."""
    return LEFT + recall * (WIDTH - LEFT - RIGHT)


def _y(precision: float) -> float:
    """Vertical position of a precision."""
    return HEIGHT - BOTTOM - precision * (HEIGHT - BOTTOM - TOP)


def _grid_lines(level: float) -> str:
    """Two lines of the grid and their numbers."""
    x, y = _x(level), _y(level)
    return (
        f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}M{x:.1f} {TOP}V{HEIGHT - BOTTOM}"/>'
        f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{level:.1f}</text>'
        f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 15}" text-anchor="middle">{level:.1f}</text>'
    )


def _few(recall: np.ndarray, precision: np.ndarray) -> list[tuple[float, float]]:
    """Up to four points along the curve, for those who hear it."""
    chosen = np.unique(np.linspace(0, max(recall.size - 1, 0), 4).astype(int))[: recall.size]
    return [(float(recall[i]), float(precision[i])) for i in chosen]
