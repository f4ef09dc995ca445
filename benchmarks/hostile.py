"""Hostile files against the readers and the server: counts of what came of them.

Readers run in a process with a memory limit; the server, in this process, gets every file over HTTP and reads
it in its sandbox. A finding is a traceback, a crash, a hang, a status of 500 or above, a message of several
lines, or a file that was opened or touched. ``python benchmarks/hostile.py``
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import select
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from _hostile import corpus
from _hostile_case import CANARY, Case
from _hostile_files import seeds
from _table import Benchmark, Row

READER = Path(__file__).with_name("_hostile_reader.py")
# Seconds of one file; the machine may be busy with other things.
HANG = 60.0
QUICK = 17
IMAGES = ("png", "gif", "jpg", "bmp", "tif", "webp", "pgm", "ppm", "pbm", "name")
# Where the server keeps what it works on, which no client should learn of.
TEMPORARY = tempfile.gettempdir()
STATES = ("done", "failed", "cancelled")


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("hostile", str(__doc__).splitlines()[0], argv)
    cases = corpus()[:: QUICK if benchmark.quick else 1]
    benchmark.fact("files", len(cases))
    with tempfile.TemporaryDirectory() as folder:
        root = planted(Path(folder))
        before = snapshot(root)
        read = against_readers(cases, root / "a" / "b")
        benchmark.table("readers", tabulated(cases, read))
        benchmark.table("readers, findings", findings(cases, read))
        served, facts = asyncio.run(against_server(cases, root, n_workers=1 if benchmark.quick else 2))
        benchmark.table("server", tabulated(cases, served))
        benchmark.table("server, findings", findings(cases, served))
        changed = sorted(set(snapshot(root).items()) ^ set(before.items()))
        changed = [entry for entry in changed if not entry[0].startswith(("a/b/", "index/", "state/"))]
    for what, value in facts.items():
        benchmark.fact(what, value)
    for who, records in (("readers", read), ("server", served)):
        benchmark.target(f"{who}: findings", sum("finding" in r["outcome"] for r in records), 0)
        benchmark.target(f"{who}: most seconds of a file", max(r["seconds"] for r in records), HANG)
    benchmark.target("workers left dead", facts["workers missing"], 0)
    benchmark.target("files touched outside", len(changed), 0)
    benchmark.write()


def planted(root: Path) -> Path:
    """Put files where none should be touched, and return the folder."""
    (root / "a" / "b").mkdir(parents=True)
    for folder in (root, root / "a", root / "a" / "b"):
        (folder / CANARY).write_text("untouched", encoding="utf-8")
    return root


def snapshot(root: Path) -> dict[str, str]:
    """Return a digest of each file of a folder."""
    files = (path for path in root.rglob("*") if path.is_file())
    return {str(f.relative_to(root)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


def against_readers(cases: list[Case], folder: Path) -> list[Row]:
    """Have all files read by a process that is started again whenever one takes it down."""
    for kind, content in seeds().items():
        (folder / f"warm.{kind.partition('-')[0]}").write_bytes(content)
    for number, case in enumerate(cases):
        kind = case.kind.partition("-")[0]
        suffix = "png" if kind == "name" else kind
        (folder / f"{number:04d}.{suffix}").write_bytes(case.content)
    records: list[Row] = []
    while len(records) < len(cases):
        before = len(records)
        why = read_on(folder, records)
        if len(records) < len(cases):
            if why.startswith("finding: died") and len(records) == before and not before:
                raise SystemExit(why)
            records.append({"outcome": why, "told": "", "seconds": 0.0, "memory": 0})
    return records


def read_on(folder: Path, records: list[Row]) -> str:
    """Read from the first file without a record on; say why it ended."""
    command = [sys.executable, str(READER), str(folder), str(len(records))]
    with (
        tempfile.TemporaryFile() as errors,
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors) as child,
    ):
        output, rest = child.stdout, b""
        while True:
            ready, _, _ = select.select([output], [], [], HANG)
            data = os.read(output.fileno(), 1 << 16) if ready and output else b""
            if not ready:
                child.kill()
                return "finding: hang"
            if not data:
                status = child.wait()
                errors.seek(0)
                return f"finding: died ({status}) {errors.read()[-200:]!r}"
            *lines, rest = (rest + data).split(b"\n")
            records += [json.loads(line) for line in lines]


async def against_server(cases: list[Case], root: Path, n_workers: int) -> tuple[list[Row], dict[str, Any]]:
    """Send all files to a server, one after another, and wait for what comes of each."""
    import httpx

    from spem.codes.collection import encode_collection
    from spem.codes.settings import Settings
    from spem.index.index import Index
    from spem.server.app import create_app
    from spem.server.options import ServerOptions
    from spem.shapes.synthetic import ball, disk

    index, models = Index.open(root / "index"), {}
    for make in (ball, disk):
        shapes = [make(1.0, 0.3), make(1.2, 0.3)]
        model = encode_collection(shapes, Settings(voxels=2000, n_centers=8)).model
        index.add(shapes, model=model)
        models[model.ndim] = model.digest
    options = ServerOptions(
        n_workers=n_workers, memory=1 << 30, seconds=30.0, rate=0, state=root / "state", token="t" * 32
    )
    app = create_app(index, options)
    records = []
    async with app.router.lifespan_context(app):
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:8321") as client:
            for number, case in enumerate(cases):
                route = ("/api/search", "/api/encode", "/api/shapes")[number % 3]
                model = models[2 if case.kind in IMAGES else 3]
                records.append(await sent(client, case, f"{route}?model={model}", options.token or ""))
            healthy = (await client.get("/health")).status_code == 200
        sandbox = app.state.services.sandbox
        for _ in range(300):
            if sandbox.stats()["free"] == options.n_workers:
                break
            await asyncio.sleep(0.1)
        stats = sandbox.stats()
    facts = {
        "healthy at the end": healthy,
        "workers missing": options.n_workers - stats["free"],
        **{f"sandbox, {k}": stats[k] for k in ("time", "memory", "died", "retired")},
    }
    return records, facts


async def sent(client: Any, case: Case, route: str, token: str) -> Row:
    """Send one file; say what came of it."""
    began = time.perf_counter()
    answer = await client.post(
        route,
        content=form(case),
        headers={"Content-Type": "multipart/form-data; boundary=limit", "Authorization": f"Bearer {token}"},
    )
    told, outcome = answer.text, f"status {answer.status_code}"
    if answer.status_code == 202:
        job = f"/api/jobs/{answer.json()['job']}"
        while (status := (await client.get(job)).json())["state"] not in STATES:
            if time.perf_counter() - began > HANG:
                break
            await asyncio.sleep(0.01)
        outcome, told = status["state"], status["error"] or ""
    strange = "\n" in told.strip() or "Traceback" in told or TEMPORARY in told or "report it" in told
    bad = answer.status_code >= 500 or outcome not in (*STATES, f"status {answer.status_code}") or strange
    return {
        "outcome": f"finding: {outcome}" if bad else outcome,
        "told": told[:300],
        "seconds": time.perf_counter() - began,
    }


def form(case: Case) -> bytes:
    """Return a form with the file, its name as raw as it is."""
    name = case.name.replace('"', "%22").replace("\r", "%0D").replace("\n", "%0A").encode("utf-8", "replace")
    head = b'--limit\r\nContent-Disposition: form-data; name="file"; filename="' + name + b'"\r\n\r\n'
    return head + case.content + b"\r\n--limit--\r\n"


def tabulated(cases: list[Case], records: list[Row]) -> list[Row]:
    """Count outcomes by kind."""
    outcomes = sorted({str(record["outcome"]) for record in records})
    rows: list[Row] = []
    for kind in (*dict.fromkeys(case.kind for case in cases), "all"):
        chosen = [r for c, r in zip(cases, records, strict=True) if kind in (c.kind, "all")]
        counts = Counter(str(record["outcome"]) for record in chosen)
        slowest = max(record["seconds"] for record in chosen)
        rows.append(
            {"kind": kind, "files": len(chosen), **{o: counts[o] for o in outcomes}, "slowest": slowest}
        )
    return rows


def findings(cases: list[Case], records: list[Row]) -> list[Row]:
    """Return the cases that went wrong."""
    return [
        {"kind": case.kind, "how": case.how, "outcome": record["outcome"], "told": record["told"]}
        for case, record in zip(cases, records, strict=True)
        if "finding" in record["outcome"]
    ] or [{"kind": "none", "how": "", "outcome": "", "told": ""}]


if __name__ == "__main__":
    main()
