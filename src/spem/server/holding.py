"""A collection in memory, with the JSON of each shape made once: what lists and searches are written from."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.index.comparison import nearest
from spem.index.extra import require
from spem.index.row import Row
from spem.index.schema import to_row
from spem.index.snapshot import Snapshot
from spem.server.cards import card, to_json
from spem.server.queries import Sort

#: Orders in which the latest or largest comes first.
DESCENDING = ("added", "volume")


class Holding:
    """The rows of a model at one version of its table, in memory.

    Parameters
    ----------
    snapshot
        The codes, and what answers tell of each shape.
    digest
        Digest of the model.
    """

    def __init__(self, snapshot: Snapshot, digest: str) -> None:
        self.snapshot, self._digest = snapshot, digest
        # Written by several threads, each entry always with the same bytes.
        self._cards: dict[int, bytes] = {}

    @property
    def labels(self) -> Any:
        """The column of labels."""
        rows: Any = self.snapshot.rows
        return rows["label"]

    def row(self, key: str) -> Row | None:
        """Return a row without its code, None where there is none."""
        records = self.snapshot.records(self.snapshot.positions([key]))
        return to_row(records[0]) if records else None

    def place(self, key: str) -> int | None:
        """Return the place of a row, None where there is none."""
        places = self.snapshot.positions([key])
        return int(places[0]) if len(places) else None

    def order(self, where: str | None, sort: Sort) -> NDArray[np.intp]:
        """Return the places of the rows that pass a filter, in order; equal ones by id."""
        count = len(self.snapshot.ids)
        places = np.arange(count) if where is None else self.snapshot.matching(where)
        rows: Any = self.snapshot.rows
        keys = rows.select([sort, "id"]).take(places)
        direction = "descending" if sort in DESCENDING else "ascending"
        found = require("pyarrow.compute").sort_indices(keys, [(sort, direction), ("id", "ascending")])
        return np.asarray(places[found.to_numpy()])

    def cards(self, places: NDArray[np.intp]) -> list[bytes]:
        """Return the JSON of the cards of some rows."""
        wanted = places.tolist()
        missing = [place for place in wanted if place not in self._cards]
        if missing:
            for place, record in zip(missing, self.snapshot.records(np.array(missing)), strict=True):
                self._cards[place] = to_json(card(to_row(record)))
        return [self._cards[place] for place in wanted]

    def neighbours(self, query: bytes, code: NDArray[np.float32], k: int, where: str | None) -> bytes:
        """Return the JSON of a ranking.

        Parameters
        ----------
        query
            JSON of the card of the query.
        code
            ``(n_code,)`` its standardised code.
        k
            Number of answers.
        where
            Filter of the answers in the SQL of the database.
        """
        begin = time.perf_counter()
        held = self.snapshot
        among = None if where is None else held.matching(where)
        places, distances = nearest(held.vectors, held.ids, code, k, among)
        answers = b",".join(
            b'{"rank":%d,"distance":%.6f,"shape":%b}' % (rank, distance, shape)
            for rank, (distance, shape) in enumerate(zip(distances, self.cards(places), strict=True), 1)
        )
        seconds = time.perf_counter() - begin
        head = b'{"query":%b,"method":"exact","model":"%b","seconds":%.6f,"answers":['
        return head % (query, self._digest.encode(), seconds) + answers + b"]}"

    def page(self, order: NDArray[np.intp], offset: int, limit: int) -> bytes:
        """Return the JSON of a page of cards."""
        shapes = b",".join(self.cards(order[offset : offset + limit]))
        return b'{"total":%d,"shapes":[%b]}' % (len(order), shapes)
