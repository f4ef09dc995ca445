"""The discrete field of one source at the end of a straight bar, by separation, in many digits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import mpmath


def bar_logs(counts: Sequence[int], source: Sequence[int], rho: float, digits: int = 60) -> list[mpmath.mpf]:
    """Return the logarithm of v at each node in C order.

    The bar has ``counts`` nodes along its axes, spacing 1 and the ``voxel`` boundary; the source is the
    outside voxel next to the node ``(0, *source)``. The field is the sum, over one sine k for each axis a
    across, of sinh((L + 1 - i) α)/sinh((L + 1) α) times 2/(n_a + 1) sin(πkp/(n_a + 1)) sin(πkj/(n_a + 1)),
    where 2 cosh α = 2 + 1/ρ² + Σ (2 - 2 cos(πk/(n_a + 1))).
    """
    guard = 20
    while True:
        with mpmath.workdps(digits + guard):
            exact, size = _sum(counts, source, rho)
            lost = max(-mpmath.log10(v / s) if v > 0 else guard for v, s in zip(exact, size, strict=True))
            if lost < guard - 10:
                return [mpmath.log(v) for v in exact]
        guard *= 2


def _sum(
    counts: Sequence[int], source: Sequence[int], rho: float
) -> tuple[list[mpmath.mpf], list[mpmath.mpf]]:
    """Sum of the modes, and of their magnitudes."""
    length, *widths = counts
    shift = mpmath.mpf(0) if mpmath.isinf(rho) else 1 / mpmath.mpf(rho) ** 2
    axes = [_modes(n, p + 1) for n, p in zip(widths, source, strict=True)]
    exact, size = ([mpmath.mpf(0)] * (length * math.prod(widths)) for _ in range(2))
    for modes in itertools.product(*axes):
        profile = [mpmath.fprod(values) for values in itertools.product(*(mode[1] for mode in modes))]
        if not any(profile):
            continue
        along = _decay(length, 2 + shift + sum(mode[0] for mode in modes))
        for node, (factor, value) in enumerate(itertools.product(along, profile)):
            term = factor * value
            exact[node] += term
            size[node] += abs(term)
    return exact, size


def _modes(n: int, p: int) -> list[tuple[mpmath.mpf, list[mpmath.mpf]]]:
    """Eigenvalue of each sine along one axis, and its contribution to the nodes."""
    step = mpmath.pi / (n + 1)
    sines = [mpmath.sin(step * k) for k in range(2 * (n + 1))]
    sines[0] = sines[n + 1] = mpmath.mpf(0)
    turn = 2 * (n + 1)
    return [
        (
            2 - 2 * mpmath.cos(step * k),
            [2 * sines[k * p % turn] * sines[k * j % turn] / (n + 1) for j in range(1, n + 1)],
        )
        for k in range(1, n + 1)
    ]


def _decay(length: int, twice_cosh: mpmath.mpf) -> list[mpmath.mpf]:
    """sinh((L + 1 - i) α)/sinh((L + 1) α) for i = 1 to L."""
    ratio = mpmath.exp(-mpmath.acosh(twice_cosh / 2))
    powers = [mpmath.mpf(1)]
    for _ in range(2 * (length + 1)):
        powers.append(powers[-1] * ratio)
    whole = 1 - powers[-1]
    return [powers[i] * (1 - powers[2 * (length + 1 - i)]) / whole for i in range(1, length + 1)]
