"""A table at one of its versions, and what does not change with it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

from spem.index.approximate import Approximation
from spem.index.store import Store


@dataclass(frozen=True, eq=False)
class Pinned:
    """A table that stays as it is, whatever is written.

    Each call of the database costs a millisecond on a busy machine, so that what several searches need is
    asked once.

    Parameters
    ----------
    table
        The table, checked out.
    version
        Its version.
    """

    table: Any
    version: int

    @classmethod
    def newest(cls, store: Store, digest: str) -> Self:
        """Pin the table of a model at its newest version."""
        table = store.database.open_table(store.table(digest).name)
        version = int(table.version)
        table.checkout(version)
        return cls(table, version)

    @cached_property
    def n_rows(self) -> int:
        """Number of rows."""
        return int(self.table.count_rows())

    @cached_property
    def n_code(self) -> int:
        """Length of the codes."""
        return int(self.table.schema.field("vector").type.list_size)

    @cached_property
    def approximation(self) -> Approximation | None:
        """The approximate index, where there is one."""
        return Approximation.of(self.table)
