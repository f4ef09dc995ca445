"""Tables that go to a device in pieces."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from backends import missing
from simulator import SimulatedRuntime

from spem.fields.solvers.cuda import uploads
from spem.fields.solvers.cuda.uploads import upload_joined

pytestmark = pytest.mark.skipif(missing("simulated") is not None, reason=str(missing("simulated")))


@pytest.mark.parametrize("width", [(), (6,)])
@pytest.mark.parametrize("lengths", [(5,), (1, 1, 1), (40, 3, 2, 70, 1)])
@pytest.mark.parametrize("limit", [1, 64, 1 << 20])
def test_pieces_are_joined_in_order(
    monkeypatch: pytest.MonkeyPatch, limit: int, lengths: tuple[int, ...], width: tuple[int, ...]
) -> None:
    """The table on the device is that of NumPy, whatever the size of a piece, and no piece is larger."""
    monkeypatch.setattr(uploads, "PIECE_BYTES", limit)
    chance, runtime = np.random.default_rng(0), SimulatedRuntime()
    arrays = [chance.integers(0, 99, (length, *width)).astype(np.int32) for length in lengths]
    sent: list[np.ndarray] = []

    def upload(values: np.ndarray, send: Any = runtime.upload) -> Any:
        sent.append(values)
        return send(values)

    monkeypatch.setattr(runtime, "upload", upload)
    table = upload_joined(runtime, iter(arrays), sum(lengths))
    assert np.array_equal(runtime.download(table), np.concatenate(arrays))
    assert max(piece.nbytes for piece in sent) <= max(limit, arrays[0][:1].nbytes)
    assert (len(sent) == 1) == (np.concatenate(arrays).nbytes <= limit)
