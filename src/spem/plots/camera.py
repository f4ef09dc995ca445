"""Orthographic views of three-dimensional shapes, and how high pictures are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from spem.errors import ParameterError

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

    View: TypeAlias = tuple[float, float] | NDArray[np.float64]

# Free border of a picture on each side, as a fraction of it.
MARGIN = 0.03
# How far principal views are turned off the axes, in degrees, to show depth.
TILT = (18.0, -24.0)


@dataclass(frozen=True, eq=False)
class Camera:
    """An orthographic view of three-dimensional points.

    Parameters
    ----------
    rotation
        ``(3, 3)``; its rows point right, up and toward the viewer.
    scale
        Pixels per unit of length.
    shift
        ``(2,)`` pixel (x right, y down) where the rotated origin lies.
    size
        Width and height of the picture in pixels.
    """

    rotation: NDArray[np.float64]
    scale: float
    shift: NDArray[np.float64]
    size: tuple[int, int]

    @classmethod
    def fit(cls, points: ArrayLike, view: View, size: tuple[int, int]) -> Camera:
        """Return the camera that fills a picture of `size` (width, height) with the points.

        Parameters
        ----------
        points
            ``(n, 3)`` coordinates.
        view
            Elevation and azimuth in degrees, as in Matplotlib (axis 2 up), or a rotation ``(3, 3)``
            whose rows point right, up and toward the viewer.
        size
            Width and height in pixels.

        Examples
        --------
        >>> camera = Camera.fit([[0.0, 0, 0], [1, 1, 1]], (0, 0), (100, 100))
        >>> camera.rotation[2].tolist(), camera.scale
        ([1.0, 0.0, 0.0], 94.0)
        """
        rotation = view_rotation(view)
        turned = np.asarray(points, np.float64) @ rotation[:2].T
        low, high = turned.min(axis=0), turned.max(axis=0)
        room = np.asarray(size, np.float64) * (1 - 2 * MARGIN)
        scale = float(np.min(room / np.maximum(high - low, 1e-300)))
        middle = (low + high) / 2 * scale * [1, -1]
        return cls(rotation, scale, np.asarray(size) / 2 - middle, size)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return ``(n, 3)``: x right and y down in pixels, and height toward the viewer in pixels.

        Examples
        --------
        >>> camera = Camera.fit([[0.0, 0, 0], [1, 1, 1]], (0, 0), (100, 100))
        >>> camera.project([[0.5, 0.5, 0.5]])[0, :2].tolist()
        [50.0, 50.0]
        """
        turned = np.asarray(points, np.float64) @ self.rotation.T * self.scale
        turned[:, 0] += self.shift[0]
        turned[:, 1] = self.shift[1] - turned[:, 1]
        return turned


def view_rotation(view: View) -> NDArray[np.float64]:
    """Return the rotation whose rows point right, up and toward the viewer.

    Parameters
    ----------
    view
        Elevation and azimuth in degrees (axis 2 up), or such a rotation itself.

    Raises
    ------
    ParameterError
        If `view` is neither.

    Examples
    --------
    >>> view_rotation((90, -90)).round(3)[2].tolist()
    [0.0, -0.0, 1.0]
    """
    given = np.asarray(view, np.float64)
    if given.shape == (3, 3):
        return given
    if given.shape != (2,):
        msg = f"view is (elevation, azimuth) in degrees or a (3, 3) rotation, not an array of {given.shape}"
        raise ParameterError(msg)
    elevation, azimuth = np.deg2rad(given)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0])
    toward = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    return np.stack([right, np.cross(toward, right), toward])


def view_aspect(points: ArrayLike, view: View) -> float:
    """Return the height of a set of points over their width, as seen in a view.

    Examples
    --------
    >>> round(view_aspect([[0.0, 0, 0], [1, 2, 1]], (0, 0)), 3)
    0.5
    """
    width, height = np.ptp(np.asarray(points, np.float64) @ view_rotation(view)[:2].T, axis=0)
    return float(height / max(width, 1e-300))


def picture_aspect(shape: Shape, view: View | None = None) -> float:
    """Return the height over the width of the picture of a shape, between one eighth and four.

    Parameters
    ----------
    shape
        A shape of up to three dimensions; of one, it is a band.
    view
        View of a three-dimensional one; its broad side by default.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> picture_aspect(Shape.from_mask(np.ones((2, 6))))
    0.5
    """
    if shape.ndim == 1:
        return 0.125
    if shape.ndim == 2:
        down, right = (n * h for n, h in zip(shape.mask.shape, shape.spacing, strict=True))
        return float(np.clip(down / right, 0.125, 4.0))
    points = shape.points
    seen = view_aspect(points, principal_view(points) if view is None else view)
    return float(np.clip(seen, 0.125, 4.0))


def picture_size(shape: Shape, width: float, view: View | None = None) -> tuple[int, int]:
    """Return the width and height in pixels of the picture of a shape, at least 32 wide.

    Parameters
    ----------
    shape, view
        As for `picture_aspect`.
    width
        Wanted width in pixels.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> picture_size(Shape.from_mask(np.ones((2, 6))), 99.6)
    (100, 50)
    """
    pixels = max(32, round(width))
    return pixels, max(1, round(pixels * picture_aspect(shape, view)))


def principal_view(points: ArrayLike) -> NDArray[np.float64]:
    """Return a view onto the broad side of a set of points, their longest extent to the right.

    Parameters
    ----------
    points
        ``(n, 3)`` coordinates.

    Returns
    -------
    rotation
        ``(3, 3)``; its rows point right, up and toward the viewer.

    Examples
    --------
    >>> box = [[x, y, z] for x in (0, 3) for y in (0, 2) for z in (0, 1)]
    >>> np.abs(principal_view(box)).argmax(axis=1).tolist()
    [0, 1, 2]
    """
    position = np.asarray(points, np.float64)
    covariance = np.cov(position.T, bias=True)
    axes = np.linalg.eigh(covariance)[1].T[::-1]
    strongest = np.take_along_axis(axes, np.abs(axes).argmax(axis=1)[:, None], axis=1)
    right, up = (axes * np.sign(strongest))[:2]
    upright = np.stack([right, up, np.cross(right, up)])
    (sin_e, sin_a), (cos_e, cos_a) = np.sin(np.deg2rad(TILT)), np.cos(np.deg2rad(TILT))
    tilt = np.array([[1, 0, 0], [0, cos_e, -sin_e], [0, sin_e, cos_e]])
    turn = np.array([[cos_a, 0, sin_a], [0, 1, 0], [-sin_a, 0, cos_a]])
    view: NDArray[np.float64] = tilt @ turn @ upright
    return view
