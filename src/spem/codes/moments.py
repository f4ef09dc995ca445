"""Moments of nodal domains (5.4): Hu's seven invariants of where each projection is negative and positive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.random import RandomState
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted

from spem.codes.normalise import unit_rms
from spem.embedding.maps import Maps
from spem.embedding.nodal import Cut, nodal_domains, nodal_thresholds
from spem.errors import ParameterError, ShapeError, require_kind
from spem.shapes.shape import Shape

Compression = Literal["log", "arsinh", "none"]
N_MOMENTS = 7
_ORDER = 3
# Moments of a silhouette run from 1 down to 1e-12, the last ones through zero. Below the one number they
# are taken to be zero by the logarithm; about the other the inverse hyperbolic sine turns linear.
_LOG_FLOOR, _ARSINH_UNIT = 1e-12, 1e-8

_COMPRESS: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {
    "log": lambda moments: -np.sign(moments) * np.log10(np.abs(moments) + _LOG_FLOOR),
    "arsinh": lambda moments: np.arcsinh(moments / _ARSINH_UNIT),
    "none": lambda moments: moments,
}


def hu_moments(
    shape: Shape, nodes: ArrayLike | None = None, *, compression: Compression = "none"
) -> NDArray[np.float64]:
    """Return Hu's seven moments of a silhouette or of a part of it.

    They do not change with place, size and turn; the seventh changes its sign under reflection.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    nodes
        ``(n_nodes,)`` weights of the nodes, or which of them count; all, equally, by default.
    compression
        What is made of moments of very different size: ``"log"`` is −sign(h) log₁₀|h|, the usual one;
        ``"arsinh"`` is arsinh(h / 1e-8), which is as good as a logarithm where h is large and smooth where
        it changes its sign.

    Returns
    -------
    NDArray
        ``(7,)`` moments; zeros for a part without a node.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When `nodes` does not fit the shape, or there is no such compression.

    Examples
    --------
    >>> import numpy as np, spem
    >>> disk = spem.synthetic.disk(radius=30.0, spacing=1.0)
    >>> print(round(float(hu_moments(disk)[0]) * 2 * np.pi, 3))  # the least of all shapes
    1.0
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    weights = np.ones(shape.n_nodes) if nodes is None else np.asarray(nodes, np.float64)
    if weights.shape != (shape.n_nodes,):
        msg = f"{shape.name}: nodes of shape {weights.shape}; expected one weight for each of {shape.n_nodes}"
        raise ParameterError(msg)
    _check_compression(compression)
    return _COMPRESS[compression](_moments(_plane_points(shape), weights[:, None], _cell(shape))[0])


class NodalMoments(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Code silhouettes by the Hu moments of the nodal domains of their maps (5.4).

    `fit` and `transform` take the maps of each shape. Thresholds are in common for all shapes and learnt
    without labels: see `nodal_thresholds`.

    Parameters
    ----------
    unit
        Whether each projection is brought to unit rms over its shape before it is cut.
    at
        Where projections are cut: see `nodal_thresholds`.
    compression
        What is made of moments of very different size: see `hu_moments`.
    nodes_per_shape
        Number of nodes drawn from each shape for the thresholds.
    random_state
        Seed or generator of the draw.

    Attributes
    ----------
    thresholds_
        ``(n_maps, 2)`` negative and positive threshold of each projection.

    Examples
    --------
    >>> import spem
    >>> stars = [spem.maps(spem.synthetic.star_polygon(n, 2), n_maps=4) for n in (5, 7, 9)]
    >>> NodalMoments(random_state=0).fit_transform(stars).shape  # 4 maps, 2 domains, 7 moments
    (3, 56)
    """

    def __init__(
        self,
        *,
        unit: bool = True,
        at: Cut = "means",
        compression: Compression = "arsinh",
        nodes_per_shape: int = 200,
        random_state: int | RandomState | None = None,
    ) -> None:
        self.unit = unit
        self.at = at
        self.compression = compression
        self.nodes_per_shape = nodes_per_shape
        self.random_state = random_state

    def fit(self, X: Sequence[Maps], y: Any = None) -> Self:
        """Learn the thresholds from the maps of the shapes `X`; `y` is ignored."""
        _check_compression(self.compression)
        rng = np.random.default_rng(check_random_state(self.random_state).randint(2**31))
        values = [self._intensities(maps) for maps in X]
        self.thresholds_ = nodal_thresholds(values, at=self.at, nodes_per_shape=self.nodes_per_shape, rng=rng)
        return self

    def transform(self, X: Sequence[Maps]) -> NDArray[np.float64]:
        """Return ``(n_shapes, n_maps * 14)``: of each map the moments of its negative and positive domain."""
        check_is_fitted(self)
        return np.stack([self._code(maps) for maps in X])

    @property
    def _n_features_out(self) -> int:
        """Length of a code, as the naming of the columns asks for it."""
        return len(self.thresholds_) * 2 * N_MOMENTS

    def _intensities(self, maps: Maps) -> NDArray[np.floating[Any]]:
        """Return the projections on the scale on which they are cut."""
        require_kind(maps, Maps, "make them with spem.maps first")
        return unit_rms(maps.values) if self.unit else maps.values

    def _code(self, maps: Maps) -> NDArray[np.float64]:
        """Return the moments of all domains of one shape."""
        domains = nodal_domains(self._intensities(maps), self.thresholds_)
        sides = np.stack([domains < 0, domains > 0], axis=2).reshape(len(domains), -1)
        moments = _moments(_plane_points(maps.shape), sides.astype(np.float64), _cell(maps.shape))
        return _COMPRESS[self.compression](moments).ravel()


def _moments(points: NDArray[np.float64], weights: NDArray[np.float64], cell: float) -> NDArray[np.float64]:
    """Return Hu's moments ``(n_parts, 7)`` of parts with weights ``(n_nodes, n_parts)`` on the nodes."""
    from skimage.measure import moments_hu, moments_normalized

    found = np.zeros((weights.shape[1], N_MOMENTS))
    for part, weight in zip(found, weights.T, strict=True):
        inside = np.flatnonzero(weight)
        if inside.size:
            mass, place = weight[inside] * cell, points[inside]
            x, y = (_powers(axis - mass @ axis / mass.sum()) for axis in place.T)
            part[:] = moments_hu(moments_normalized(x * mass @ y.T, _ORDER))
    return found


def _powers(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the powers of values from 0 to 3, a row each."""
    square = values * values
    return np.stack([np.ones_like(values), values, square, square * values])


def _plane_points(shape: Shape) -> NDArray[np.float64]:
    """Return the nodes of a silhouette."""
    if shape.ndim != 2:
        msg = f"{shape.name}: Hu's moments are of silhouettes; this shape has {shape.ndim} dimensions"
        raise ShapeError(msg)
    return shape.points


def _cell(shape: Shape) -> float:
    """Return the area of a pixel."""
    return float(np.prod(shape.spacing))


def _check_compression(compression: str) -> None:
    """Refuse a compression that there is not."""
    if compression not in get_args(Compression):
        msg = f"compression={compression!r} must be one of {', '.join(get_args(Compression))}"
        raise ParameterError(msg)
