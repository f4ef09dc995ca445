"""Search of a million codes: ``python benchmarks/index_search.py``.

Codes are made, with the statistics of real ones: codes of SHREC'11 as section 5.5 has them (six maps, 32
words, 192 numbers; 15,000 voxels a shape) give the mean and the covariance of the classes and of the shapes
around them, shrunk after Ledoit and Wolf, and how much wider some shapes stray than others. Two collections
are drawn: ``many classes`` of twenty shapes each, as SHREC'11 has them, and ``30 classes`` however many
shapes there are, where tens of thousands are nearly as near. The queries are of the same laws, and not in the
collection.

The index that spem builds is held against all codes: time, disk, recall@10 against exact search, and times of
whole calls of `Index.search`, by one client and by eight threads at once. Kinds of approximate index are
compared on a part of the harder collection. Exact search is timed on 100,000 codes, and on longer ones.
"""

from __future__ import annotations

import os

# before Lance is loaded
os.environ.setdefault("LANCE_LOG", "error")

import csv
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from _synthetic_codes import Array, Statistics, index_of
from _table import Benchmark, Row, data_root, timed
from spem.codes.codes import Codes
from spem.codes.collection import encode_collection
from spem.codes.settings import Settings
from spem.index import approximate
from spem.index.approximate import Approximation
from spem.index.comparison import nearest
from spem.index.index import Index

SIZES = {"all": 1_000_000, "kinds": 100_000, "exact": 100_000}
QUICK_SIZES = {"all": 20_000, "kinds": 5_000, "exact": 5_000}
CLASSES: dict[str, int | None] = {"many classes": None, "30 classes": 30}
KINDS: dict[str, dict[str, Any]] = {
    "IvfSq": {},
    "IvfRq": {},
    "IvfPq": {"num_sub_vectors": 48},
    "HnswSq": {},
}
PROBES = (4, 16, 64)
CLIENTS = (1, 8)
LENGTHS = (192, 3072, 12_288)
# As many numbers as memory has room for beside others.
EXACT_NUMBERS = 4 * 10**8
K = 10
RECALL, LATENCY, EXACT = 0.95, 20.0, 30.0
MILLISECOND = 1e-3
# The plan for ten to the ninth is made from figures of one machine with so much memory.
BILLION = 10**9


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("index_search", str(__doc__).splitlines()[0], argv)
    root = data_root()
    files = [] if root is None else sorted((root / "shrec11").glob("T*.obj"))
    if not files:
        benchmark.skip("shrec11: no T*.obj under SPEM_DATA, so no codes to take statistics of")
        benchmark.write()
        return
    sizes = QUICK_SIZES if benchmark.quick else SIZES
    codes, labels = real_codes(files, quick=benchmark.quick)
    statistics = Statistics.of(codes.vectors, labels)
    for name, n_classes in CLASSES.items():
        with tempfile.TemporaryDirectory() as folder:
            rng = np.random.default_rng(0)
            n_queries = 100 if benchmark.quick else 1000
            drawn = statistics.draw(sizes["all"] + n_queries, rng, n_classes)
            vectors, queries = drawn[:-n_queries], drawn[-n_queries:]
            whole(benchmark, Path(folder, "all"), name, vectors, queries, codes)
            if n_classes is None:
                exact(benchmark, Path(folder, "exact"), vectors[: sizes["exact"]], queries, codes)
            else:
                compare_kinds(
                    benchmark, Path(folder, "kinds"), name, vectors[: sizes["kinds"]], queries, codes
                )
            del drawn, vectors
    longer(benchmark, sizes["exact"])
    benchmark.write()


def real_codes(files: list[Path], *, quick: bool) -> tuple[Codes, Array]:
    """Encode real shapes, and return the class of each."""
    with (files[0].parent / "labels.csv").open(encoding="utf-8") as table:
        classes = {row["file"]: row["label"] for row in csv.DictReader(table)}
    chosen = files[::10] if quick else files
    settings = Settings.paper(voxels=1500 if quick else 15_000)
    codes = encode_collection(chosen, settings, n_jobs=2)
    return codes, np.array([classes[Path(path).name] for path in codes.paths])


def true_cosines(vectors: Array, queries: Array) -> Array:
    """Return the cosine of the tenth nearest code of each query, of all codes."""
    blocks = (queries[start : start + 50] @ vectors.T for start in range(0, len(queries), 50))
    return np.concatenate([np.partition(block, -K, axis=1)[:, -K] for block in blocks])


def compare_kinds(
    benchmark: Benchmark, folder: Path, name: str, vectors: Array, queries: Array, codes: Codes
) -> None:
    """Build each kind of approximate index on the same codes, and ask it with more and more cells."""
    index = index_of(folder, vectors, codes, np.random.default_rng(1))
    table, some = index.store.table(codes.model.digest), queries[:100]
    tenth, rows = true_cosines(vectors, some), []
    for kind, options in KINDS.items():
        cpu = time.process_time()
        seconds, _ = timed(lambda k=kind, o=options: approximate.build(table, k, **o))
        cpu = time.process_time() - cpu
        (built,) = table.list_indices()
        for probes in PROBES:
            way = Approximation(kind, probes, 4, 0.0, len(vectors), len(vectors))
            found, times = zip(*(asked(table, way, query) for query in some), strict=True)
            row: Row = {"kind": kind, "build s": seconds, "of CPU": cpu, "MB": built.size_bytes / 1e6}
            row |= {"cells": probes, "recall@10": share(found, some, tenth)}
            rows.append(row | quantiles(times))
    benchmark.table(f"kinds of approximate index, {len(vectors)} codes, {name}", rows)


