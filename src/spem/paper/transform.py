"""What Doob's transform does to a walk: figures and pictures (3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from spem.fields.gradients import log_gradient
from spem.fields.walks.conditioned import arriving_walk, drift, network_laplacian, transform_walk
from spem.fields.walks.killed import Walk, killed_walk
from spem.fields.walks.paths import sample_paths
from spem.plots.fields import draw_outline
from spem.plots.streams import draw_directions, draw_streamlines
from spem.plots.style import COLOURS, bare, framed, length_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Walks that are drawn in each panel, and arrows across a shape.
_PATHS = 5
_ARROWS = 22


def measure_transform(walk: Walk, to_source: Walk) -> dict[str, float]:
    """Measure how far a conditioned walk is what (3.3) says, on the nodes away from the surface.

    Parameters
    ----------
    walk
        A killed walk.
    to_source
        The walk conditioned on ending in a source.

    Returns
    -------
    figures
        Largest relative difference of both sides of (3.3) as matrices; the largest chance to be killed of
        walks with h = v, of a source, 1 and √v; the drift against 2 ∇(log v), relative to its largest, and
        that of ρ = ∞ in 1 over a voxel; greatest over least mean square of a step along the axes.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> walk = killed_walk(disk(4.0, 1.0), 3.0)
    >>> measure_transform(walk, arriving_walk(walk))["identity"] < 1e-12
    True
    """
    arriving = arriving_walk(walk)
    free = drift(arriving_walk(killed_walk(walk.system, np.inf)))
    inner = (walk.system.domain.neighbours < walk.n_nodes).all(axis=1)
    exact = 2 * log_gradient(walk.system, arriving.log_h, log_boundary=0.0)
    step = arriving.probability[:, ::2] + arriving.probability[:, 1::2]
    square = (step * np.square(walk.system.shape.spacing))[inner]
    return {
        "identity": _identity_error(arriving),
        "killed, h = v": float(np.abs(arriving.killing).max()),
        "killed, h of a source": float(np.abs(to_source.killing).max()),
        "killed, h = 1": float(walk.killing.max()),
        "killed, h = sqrt v": float(np.abs(transform_walk(walk, arriving.log_h / 2).killing).max()),
        "drift": float(np.abs(drift(arriving) - exact)[inner].max() / np.abs(exact).max()),
        "drift, rho inf": float(np.abs(free)[inner].max()) * min(walk.system.shape.spacing),
        "spread": float((square.max(axis=1) / square.min(axis=1)).max()),
    }


def sampled_times(
    walks: Sequence[Walk], start: int, n_paths: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the mean time of walks that are let go, and its standard error.

    Parameters
    ----------
    walks
        Conditioned walks.
    start
        Where they start.
    n_paths
        How many of each.
    rng
        Randomness.

    Returns
    -------
    times
        ``(n_walks, 2)`` mean and standard error, in units of length².

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(1)), np.inf, boundary="voxel")
    >>> sampled_times([walk], 0, 10, np.random.default_rng(0)).tolist()
    [[0.5, 0.0]]
    """
    result = np.empty((len(walks), 2))
    for i, walk in enumerate(walks):
        wait = walk.system.mass / walk.rate
        times = np.array([wait[path.nodes].sum() for path in sample_paths(walk, start, n_paths, rng)])
        result[i] = times.mean(), times.std() / np.sqrt(n_paths)
    return result


def figure_paths(walks: Mapping[str, Walk], start: int, rng: np.random.Generator) -> Figure:
    """Draw a few walks of each kind from one node of a two-dimensional shape.

    Parameters
    ----------
    walks
        By title.
    start
        Where they start.
    rng
        Randomness.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> walk = killed_walk(disk(4.0, 1.0), 3.0)
    >>> figure_paths({"killed": walk}, 20, np.random.default_rng(0)).axes[0].get_title()
    'killed'
    """
    figure = new_figure(2.5 * len(walks), 3.2)
    for ax, (title, walk) in zip(
        figure.subplots(1, len(walks), squeeze=False)[0], walks.items(), strict=True
    ):
        shape = walk.system.shape
        draw_outline(shape, ax, width=0.8)
        for path, colour in zip(sample_paths(walk, start, _PATHS, rng), COLOURS, strict=False):
            draw_streamlines(shape, [path.points], ax, colour=colour, width=0.6)
            ax.plot(*path.points[-1][::-1], "o" if path.arrived else "x", color=colour, markersize=4)
        ax.plot(*shape.points[start][::-1], "o", color="black", markersize=4)
        bare(ax, title)
    return figure


def figure_bias(
    arriving: Walk,
    start: int,
    rho: NDArray[np.float64],
    times: NDArray[np.float64],
    counted: NDArray[np.float64],
) -> Figure:
    """Draw the drift of one walk, and the mean time of walks of every ρ.

    Parameters
    ----------
    arriving
        The walk conditioned on arriving, on a two-dimensional shape, whose drift is drawn.
    start
        The node whose times are drawn.
    rho
        ``(n,)`` screening lengths.
    times
        ``(n,)`` mean times that were solved for.
    counted
        ``(n, 2)`` those of walks, with their standard errors.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> walk = arriving_walk(killed_walk(disk(4.0, 1.0), 3.0))
    >>> len(figure_bias(walk, 20, np.array([1.0, 2.0]), np.ones(2), np.ones((2, 2))).axes)
    2
    """
    shape = arriving.system.shape
    figure = new_figure(7.0, 3.3)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.3))
    scaled = drift(arriving) * arriving.rho / 2
    scaled /= np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1.0)
    draw_outline(shape, left, width=0.8)
    draw_directions(shape, scaled, left, every=max(1, max(shape.mask.shape) // _ARROWS))
    bare(left, f"∇ log v, ρ = {arriving.rho:.3g}")
    left.plot(*shape.points[start][::-1], "o", color="black", markersize=4)
    right.plot(rho, times, color=COLOURS[0], label="solved for")
    right.errorbar(
        rho,
        counted[:, 0],
        2.6 * counted[:, 1],
        fmt="o",
        color=COLOURS[1],
        capsize=3,
        markersize=4,
        label="walks",
    )
    length_axis(right)
    right.legend(fontsize=7, frameon=False)
    framed(right, "ρ (pixels)", "mean time to arrive (pixels²)")
    return figure


def _identity_error(walk: Walk) -> float:
    """Largest difference of 1/h ∘ M⁻¹(A + M/ρ²) ∘ h and the network's Laplacian, over the largest entry."""
    h, system = np.exp(walk.log_h), walk.system
    middle = scipy.sparse.diags_array(1 / system.mass) @ system.matrix(walk.rho**-2.0)
    left = scipy.sparse.diags_array(1 / h) @ middle @ scipy.sparse.diags_array(h)
    return float(abs(left - network_laplacian(walk)).max() / abs(left).max())
