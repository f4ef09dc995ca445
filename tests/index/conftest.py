"""Rows of an index that are ready at once, and a model that they belong to."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.index import approximate
from spem.index.index import Index
from spem.index.row import Row, pack, row_id
from spem.index.updates import write
from spem.shapes.shape import Shape


@pytest.fixture(scope="session")
def tiny_model() -> Model:
    """Return a model of maps in the plane, of codes of 64 numbers."""
    rng = np.random.default_rng(0)
    settings = Settings(features="spem", n_maps=2, n_centers=4)
    return Model.fit(settings, [(rng.random((50, 2)),) for _ in range(3)], ndim=2)


@pytest.fixture(scope="session")
def ready_row(tiny_model: Model) -> Callable[..., Row]:
    """Return a maker of rows, of one content for each name."""
    slab = Shape.from_mask(np.ones((2, 3)), name="slab")
    packed = pack(slab)

    def made(name: str, suffix: str = "", **changes: object) -> Row:
        key = hashlib.sha256(name.encode()).hexdigest()
        code = np.random.default_rng(int(key[:8], 16)).standard_normal(tiny_model.n_code)
        given = {"path": f"/nowhere/{name}.png", "ndim": 2, "n_nodes": 6, "shape": packed, "volume": 6.0}
        facts = {"name": name + suffix, **given, **changes}
        return Row(row_id(key, suffix), key, code=code.astype(np.float32), **facts)  # type: ignore[arg-type]

    return made


@pytest.fixture
def filled(tmp_path: Path, tiny_model: Model, ready_row: Callable[..., Row]) -> Index:
    """Return an index of four rows."""
    index = Index.open(tmp_path / "shapes.db")
    index.store.save_model(tiny_model)
    rows = [
        ready_row("cat", label="cats", metadata={"site": "Oslo", "the age": "3"}, volume=3.0),
        ready_row("dog", label="dogs", metadata={"site": "Rome"}, volume=2.0),
        ready_row("cow", volume=1.0),
        ready_row("d'oh", label="it's", volume=4.0),
    ]
    write(index.store, tiny_model.digest, rows)
    return index


@pytest.fixture
def crowd(tmp_path: Path, tiny_model: Model, ready_row: Callable[..., Row]) -> Index:
    """Return an index of 300 rows in 30 classes of ten, wide apart and narrow within."""
    rng = np.random.default_rng(5)
    index = Index.open(tmp_path / "crowd.db")
    index.store.save_model(tiny_model)
    means = rng.standard_normal((30, tiny_model.n_code))
    codes = means.repeat(10, axis=0) + 0.3 * rng.standard_normal((300, tiny_model.n_code))
    rows = (
        ready_row(f"shape {i}", label=str(i // 10), volume=1.0 + i, metadata={"half": str(i % 2)})
        for i in range(300)
    )
    write(
        index.store,
        tiny_model.digest,
        [replace(row, code=code.astype(np.float32)) for row, code in zip(rows, codes, strict=True)],
    )
    return index


@pytest.fixture
def few_queries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure recall on ten codes, which takes a tenth of the time."""
    monkeypatch.setattr(approximate, "_QUERIES", 10)
