"""Which rows of a level the nodes of a batch of systems have: by system, by colour, in whole tiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from spem.errors import SizeError
from spem.fields.solvers.cuda.runtime import TILE, Runtime

Colour = Literal["all", "red", "black"]


@dataclass(frozen=True, eq=False)
class Layout:
    """Rows of one level: those of system 0, red then black, those of system 1, ...

    Each colour of each system fills whole tiles, the last one up with padding rows, so that no tile holds two
    systems or two colours.

    Parameters
    ----------
    n_rows
        Number of rows, a multiple of `TILE`; the dummy row of vectors comes after them.
    first_tile
        ``(n_systems + 1,)`` tiles of system b are ``first_tile[b]`` to ``first_tile[b + 1] - 1``.
    middle_tile
        ``(n_systems,)`` of these the ones before it are red, from it on black.
    tile_system
        ``(n_tiles,)`` int32 on the device: the system of each tile.
    counts
        ``(n_systems, 2)`` number of red and of black nodes; they stand before the padding of their colour.
    """

    n_rows: int
    first_tile: NDArray[np.int64]
    middle_tile: NDArray[np.int64]
    tile_system: Any
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, counts: NDArray[np.int64], runtime: Runtime) -> Layout:
        """Lay out ``(n_systems, 2)`` numbers of red and of black nodes.

        Raises
        ------
        SizeError
            When the rows are too many for their 32-bit numbers.
        """
        tiles = -(-counts // TILE)
        ends = np.cumsum(tiles)
        n_rows = int(ends[-1]) * TILE
        if n_rows >= np.iinfo(np.int32).max:
            msg = (
                f"a batch of {counts.sum():,} nodes takes {n_rows:,} rows, expected fewer than 2**31; "
                "make batches smaller"
            )
            raise SizeError(msg)
        system = np.repeat(np.arange(len(counts), dtype=np.int32), tiles.sum(axis=1))
        first = np.concatenate([np.zeros(1, np.int64), ends[1::2]])
        return cls(n_rows, first, ends[0::2], runtime.upload(system), counts)

    @property
    def first_row(self) -> NDArray[np.int64]:
        """``(n_systems, 2)`` first red and first black row of each system."""
        return np.stack([self.first_tile[:-1], self.middle_tile], axis=1) * TILE

    def tiles(self, active: NDArray[np.bool_], colour: Colour = "all") -> NDArray[np.int32]:
        """List the tiles of some systems, in ascending order.

        Parameters
        ----------
        active
            ``(n_systems,)`` whether the tiles of each system are wanted.
        colour
            Which of their tiles.

        Examples
        --------
        >>> layout = Layout(5 * TILE, np.array([0, 3, 5]), np.array([2, 4]), None, np.full((2, 2), 100))
        >>> layout.tiles(np.array([True, True]), "red")
        array([0, 1, 3], dtype=int32)
        >>> layout.tiles(np.array([False, True]))
        array([3, 4], dtype=int32)
        """
        first, last = self.first_tile[:-1], self.first_tile[1:]
        if colour == "red":
            last = self.middle_tile
        elif colour == "black":
            first = self.middle_tile
        first, sizes = first[active], (last - first)[active]
        skipped = np.repeat(first - (np.cumsum(sizes) - sizes), sizes)
        return (skipped + np.arange(skipped.size)).astype(np.int32)
