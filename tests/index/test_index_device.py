"""An index whose shapes are swept on a device is the index that processes make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from backends import needs_simulator
from simulator import Simulated

from spem.errors import ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.cuda.device import Cuda
from spem.fields.solvers.host import Host, HostEngine
from spem.index.index import Index
from spem.shapes.shape import Shape

SETTINGS = {"voxels": None, "features": "spem", "n_maps": 3, "n_centers": 4, "n_rho": 16}


@dataclass(frozen=True)
class Tight:
    """A device of the processor's own, with memory for shapes of so many nodes."""

    nodes: int

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> HostEngine:
        """Make an engine of the processor, or refuse."""
        total = sum(system.n_nodes for system in systems)
        if total > self.nodes:
            msg = f"{total} nodes do not fit"
            raise SizeError(msg)
        return Host().open(systems, dtype)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of silhouettes, and of a volume of labels, one of them too small for a code."""
    made = tmp_path / "shapes"
    made.mkdir()
    y, x = np.mgrid[-18:19, -18:19]
    for i, (a, b) in enumerate(((9, 12), (7, 14), (11, 11), (5, 16))):
        np.save(made / f"{i}.npy", ((x / a) ** 2 + (y / b) ** 2 < 1))
    return made


def rows(index: Index) -> dict[str, Any]:
    """Return the rows of an index, by name."""
    [digest] = index.store.digests()
    return {row.name: row for row in index.store.rows(digest)}


def codes(index: Index) -> np.ndarray:
    """Return the codes of an index, ordered by name."""
    return np.stack([row.code for _, row in sorted(rows(index).items())])


def test_rows_are_those_of_processes(folder, tmp_path):
    """Model, codes and all else of a row are the same, first and when more is added."""
    one, other = Index.open(tmp_path / "one.db"), Index.open(tmp_path / "other.db")
    first = sorted(folder.glob("*.npy"))[:3]
    for given in (first, folder):
        told = one.add(given, **SETTINGS), other.add(given, device=Host(), **SETTINGS)
        assert told[0] == told[1]
    np.testing.assert_array_equal(codes(other), codes(one))
    here, there = rows(one), rows(other)
    assert list(here) == list(there)
    facts = ("id", "hash", "ndim", "n_nodes", "volume", "report")
    assert all(getattr(there[name], fact) == getattr(here[name], fact) for name in here for fact in facts)


def test_want_of_memory_fails_a_shape(folder, tmp_path):
    """A shape that does not fit fails with its reason, the others are rows."""
    index = Index.open(tmp_path / "a.db")
    index.add(folder, **SETTINGS)
    y, x = np.mgrid[-40:41, -40:41]
    np.save(folder / "large.npy", x**2 + y**2 < 1500)
    np.save(folder / "small.npy", x**2 + y**2 < 100)
    added = index.add(folder, device=Tight(2000))
    assert added.added == 1
    [failure] = added.failures
    assert failure.path.endswith("large.npy")
    assert "nodes do not fit" in failure.reason


def test_labels_are_told_apart(tmp_path):
    """Labels of a volume are rows; one that does not fit is told, and its file goes on."""
    volume = np.zeros((30, 60), np.uint8)
    volume[2:28, 2:28] = 1
    volume[10:20, 40:50] = 2
    np.save(tmp_path / "labels.npy", volume)
    square = Shape.from_mask(np.ones((9, 9)), name="square")
    index = Index.open(tmp_path / "a.db")
    index.add([square], **SETTINGS | {"per_label": True})
    added = index.add([tmp_path / "labels.npy"], device=Tight(200))
    assert set(rows(index)) == {"square", "labels-2"}
    assert [failure.reason for failure in added.failures] == ["1: 676 nodes do not fit"]


@needs_simulator
def test_codes_of_kernels_find_the_same(folder, tmp_path):
    """Of a device that computes by itself codes differ by rounding, and answers come in the same order."""
    one, other = Index.open(tmp_path / "one.db"), Index.open(tmp_path / "other.db")
    one.add(folder, **SETTINGS)
    [digest] = one.store.digests()
    other.add(folder, model=one.model(digest), device=Simulated())
    query = folder / "0.npy"
    found = [[each.row.name for each in index.search(query, k=4)] for index in (one, other)]
    assert found[0] == found[1]


def test_cluster_and_device_exclude_each_other(folder, tmp_path):
    """Workers of a cluster have no share in a device of this machine."""
    with pytest.raises(ParameterError, match="exclude each other; give one of them"):
        Index.open(tmp_path / "a.db").add(folder, cluster="tcp://nowhere:1", device=Host())


def test_missing_device_is_told_before_anything_is_read(folder, tmp_path, monkeypatch):
    """A device that cannot be had ends an addition at once, not once for each shape."""

    def refuse(self: Cuda) -> None:
        msg = "no driver"
        raise ParameterError(msg)

    monkeypatch.setattr(Cuda, "runtime", refuse)
    index = Index.open(tmp_path / "a.db")
    with pytest.raises(ParameterError, match="no driver"):
        index.add(folder, device=Cuda(), **SETTINGS)
    assert not index.store.digests()
