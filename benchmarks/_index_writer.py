"""The process that ``index_kill.py`` kills: for each line on stdin it forks, and the child writes rows.

It tells on stdout what it is about to write, and what it has written, one line each.
"""

from __future__ import annotations

import os
import sys
from datetime import timedelta
from importlib import import_module
from pathlib import Path

import numpy as np

from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.index.row import Row, pack, row_id
from spem.index.store import Store
from spem.index.updates import write
from spem.shapes import synthetic

# What the database is made with. It is not imported before the fork itself, since it starts a thread.
BELOW = ("pyarrow", "lance_namespace", "pydantic")
BATCH = 3
OPTIMIZE_EVERY = 3


def model() -> Model:
    """Return the model of all rounds."""
    rng = np.random.default_rng(0)
    settings = Settings(features="spem", n_maps=2, n_centers=4)
    return Model.fit(settings, [(rng.random((50, 2)),) for _ in range(3)], ndim=2)


def rows(seed: int, batch: int) -> list[Row]:
    """Return the rows of a batch; every second batch has one that earlier rounds may have written."""
    found = []
    for place in range(BATCH):
        shared = place == 0 and batch % 2 == 0
        rng = np.random.default_rng([batch, 0] if shared else [seed, batch, place])
        key = rng.bytes(32).hex()
        code = rng.standard_normal(64).astype(np.float32)
        facts = {"ndim": 2, "n_nodes": SHAPE.n_nodes, "shape": PACKED}
        found.append(Row(row_id(key), key, key[:6], f"/{seed}/{key[:12]}.png", code, **facts))
    return found


def tell(*words: str) -> None:
    """Write a line in one piece."""
    os.write(1, (" ".join(words) + "\n").encode())


def child(folder: Path, seed: int, mode: str) -> None:
    """Write until killed."""
    import_module("lancedb")
    tell("ready")
    store = Store.open(folder)
    store.save_model(MODEL)
    for batch in range(10_000):
        these = rows(seed, batch)
        tell("begin", *(row.id for row in these))
        write(store, MODEL.digest, these)
        tell("done", *(row.id for row in these))
        if mode == "optimize" and batch % OPTIMIZE_EVERY == 0:
            store.compact(timedelta(0))


def serve() -> None:
    """Fork for each line ``folder seed mode``, and tell when the child has ended."""
    for name in BELOW:
        import_module(name)
    tell("serving")
    for line in sys.stdin:
        folder, seed, mode = line.rsplit(maxsplit=2)
        process = os.fork()
        if process == 0:
            child(Path(folder), int(seed), mode)
            os._exit(0)
        tell("child", str(process))
        status = os.waitpid(process, 0)[1]
        tell("ended", str(status))


MODEL = model()
SHAPE = synthetic.disk(radius=8.0, spacing=1.0)
PACKED = pack(SHAPE)

if __name__ == "__main__":
    serve()
