"""Signatures of the heat and of the wave equation on the nodes of a shape or of its surface (3.3)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.embedding.heat import positive
from spem.errors import ParameterError, require_kind
from spem.fields.spectrum import Eigenpairs, Spectrum

Array = NDArray[np.float64]
# exp(-λ t) is 1e-4 at t = 4 ln 10 / λ: heat of that value is spent.
_SPENT = 4 * math.log(10)
# Steps of the logarithmic time of the scale-invariant signature for each factor of two, as published.
_PER_OCTAVE = 16
# Before this share of the time in which heat of the last value is spent, the pairs at hand show no change.
_EARLY = 0.01
# The span of the logarithms of the eigenvalues holds as many deviations σ of the wave kernel: seven steps of
# a hundred energies that keep 2σ from its ends, as published.
_DEVIATIONS = 18.0


def heat_kernel_signature(
    spectrum: Eigenpairs, times: ArrayLike | None = None, *, n_times: int = 100
) -> Array:
    """Return how much heat stays at each node, for each of several times: p_t(x, x).

    Parameters
    ----------
    spectrum
        Eigenpairs of a shape, with a free boundary those of the volumetric signature; or of a surface.
    times
        ``(n_times,)`` t, in length²; by default spread logarithmically from 4 ln 10 / λ of the last pair to
        that of the first one above zero. Take `shared_values` for times that shapes have in common.
    n_times
        How many by default.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_times)`` in 1/length^d.

    Raises
    ------
    ParameterError
        When a time is not positive, or the spectrum has no two values above zero.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> heat_kernel_signature(spem.solve_spectrum(disk), n_times=5).shape == (disk.n_nodes, 5)
    True
    """
    if times is None:
        low, high = _span(spectrum)
        times = np.geomspace(_SPENT / high, _SPENT / low, _count("n_times", n_times))
    decay = np.exp(-np.outer(spectrum.values, positive(times, "times")))
    return np.asarray(np.square(spectrum.vectors) @ decay)


def scale_invariant_signature(
    spectrum: Eigenpairs, n_frequencies: int = 6, *, span: tuple[float, float] | None = None
) -> Array:
    """Return the heat kernel signature without the effect of scale: |F(∂ log h / ∂ log t)|.

    A shape scaled by c has the signature h at t/c², times c^(−d). Over logarithmic time that is a shift and,
    after the logarithm, a constant: a derivative removes the one, the modulus of a Fourier transform the
    other. With an absorbing boundary values are counted from the first, lest heat dies out.

    Parameters
    ----------
    spectrum
        Eigenpairs of a shape, or of a surface.
    n_frequencies
        How many of the lowest frequencies are kept.
    span
        Lowest and highest eigenvalue that set the range of time, from a hundredth of the time in which heat
        of the highest is spent to that of the lowest; by default the first above zero and the last. Take the
        ends of `shared_values` for shapes of a collection.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_frequencies)``, without a unit.

    Raises
    ------
    ParameterError
        When more frequencies are asked for than the range of time has, or it is no range.

    Examples
    --------
    >>> import spem
    >>> small, large = (spem.synthetic.disk(radius=10.0 * s, spacing=s) for s in (1.0, 3.0))
    >>> one, two = (scale_invariant_signature(spem.solve_spectrum(disk)) for disk in (small, large))
    >>> bool(np.allclose(one, two))
    True
    """
    ends = positive(_span(spectrum) if span is None else span, "span")
    if ends.size != 2:
        msg = f"span={span!r}: expected the lowest and the highest eigenvalue"
        raise ParameterError(msg)
    low, high = ends
    octaves = math.log2(high / low / _EARLY) if high > low else 0.0
    steps = int(_PER_OCTAVE * octaves) + 1
    _count("n_frequencies", n_frequencies, (steps - 1) // 2)
    times = np.geomspace(_EARLY * _SPENT / high, _SPENT / low, steps)
    decay = np.exp(-np.outer(spectrum.values - spectrum.values[0], times))
    heat = np.square(spectrum.vectors) @ decay
    # a component of which there is no pair has no heat at any time
    slope = np.diff(np.log(np.maximum(heat, np.finfo(np.float64).tiny)), axis=1)
    return np.abs(np.fft.rfft(slope, axis=1)[:, :n_frequencies])


def wave_kernel_signature(
    spectrum: Eigenpairs,
    energies: ArrayLike | None = None,
    *,
    n_energies: int = 100,
    deviation: float | None = None,
) -> Array:
    """Return how likely a quantum particle of each of several energies is at each node, over all time.

    W(x, e) = Σ φ_k(x)² w_k(e) / Σ w_k(e) with w_k(e) = exp(−(log e − log λ_k)² / 2σ²), over λ_k > 0.

    Parameters
    ----------
    spectrum
        Eigenpairs of a shape, or of a surface.
    energies
        ``(n_energies,)`` e, in 1/length² as the eigenvalues are; by default spread logarithmically over those
        above zero, 2σ from the ends. Take `shared_values` for energies that shapes have in common.
    n_energies
        How many by default.
    deviation
        σ of log e; by default an eighteenth of the span of log λ, as published for a hundred energies.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_energies)`` in 1/length^d.

    Raises
    ------
    ParameterError
        When an energy or the deviation is not positive, or the spectrum has no two values above zero.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> wave_kernel_signature(spem.solve_spectrum(disk), n_energies=5).shape == (disk.n_nodes, 5)
    True
    """
    low, high = np.log(_span(spectrum))
    sigma = (high - low) / _DEVIATIONS if deviation is None else positive([deviation], "deviation")[0]
    if energies is None:
        energies = np.exp(np.linspace(low + 2 * sigma, high - 2 * sigma, _count("n_energies", n_energies)))
    excited = _above_zero(spectrum)
    distance = np.log(positive(energies, "energies")) - np.log(spectrum.values[excited])[:, None]
    with np.errstate(over="ignore"):
        exponent = np.maximum(-np.square(distance / sigma) / 2, -np.finfo(np.float64).max)
    # the nearest value counts whole, so that an energy far from all of them does not divide zero by zero
    weight = np.exp(exponent - exponent.max(axis=0))
    return np.asarray(np.square(spectrum.vectors[:, excited]) @ (weight / weight.sum(axis=0)))


def shared_values(size: float, ndim: int, n_pairs: int, count: int) -> Array:
    """Return energies that shapes of a collection have in common, by their size alone.

    They run from 1/L² to half of Weyl's estimate 4π² (n/ω_d)^(2/d) / L² of the n-th eigenvalue, ω_d being the
    volume of the unit ball: near it lie the values of solids, those of plane shapes above.

    Parameters
    ----------
    size
        L, `Shape.size`, or the root of the area of a surface.
    ndim
        Dimension d of the shapes; two of surfaces.
    n_pairs
        Number n of pairs that their spectra have.
    count
        How many energies.

    Returns
    -------
    numpy.ndarray
        ``(count,)`` ascending, in 1/length².

    Raises
    ------
    ParameterError
        When the size is not positive, or a number is below 1.

    Examples
    --------
    >>> shared_values(1.0, 2, 100, 3).round(1).tolist()
    [1.0, 25.1, 628.3]
    """
    positive([size], "size")
    for name, number in {"ndim": ndim, "n_pairs": n_pairs, "count": count}.items():
        _count(name, number)
    ball = math.pi ** (ndim / 2) / math.gamma(ndim / 2 + 1)
    highest = 2 * math.pi**2 * (n_pairs / ball) ** (2 / ndim)
    return np.asarray(np.geomspace(1.0, highest, count) / size**2)


def shared_times(size: float, ndim: int, n_pairs: int, count: int) -> Array:
    """Return times that shapes of a collection have in common, by their size alone.

    They are ln 10 over `shared_values`: at each, heat of that value has fallen to a tenth. The shortest are
    shorter than those of a single shape by default: pairs that are left out would still count there, but they
    are left out of all shapes alike, and codes tell shapes apart better.

    Parameters
    ----------
    size, ndim, n_pairs
        As `shared_values` has them.
    count
        How many times.

    Returns
    -------
    numpy.ndarray
        ``(count,)`` ascending, in length².

    Examples
    --------
    >>> shared_times(1.0, 2, 100, 3).round(3).tolist()
    [0.004, 0.092, 2.303]
    """
    return math.log(10) / shared_values(size, ndim, n_pairs, count)[::-1]


def _above_zero(spectrum: Eigenpairs) -> NDArray[np.bool_]:
    """Select the values that are not those of a constant."""
    return np.asarray(spectrum.values > 1e-9 * spectrum.values[-1])


def _span(spectrum: Any) -> tuple[float, float]:
    """Return the first value above zero and the last."""
    if not isinstance(spectrum, Eigenpairs):
        require_kind(spectrum, Spectrum, "make it: spem.solve_spectrum(shape)")
    values = spectrum.values[_above_zero(spectrum)]
    if values.size < 2 or not values[-1] > values[0]:
        msg = f"{spectrum.name}: no two values above zero among {spectrum.n_pairs}; solve for more pairs"
        raise ParameterError(msg)
    return float(values[0]), float(values[-1])


def _count(name: str, value: Any, largest: int | None = None) -> int:
    """Check how many of something are wanted."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < 1 or (largest is not None and value > largest):
        bounds = "of at least 1" if largest is None else f"from 1 to {largest}"
        msg = f"{name}={value!r} must be a whole number {bounds}"
        raise ParameterError(msg)
    return int(value)
