"""Kinds of node features: for each a function from a shape to what codes are made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from spem.codes.bands import Bands
from spem.codes.features import node_features, sweep_bands
from spem.codes.settings import Features, Settings
from spem.codes.spectral import shape_spectrum, spectral_features
from spem.shapes.shape import Shape

Maker = Callable[[Shape, Settings, int | None], Bands]


def shape_features(shape: Shape, settings: Settings, threads: int | None = None) -> Bands:
    """Compute the node features that the settings name.

    Parameters
    ----------
    shape
        The shape.
    settings
        Kind of features, and what belongs to it.
    threads
        Threads for a large shape, where the kind can use them; the outcome does not depend on it.

    Returns
    -------
    tuple
        For each band ``(n_nodes, n_maps)`` in float32, over the same nodes: all, or those off the boundary.

    Raises
    ------
    ShapeError
        When no node is left without the boundary.
    ParameterError
        When the shape is too small for these features.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> shape = disk(radius=10.0, spacing=1.0)
    >>> [shape_features(shape, Settings(features=kind))[0].shape[1] for kind in ("spem", "hks")]
    [8, 8]
    """
    return KINDS[settings.features](shape, settings, threads)


def _maps(shape: Shape, settings: Settings, threads: int | None) -> Bands:
    """Return the SPEM maps of each band of ρ."""
    return node_features(sweep_bands(shape, settings, threads), settings)


def _signatures(shape: Shape, settings: Settings, _: int | None) -> Bands:
    """Return a signature of the spectrum."""
    return spectral_features(shape_spectrum(shape, settings), settings)


# Another kind takes a word in `settings.Features`, its own settings in `settings.OWN_SETTINGS`, a row here.
KINDS: Mapping[Features, Maker] = MappingProxyType(
    {"spem": _maps, "hks": _signatures, "si-hks": _signatures, "wks": _signatures}
)
