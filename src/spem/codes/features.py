"""Node features of kind "spem": the maps of each band of ρ, all from one sweep of the shape."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.settings import Settings
from spem.embedding.maps import Maps, compute_maps
from spem.errors import ShapeError
from spem.fields.domain import surface_domain
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Shape

# Codes give the weakest maps the weight of the strongest: a sweep to 1e-6 leaves them percents off.
SWEEP_RTOL = 1e-10


def sweep_bands(shape: Shape, settings: Settings, threads: int | None = None) -> Hyperfield:
    """Sweep a shape over the ρ of all bands at once.

    Parameters
    ----------
    shape
        The shape.
    settings
        Bands of ρ, in units of the shape's size, and the boundary.
    threads
        Threads for a large shape, as `Sweep` takes them; the outcome does not depend on it.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> sweep_bands(disk(radius=10.0, spacing=1.0), Settings(features="spem")).rho.size
    64
    """
    system = assemble(shape, settings.boundary)
    return Sweep(rtol=SWEEP_RTOL, threads=threads).hyperfield(system, swept_rho(shape, settings))


def swept_rho(shape: Shape, settings: Settings) -> NDArray[np.float64]:
    """Sample ρ over all bands of a shape at once, in the unit of its spacing.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> ranges = [(0.02, 0.1), (0.1, 0.4)]
    >>> rho = swept_rho(disk(radius=10.0, spacing=1.0), Settings(features="spem", rho_ranges=ranges))
    >>> round(float(rho[-1] / rho[0]), 6)
    20.0
    """
    low, high = (
        pick(bound) for pick, bound in zip((min, max), zip(*settings.rho_ranges, strict=True), strict=True)
    )
    return sample_rho(shape.size, low * shape.size, high * shape.size, max(settings.n_rho, 2), "log")


def band_rho(shape: Shape, settings: Settings, band: int = 0) -> NDArray[np.float64]:
    """Sample ρ of one band of a shape, in the unit of its spacing; see `band_maps`.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> band_rho(disk(radius=10.0, spacing=1.0), Settings(features="spem")).size
    64
    """
    size, (low, high) = shape.size, settings.rho_ranges[band]
    return sample_rho(size, low * size, high * size, settings.n_rho, settings.scheme)


def node_features(field: Hyperfield, settings: Settings) -> Bands:
    """Compute the maps of every band from one hyperfield.

    Parameters
    ----------
    field
        Hyperfield of the shape over the ρ of all bands, as `sweep_bands` makes it.
    settings
        Bands, number of ρ and of maps.

    Returns
    -------
    tuple
        For each band ``(n_nodes, n_maps)`` maps in float32, over the same nodes.

    Raises
    ------
    ShapeError
        When no node is left without the boundary.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> settings = Settings(features="spem", n_maps=4)
    >>> field = sweep_bands(disk(radius=10.0, spacing=1.0), settings)
    >>> [block.shape[1] for block in node_features(field, settings)]
    [4]
    """
    keep = kept_nodes(field.shape, drop_boundary=settings.drop_boundary)
    bands = range(len(settings.rho_ranges))
    values = (band_maps(field, settings, band).values for band in bands)
    return tuple(np.ascontiguousarray(block[keep], np.float32) for block in values)


def band_maps(field: Hyperfield, settings: Settings, band: int = 0) -> Maps:
    """Compute the maps of one band, on all nodes of the shape.

    Parameters
    ----------
    field
        Hyperfield of the shape over the ρ of all bands, as `sweep_bands` makes it.
    settings
        Bands, scheme, number of ρ and of maps.
    band
        Which range of ρ.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> settings = Settings(features="spem")
    >>> band_maps(sweep_bands(disk(radius=10.0, spacing=1.0), settings), settings).rho.size
    64
    """
    rho = band_rho(field.shape, settings, band)
    return compute_maps(replace(field, rho=rho), settings.n_maps, centred=settings.centred)


def kept_nodes(shape: Shape, *, drop_boundary: bool) -> Any:
    """Select all nodes, or those without a boundary edge; an index into arrays of nodes.

    Raises
    ------
    ShapeError
        When no node is left.

    Examples
    --------
    >>> square = Shape.from_mask(np.ones((3, 3)))
    >>> int(kept_nodes(square, drop_boundary=True).sum())
    1
    """
    if not drop_boundary:
        return slice(None)
    inner = (surface_domain(shape).neighbours < shape.n_nodes).all(axis=1)
    if not inner.any():
        msg = f"{shape.name}: every node is next to the boundary; use more voxels or keep the boundary"
        raise ShapeError(msg)
    return inner
