"""Times of fields and maps: of one large shape, and of a collection of silhouettes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from spem.api.fields import field, maps, sweep
from spem.codes.workers import run_all
from spem.errors import ParameterError
from spem.paper.data import INNER_RADIUS
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.synthetic import n_ball

N_RHO, N_MAPS = 64, 6


@dataclass(frozen=True)
class Times:
    """Wall-clock seconds, and processor seconds of all threads.

    Parameters
    ----------
    wall
        Seconds by the clock.
    processor
        Seconds of all processors together.
    """

    wall: float
    processor: float


def warm_up() -> None:
    """Compile what will be timed."""
    for d in (2, 3):
        ball = n_ball(1.0, 0.2, d)
        maps(sweep(ball))
        field(ball, 0.3)


def time_maps(shape: Shape) -> Times:
    """Time all fields of the default range, each written out, and the maps of a shape.

    Examples
    --------
    >>> time_maps(n_ball(5.0, 1.0, 2)).wall > 0
    True
    """
    wall, processor = time.perf_counter(), time.process_time()
    hyperfield = sweep(shape, n_rho=N_RHO)
    maps(hyperfield, N_MAPS)
    hyperfield.fields()
    return Times(time.perf_counter() - wall, time.process_time() - processor)


def time_collection(items: Sequence[Path | Shape], processes: int) -> tuple[float, list[float]]:
    """Time the maps of silhouettes, reading included.

    Parameters
    ----------
    items
        Images or shapes.
    processes
        Number of processes, each with one thread.

    Returns
    -------
    total
        Seconds by the clock until all are done, starting processes and compiling included.
    each
        Seconds of each.

    Raises
    ------
    ParameterError
        If one cannot be read.
    """
    start = time.perf_counter()
    each = []
    for item, seconds, reason in run_all(_maps_of, items, processes):
        if seconds is None:
            msg = f"{item}: {reason}"
            raise ParameterError(msg)
        each.append(seconds)
    return time.perf_counter() - start, each


def _maps_of(item: Path | Shape) -> float:
    """Return the seconds of reading and mapping one silhouette."""
    start = time.perf_counter()
    shape = read(item, inner_radius=INNER_RADIUS) if isinstance(item, Path) else item
    rho = np.linspace(2.0, 30.0, N_RHO) * min(shape.spacing)
    maps(shape, N_MAPS, rho=rho)
    return time.perf_counter() - start
