"""Node features of the surface of a solid: signatures of the heat and of the wave equation on it (3.3)."""

from __future__ import annotations

import numpy as np

from spem.codes.bands import Bands
from spem.codes.settings import Settings
from spem.codes.spectral import signature
from spem.fields.surface_spectrum import SurfaceSpectrum, solve_surface_spectrum
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.remeshing import decimate
from spem.shapes.shape import Shape
from spem.shapes.surface_points import spread_points

# Points spread over each surface. A thousand tell shapes apart as well, but codes of one surface under two
# meshes would differ by as much as those of two poses.
N_POINTS = 4000
# Finer surfaces are decimated, or a solution would take seconds; a code changes by as much as with the pose.
MOST_VERTICES = 3000


def surface_features(shape: Shape, settings: Settings, threads: int | None = None) -> Bands:
    """Compute the signature that the settings name at points spread evenly over the surface of a solid.

    Parameters
    ----------
    shape
        A shape of three dimensions; its surface is that of `boundary_surface`, decimated where it is fine.
    settings
        Kind ``"surface-hks"``, ``"surface-si-hks"`` or ``"surface-wks"``, number of pairs and of features.
    threads
        Without effect: the solution is of one thread.

    Returns
    -------
    tuple
        One band, ``(n_points, n_maps)`` in float32.

    Raises
    ------
    ShapeError
        When the shape is not of three dimensions, or its surface has no area.
    ConvergenceError
        When the eigenvalue iteration stops short.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball
    >>> settings = Settings(features="surface-wks", n_pairs=40)
    >>> len(surface_features(ball(radius=6.0, spacing=1.0), settings)[0])
    4000
    """
    surface = decimate(boundary_surface(shape), MOST_VERTICES)
    spectrum = solve_surface_spectrum(surface, settings.n_pairs, name=shape.name)
    return sampled_signature(spectrum, settings)


def sampled_signature(spectrum: SurfaceSpectrum, settings: Settings) -> Bands:
    """Compute the signature that the settings name at points spread evenly over a surface.

    A mesh has many vertices where it is curved and few where it is flat; codes sum over nodes, so that these
    must stand for equal areas.

    Parameters
    ----------
    spectrum
        Eigenpairs of the surface.
    settings
        Kind of features, number of pairs that all surfaces have, and of features.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball
    >>> sphere = boundary_surface(ball(radius=6.0, spacing=1.0))
    >>> settings = Settings(features="surface-hks", n_pairs=40, n_maps=5)
    >>> sampled_signature(solve_surface_spectrum(sphere, 40), settings)[0].shape
    (4000, 5)
    """
    values = signature(spectrum, settings.features.removeprefix("surface-"), settings)
    points = spread_points(spectrum.surface, N_POINTS)
    return (np.ascontiguousarray(points.interpolate(values), np.float32),)
