"""Files to keep: what a worker says of them is held against what a header may have."""

from __future__ import annotations

import pytest

pytest.importorskip("fastapi")

from spem.server.refusals import Refusal
from spem.server.routes_files import _plain


@pytest.mark.parametrize("value", ["cat-maps.npz", "text/csv; charset=utf-8", "model/ply"])
def test_names_and_types_pass(value):
    """Names of Latin letters and types of media go into headers as they are."""
    assert _plain({"file": value}, "file") == value


@pytest.mark.parametrize("value", ['a"b', "a\r\nSet-Cookie: x=1", "ä.npz", "", None, ["a"]])
def test_a_worker_writes_no_headers(value):
    """What would end a header, or is no text of one, is refused."""
    with pytest.raises(Refusal, match="cannot be made"):
        _plain({"file": value}, "file")
