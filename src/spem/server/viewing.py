"""Views of shapes: computed in worker processes, packed, and kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from spem.errors import SandboxError, SpemError
from spem.index.row import Row
from spem.server.arrays import pack_arrays
from spem.server.cache import Cache
from spem.server.lanes import Lane
from spem.server.refusals import Busy, Refusal
from spem.server.sandbox import Sandbox


class Viewing:
    """Bodies of views.

    Parameters
    ----------
    sandbox
        Where they are computed.
    cache
        Where they are kept.
    lane
        Threads that wait for the sandbox.
    """

    def __init__(self, sandbox: Sandbox, cache: Cache, lane: Lane) -> None:
        self._sandbox, self._cache, self._lane = sandbox, cache, lane

    async def body(
        self, model: str, key: str, view: str, options: dict[str, Any], read: Callable[[], Row]
    ) -> bytes:
        """Return a view of a shape.

        Parameters
        ----------
        model, key
            Digest of the model and id of the shape; the id holds a hash, so that it tells contents apart.
        view, options
            Name of the view, and its options.
        read
            Called for the row, with its packed shape, where the view is not kept.

        Raises
        ------
        Refusal
            When the row keeps no shape, or the view needs more than the limits.
        """
        name = (model, key, view, *sorted(options.items()))
        return await self._cache.get(name, lambda: self._lane.run(self._compute, key, view, options, read))

    def _compute(self, key: str, view: str, options: dict[str, Any], read: Callable[[], Row]) -> bytes:
        """Compute a view."""
        row = read()
        found, arrays = self.run("view", {"view": view, "name": row.name, **options}, packed_shape(row))
        return pack_arrays({**found, "id": key, "name": row.name}, arrays)

    def run(self, task: str, header: dict[str, Any], payload: bytes) -> tuple[dict[str, Any], Any]:
        """Run a task in the sandbox; a task over its limits is refused as one that cannot be done.

        Raises
        ------
        Refusal
            When it was stopped.
        """
        try:
            return self._sandbox.run(task, header, payload)
        except SandboxError as error:
            if error.reason == "closed":
                raise Busy(str(error), 5.0) from error
            raise Refusal(422, f"{header.get('name', 'shape')}: {error}") from error
        except SpemError as error:
            raise Refusal(422, str(error)) from error


def packed_shape(row: Row) -> bytes:
    """Return the shape of a row as it is packed.

    Raises
    ------
    Refusal
        When the index keeps none.
    """
    if not row.shape:
        raise Refusal(404, "the index keeps no shape of this row; add its file again with shapes kept")
    return row.shape
