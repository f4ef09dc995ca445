"""The silhouettes of the figures, chosen by number."""

from __future__ import annotations

from dataclasses import replace

from spem.paper.data import INNER_RADIUS, Data, Shapes, Silhouette

# Of the "1000-shape" database: a hand whose fingers stand apart; the first three cats of which opening finds
# legs and tail; a human whose arms and legs do not touch. Of creatures: likewise.
REAL: dict[Silhouette, tuple[int, ...]] = {"hand": (11,), "cat": (1, 2, 3), "human": (6,)}
MADE: dict[Silhouette, tuple[int, ...]] = {"hand": (2,), "cat": (1, 2, 5), "human": (1,)}

# Inner radius in a quick run of what takes long, in pixels.
SMALL = 10.0


def chosen(
    data: Data,
    kind: Silhouette,
    numbers: tuple[int, ...] | None = None,
    *,
    inner_radius: float = INNER_RADIUS,
) -> Shapes:
    """Return the silhouettes of one kind that the figures show.

    Parameters
    ----------
    data
        Where real shapes are.
    kind
        What they are of.
    numbers
        Which ones, from 1; those of the figures by default.
    inner_radius
        Largest distance to the boundary, in pixels.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> [shape.name for shape in chosen(Data(), "hand").shapes]
    ['hand 2']
    """
    real = data.find("tari1000") is not None
    wanted = numbers or (REAL if real else MADE)[kind]
    found = data.silhouettes(kind, max(wanted), inner_radius=inner_radius)
    return replace(found, shapes=tuple(found.shapes[number - 1] for number in wanted))
