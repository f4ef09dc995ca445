"""Any number of made codes with the statistics of real ones, and an index of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from sklearn.covariance import ledoit_wolf

from spem.codes.codes import Codes
from spem.index.index import Index
from spem.index.schema import schema, standardised_codes

Array = NDArray[Any]
# Shapes of a class, as in SHREC'11.
A_CLASS = 20
_BATCH = 50_000


@dataclass(frozen=True, eq=False)
class Statistics:
    """A normal law of class means, and one around each of them, whose width varies as that of real shapes.

    Parameters
    ----------
    mean
        ``(n_code,)`` mean of the class means.
    between, within
        ``(n_code, n_code)`` square roots of the covariance of class means and of shapes around theirs, both
        shrunk after Ledoit and Wolf.
    widths
        ``(n_shapes,)`` how far real shapes are from the mean of their class, 1 in the root mean square.
    """

    mean: Array
    between: Array
    within: Array
    widths: Array

    @classmethod
    def of(cls, vectors: Array, labels: Array) -> Statistics:
        """Estimate the laws from codes and the class of each."""
        codes = standardised_codes(vectors).astype(float)
        means = np.array([codes[labels == label].mean(axis=0) for label in np.unique(labels)])
        around = codes - means[np.searchsorted(np.unique(labels), labels)]
        far = np.linalg.norm(around, axis=1)
        widths = far / np.sqrt(np.square(far).mean())
        return cls(means.mean(axis=0), _root(means - means.mean(axis=0)), _root(around), widths)

    def draw(self, n: int, rng: np.random.Generator, n_classes: int | None = None) -> Array:
        """Draw codes of as many classes, of twenty shapes each by default; standardised, in any order."""
        size = len(self.mean)
        count = n_classes or -(-n // A_CLASS)
        classes = self.mean + rng.standard_normal((count, size)) @ self.between
        which = rng.integers(count, size=n)
        classes, within = classes.astype(np.float32), self.within.astype(np.float32)
        out = np.empty((n, size), np.float32)
        for start in range(0, n, _BATCH):
            some = which[start : start + _BATCH]
            codes = rng.standard_normal((len(some), size), np.float32) @ within
            codes *= rng.choice(self.widths.astype(np.float32), (len(some), 1))
            codes += classes[some]
            codes -= codes.mean(axis=1, keepdims=True)
            codes /= np.linalg.norm(codes, axis=1, keepdims=True)
            out[start : start + _BATCH] = codes
        return out


def _root(centred: Array) -> Array:
    """Return the symmetric square root of the shrunk covariance of centred vectors."""
    covariance = ledoit_wolf(centred, assume_centered=True)[0]
    values, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.sqrt(np.maximum(values, 0))) @ axes.T)


def index_of(folder: Path, vectors: Array, codes: Codes, rng: np.random.Generator) -> Index:
    """Make an index of standardised codes, under a model that has codes of their length."""
    index = Index.open(folder)
    index.store.save_model(codes.model)
    table = index.store.table(codes.model.digest)
    for batch in _batches(vectors, rng):
        table.add(batch)
    return index


def _batches(vectors: Array, rng: np.random.Generator) -> Iterator[pa.Table]:
    """Yield rows as the database has them, without pictures and shapes."""
    columns = schema(vectors.shape[1])
    report = '{"source": "shapes/shape.obj", "format": "obj", "method": "closed mesh", "repairs": []}'
    for start in range(0, len(vectors), _BATCH):
        some = np.ascontiguousarray(vectors[start : start + _BATCH])
        n = len(some)
        hashes = [rng.bytes(32).hex() for _ in range(n)]
        plain = {
            "id": [each[:20] for each in hashes],
            "hash": hashes,
            "name": [f"shape {start + i}" for i in range(n)],
            "path": [f"./shapes/{start + i}.obj" for i in range(n)],
            "copies": [[]] * n,
            "label": [str(i % 30) for i in range(n)],
            "metadata": [[]] * n,
            "ndim": [3] * n,
            "n_nodes": [15_000] * n,
            "volume": rng.lognormal(size=n),
            "report": [report] * n,
            "added": [datetime.now(UTC)] * n,
            "vector": pa.FixedSizeListArray.from_arrays(pa.array(some.ravel()), some.shape[1]),
            "thumbnail": [b""] * n,
            "shape": [b""] * n,
        }
        yield pa.table({name: plain[name] for name in columns.names}, schema=columns)
