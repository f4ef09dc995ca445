"""Kinds of node features: for each a function from a shape to what codes are made of."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType

from spem.codes.bands import Bands
from spem.codes.contour_features import contour_features
from spem.codes.features import node_features, sweep_bands
from spem.codes.settings import Settings
from spem.codes.source_features import source_features
from spem.codes.spectral import shape_spectrum, spectral_features
from spem.codes.surface_features import surface_features
from spem.errors import ParameterError
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
        For each band ``(n_nodes, n_maps)`` in float32, kind after kind; those of one kind are over the same
        nodes, pixels or voxels (all, or those off the boundary), points of the surface, or points or arcs of
        the contour.

    Raises
    ------
    ShapeError
        When no node is left without the boundary.
    ParameterError
        When the shape is too small for these features, or there are none for its dimension.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> shape = disk(radius=10.0, spacing=1.0)
    >>> [shape_features(shape, Settings(features=kind))[0].shape[1] for kind in ("spem", "hks")]
    [8, 8]
    """
    return tuple(band for bands in kind_features(shape, settings, threads) for band in bands or ())


def kind_features(
    shape: Shape, settings: Settings, threads: int | None = None, *, later: Collection[str] = ()
) -> tuple[Bands | None, ...]:
    """Compute the node features of each kind apart, as `shape_features` takes its arguments.

    Parameters
    ----------
    later
        Kinds that are made elsewhere, for which None is returned.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> kind_features(disk(radius=10.0, spacing=1.0), Settings(features="spem"), later=["spem"])
    (None,)
    """
    try:
        parts = settings.parts(shape.ndim)
    except ParameterError as error:
        msg = f"{shape.name}: {error}"
        raise ParameterError(msg) from error
    return tuple(
        None if part.features in later else KINDS[part.features](shape, part, threads) for part in parts
    )


def _maps(shape: Shape, settings: Settings, threads: int | None) -> Bands:
    """Return the SPEM maps of each band of ρ."""
    return node_features(sweep_bands(shape, settings, threads), settings)


def _signatures(shape: Shape, settings: Settings, _: int | None) -> Bands:
    """Return a signature of the spectrum."""
    return spectral_features(shape_spectrum(shape, settings), settings)


# Another kind takes a row in `spem.codes.traits.TRAITS`, and one here.
KINDS: Mapping[str, Maker] = MappingProxyType(
    {
        "spem": _maps,
        **dict.fromkeys(("hks", "si-hks", "wks"), _signatures),
        **dict.fromkeys(("surface-hks", "surface-si-hks", "surface-wks"), surface_features),
        "sources": source_features,
        **dict.fromkeys(("shape-context", "inner-distance"), contour_features),
    }
)