def asked(table: Any, way: Approximation, query: Array) -> tuple[Array, float]:
    """Ask the approximate index, and return the codes found and the seconds."""
    begin = time.perf_counter()
    found = way.ask(table, query).select(["vector", "_distance"]).limit(K).to_arrow()
    seconds = time.perf_counter() - begin
    return found.column("vector").combine_chunks().flatten().to_numpy().reshape(-1, len(query)), seconds


def share(found: Sequence[Array], queries: Array, tenth: Array) -> float:
    """Return the share of answers that are no further than the tenth nearest of all codes."""
    hits = [
        min(K, (codes @ query >= c - 1e-5).sum())
        for codes, query, c in zip(found, queries, tenth, strict=True)
    ]
    return float(np.sum(hits) / (K * len(queries)))


def whole(
    benchmark: Benchmark, folder: Path, name: str, vectors: Array, queries: Array, codes: Codes
) -> None:
    """Write all codes, put the index in order, and search it through the facade, one client and eight."""
    seconds, index = timed(lambda: index_of(folder, vectors, codes, np.random.default_rng(1)))
    plain = disk(folder)
    (done,) = index.optimize(approximate=True)
    way: Any = done.approximate
    (built,) = index.store.table(codes.model.digest).list_indices()
    row: Row = {"codes": len(vectors), "write s": seconds, "optimize s": done.seconds, "kind": way.kind}
    row |= {"cells": way.n_probes, "MB of rows": plain / 1e6, "MB of index": built.size_bytes / 1e6}
    benchmark.table(f"an index of made codes, {name}", [row | {"recall told": way.recall}])
    tenth = true_cosines(vectors, queries)
    found = [index.search(query, K, exact=False) for query in queries]
    near = [np.array([one.distance for one in answers]) for answers in found]
    hits = [min(K, int((each <= 1 - c + 1e-5).sum())) for each, c in zip(near, tenth, strict=True)]
    recall = sum(hits) / (K * len(queries))
    rows = [{"recall@10": recall} | latencies(index, queries, clients, exact=False) for clients in CLIENTS]
    benchmark.table(f"approximate search of {len(vectors)} codes, {name}", rows)
    benchmark.target(f"recall@10, {name}", recall, RECALL, at_least=True)
    benchmark.target(f"approximate, one client, median ms, {name}", rows[0]["median ms"], LATENCY)
    plan(benchmark, name, row, rows[0])


def latencies(index: Index, queries: Array, clients: int, *, exact: bool) -> Row:
    """Return times of whole searches by clients that ask at once, and what one costs of the cores."""

    def ask(query: Array) -> float:
        """Return the seconds of one search."""
        return timed(lambda: index.search(query, K, exact=exact))[0]

    ask(queries[0])
    with ThreadPoolExecutor(clients) as threads:
        begin, cpu = time.perf_counter(), time.process_time()
        times = list(threads.map(ask, queries))
        cpu, seconds = time.process_time() - cpu, time.perf_counter() - begin
    rates = {"CPU ms": cpu / len(queries) / MILLISECOND, "a second": len(queries) / seconds}
    return {"clients": clients} | quantiles(times) | rates


def quantiles(seconds: Sequence[float]) -> Row:
    """Return the median and the 99th percentile of times."""
    median, last = np.quantile(seconds, [0.5, 0.99]) / MILLISECOND
    return {"median ms": float(median), "99 % ms": float(last)}


def exact(benchmark: Benchmark, folder: Path, vectors: Array, queries: Array, codes: Codes) -> None:
    """Time exact search from memory through the facade."""
    index = index_of(folder, vectors, codes, np.random.default_rng(1))
    first, _ = timed(lambda: index.search(queries[0], K, exact=True))
    rows = [
        {"first ms": first / MILLISECOND} | latencies(index, queries, clients, exact=True)
        for clients in CLIENTS
    ]
    benchmark.table(f"exact search of {len(vectors)} codes of {vectors.shape[1]} numbers", rows)
    benchmark.target("exact, one client, median ms", rows[0]["median ms"], EXACT)


def longer(benchmark: Benchmark, n: int) -> None:
    """Time the comparison of a query with longer codes in memory, without the database."""
    rng, rows = np.random.default_rng(2), []
    for length in LENGTHS:
        count = min(n, EXACT_NUMBERS // length)
        vectors = rng.standard_normal((count, length), np.float32)
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
        ids = np.arange(count).astype("S20")
        times = [timed(lambda q=vectors[i], v=vectors, d=ids: nearest(v, d, q, K))[0] for i in range(20)]
        row: Row = {"numbers": length, "codes": count, "MB": vectors.nbytes / 1e6} | quantiles(times)
        rows.append(row | {"ms for 100 MB": row["median ms"] / vectors.nbytes * 1e8})
        del vectors
    benchmark.table("comparison of one query in memory", rows)


def plan(benchmark: Benchmark, name: str, built: Row, asked: Row) -> None:
    """Carry the figures on to ten to the ninth, in proportion to the codes."""
    times = BILLION / built["codes"]
    benchmark.table(
        f"a thousand million, in proportion, {name}",
        [
            {
                "write h": built["write s"] * times / 3600,
                "optimize h": built["optimize s"] * times / 3600,
                "GB of rows": built["MB of rows"] * times / 1e3,
                "GB of index": built["MB of index"] * times / 1e3,
                "tables of 10^7": round(BILLION / 1e7),
                "median ms a table": asked["median ms"],
            }
        ],
    )


def disk(folder: Path) -> int:
    """Return the bytes of all files below a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


if __name__ == "__main__":
    main()
