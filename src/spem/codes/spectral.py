"""Node features from the spectrum of a shape: signatures of the heat and of the wave equation (3.3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.features import kept_nodes
from spem.codes.settings import Settings
from spem.embedding.signatures import (
    heat_kernel_signature,
    scale_invariant_signature,
    shared_times,
    shared_values,
    wave_kernel_signature,
)
from spem.fields.spectrum import Eigenpairs, Spectrum, solve_spectrum
from spem.shapes.shape import Shape

Array = NDArray[np.float64]
# Below the first value of most surfaces of unit area, and up to Weyl's estimate of the last. Taken by score
# on SHREC'11, better on either half of its classes; joined with maps it makes no difference.
_SURFACE_LOWEST, _SURFACE_BEYOND = 3.0, 2.0


def shape_spectrum(shape: Shape, settings: Settings) -> Spectrum:
    """Solve for the eigenpairs that the features are made of, with a free boundary.

    Parameters
    ----------
    shape
        The shape; with fewer nodes than pairs it has all its pairs.
    settings
        Number of pairs, and the boundary model.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> shape_spectrum(disk(radius=10.0, spacing=1.0), Settings(features="wks", n_pairs=20)).n_pairs
    20
    """
    return solve_spectrum(shape, min(settings.n_pairs, shape.n_nodes), model=settings.boundary)


def spectral_features(spectrum: Spectrum, settings: Settings) -> Bands:
    """Compute the signature that the settings name, at times or energies that all shapes have in common.

    Parameters
    ----------
    spectrum
        Eigenpairs, as `shape_spectrum` finds them.
    settings
        Kind of features, and their number.

    Returns
    -------
    tuple
        One band, ``(n_nodes, n_maps)`` in float32.

    Raises
    ------
    ShapeError
        When no node is left without the boundary.
    ParameterError
        When the shape is too small for a signature, or more features are asked for than it has.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> settings = Settings(features="hks", n_maps=5)
    >>> spectral_features(shape_spectrum(disk(radius=10.0, spacing=1.0), settings), settings)[0].shape[1]
    5
    """
    keep = kept_nodes(spectrum.shape, drop_boundary=settings.drop_boundary)
    values = signature(spectrum, settings.features, settings)
    return (np.ascontiguousarray(values[keep], np.float32),)


def signature(spectrum: Eigenpairs, kind: str, settings: Settings) -> Array:
    """Compute a signature of a solid or of a surface, at times or energies that all of them have in common.

    Parameters
    ----------
    spectrum
        Eigenpairs.
    kind
        ``"hks"``, ``"si-hks"`` or ``"wks"``.
    settings
        Number of pairs that all have, and of features.

    Returns
    -------
    numpy.ndarray
        ``(n_nodes, n_maps)``.

    Examples
    --------
    >>> from spem.fields.surface_spectrum import solve_surface_spectrum
    >>> from spem.shapes.boundary_surface import boundary_surface
    >>> from spem.shapes.synthetic import ball
    >>> sphere = solve_surface_spectrum(boundary_surface(ball(radius=6.0, spacing=1.0)), 40)
    >>> signature(sphere, "wks", Settings(features="surface-wks", n_pairs=40, n_maps=5)).shape[1]
    5
    """
    return _SIGNATURES[kind](spectrum, settings)


def _heat(spectrum: Eigenpairs, settings: Settings) -> Array:
    """Return the HKS at times in units of the squared size."""
    if isinstance(spectrum, Spectrum):
        times = shared_times(spectrum.size, spectrum.ndim, settings.n_pairs, settings.n_maps)
    else:
        times = np.log(10) / _values(spectrum, settings, settings.n_maps)[::-1]
    return heat_kernel_signature(spectrum, times)


def _scale_invariant(spectrum: Eigenpairs, settings: Settings) -> Array:
    """Return the lowest frequencies of the scale-invariant HKS."""
    low, high = _values(spectrum, settings, 2)
    return scale_invariant_signature(spectrum, settings.n_maps, span=(low, high))


def _wave(spectrum: Eigenpairs, settings: Settings) -> Array:
    """Return the WKS at energies in units of the inverse squared size, as wide as they lie apart."""
    energies = _values(spectrum, settings, settings.n_maps + 2)
    return wave_kernel_signature(spectrum, energies[1:-1], deviation=float(np.log(energies[1] / energies[0])))


def _values(spectrum: Eigenpairs, settings: Settings, count: int) -> Array:
    """Return energies that all solids, or all surfaces, have in common."""
    if isinstance(spectrum, Spectrum):
        return shared_values(spectrum.size, spectrum.ndim, settings.n_pairs, count)
    highest = _SURFACE_BEYOND * shared_values(spectrum.size, spectrum.ndim, settings.n_pairs, 2)[-1]
    return np.geomspace(_SURFACE_LOWEST / spectrum.size**2, highest, count)


_SIGNATURES: dict[str, Callable[[Eigenpairs, Settings], Array]] = {
    "hks": _heat,
    "si-hks": _scale_invariant,
    "wks": _wave,
}
