"""Tapered capsules, the convex hulls of two balls, and the level function of their union."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Capsules:
    """A union of tapered capsules.

    Parameters
    ----------
    start, end
        ``(n, d)`` centres of the two balls of each capsule.
    radius
        ``(n, 2)`` their radii.

    Examples
    --------
    >>> one = Capsules(np.zeros((1, 2)), np.array([[2.0, 0.0]]), np.array([[0.5, 0.5]]))
    >>> one.level(np.array([[1.0, 0.0], [1.0, 1.5], [3.0, 0.0]]), reach=9.0).tolist()
    [0.5, -1.0, -0.5]
    """

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    radius: NDArray[np.float64]

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners ``(d,)`` of the box around the union."""
        low, high = self._boxes()
        return low.min(axis=0), high.max(axis=0)

    def level(self, points: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
        """Return the depth of points in the deepest capsule: minus the signed distance to it.

        Parameters
        ----------
        points
            ``(m, d)`` coordinates.
        reach
            Distances outside are exact up to here and end here.

        Returns
        -------
        numpy.ndarray
            ``(m,)`` positive inside.
        """
        depth = np.full(len(points), -reach)
        if not len(points):
            return depth
        columns = np.ascontiguousarray(points.T)
        low, high = self._boxes()
        low, high = low - reach, high + reach
        near = np.flatnonzero(np.all((low <= columns.max(axis=1)) & (high >= columns.min(axis=1)), axis=1))
        close = np.ones((near.size, len(points)), bool)
        for column, lower, upper in zip(columns, low[near].T, high[near].T, strict=True):
            close &= (column >= lower[:, None]) & (column <= upper[:, None])
        capsule, point = np.nonzero(close)
        np.maximum.at(depth, point, self._depth(near[capsule], columns[:, point]))
        return depth

    def deepest(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the capsule ``(m,)`` that each of the points ``(m, d)`` is deepest in, the first of equals.

        Examples
        --------
        >>> apart = Capsules(np.array([[0.0], [9.0]]), np.array([[1.0], [9.5]]), np.ones((2, 2)))
        >>> apart.deepest(np.array([[8.2], [0.5]])).tolist()
        [1, 0]
        """
        columns = np.ascontiguousarray(points.T)
        number = np.arange(len(points))
        depth = [self._depth(np.full_like(number, capsule), columns) for capsule in range(len(self.start))]
        return np.asarray(np.argmax(depth, axis=0))

    def spheres(self, per_capsule: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return centres ``(n * k, d)`` and radii ``(n * k,)`` of balls along the capsules."""
        t = np.linspace(0, 1, per_capsule)
        centre = self.start[:, None] + t[:, None] * (self.end - self.start)[:, None]
        radius = self.radius[:, :1] + t * (self.radius[:, 1:] - self.radius[:, :1])
        return centre.reshape(-1, self.start.shape[1]), radius.ravel()

    def _boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners ``(n, d)`` of the box around each capsule."""
        first, last = self.radius[:, :1], self.radius[:, 1:]
        low = np.minimum(self.start - first, self.end - last)
        return low, np.maximum(self.start + first, self.end + last)

    def _depth(self, of: NDArray[np.int64], columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the depth of points ``(d, m)``, each in one capsule ``(m,)``.

        The depth is the largest, over the balls between the two, of radius minus distance to the
        centre; that is concave along the axis, with its maximum in closed form.
        """
        axis = self.end - self.start
        length = np.maximum(np.linalg.norm(axis, axis=1), np.finfo(float).tiny)
        rise = np.diff(self.radius, axis=1)[:, 0] / length
        slope = np.where(np.abs(rise) < 1, rise, 0.0)
        lean = slope / np.sqrt(1 - slope**2)
        # Where one ball holds the other, its centre is the only place on the axis that counts.
        least, most = np.where(rise >= 1, length, 0.0), np.where(rise <= -1, 0.0, length)
        direction = axis / length[:, None]
        along, square = np.zeros(of.size), np.zeros(of.size)
        for column, start, unit in zip(columns, self.start.T, direction.T, strict=True):
            to = column - start[of]
            along += to * unit[of]
            square += to * to
        aside = np.sqrt(np.maximum(square - along**2, 0.0))
        best = np.minimum(np.maximum(along + aside * lean[of], least[of]), most[of])
        depth = self.radius[of, 0] + rise[of] * best - np.sqrt((along - best) ** 2 + aside**2)
        return np.asarray(depth)
