"""The server under 16 clients: mixed reads, searches and uploads, then searches by id alone.

The server is one process on loopback, the clients are this one: ``python benchmarks/server_load.py``. Without
``--quick`` it serves SHREC'11 with codes ``auto``, from ``build/shrec11.index``, made where it is absent.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from _table import ROOT, Benchmark, Row, data_root

CLIENTS = 16
WARM_SECONDS, MIXED_SECONDS, READ_SECONDS = 20.0, 60.0, 30.0
QUICK_SECONDS = 2.5
# Of a hundred requests of the mixed load; views are of a few shapes, as when people look at the same ones.
MIX = {"list": 30, "thumbnail": 30, "search by id": 22, "one shape": 10, "view": 5, "upload": 3}
VIEWED = 24
P99_SECONDS, GROWTH = 0.05, 1.1
BOUNDARY = b"spem-load"


@dataclass
class Tally:
    """What became of the requests of one kind."""

    seconds: list[float] = field(default_factory=list)
    busy: int = 0
    errors: list[str] = field(default_factory=list)

    def row(self, kind: str) -> Row:
        """Return it as a row of a table, times in milliseconds."""
        times = 1000 * np.array(self.seconds or [np.nan])
        p50, p99 = np.percentile(times, [50, 99])
        return {
            "kind": kind, "answers": len(self.seconds), "p50 ms": p50, "p99 ms": p99, "worst ms": times.max(),
            "429": self.busy, "errors": len(self.errors),
        }  # fmt: skip


class Client:
    """One connection that is kept open."""

    def __init__(self, port: int, tallies: dict[str, Tally]) -> None:
        self.port, self.tallies = port, tallies
        self.reader: asyncio.StreamReader | None = None
        self.writer: asyncio.StreamWriter | None = None

    async def ask(self, kind: str, path: str, body: bytes = b"") -> bytes | None:
        """Send a request, note how long its answer takes, and return it where it is one."""
        tally = self.tallies.setdefault(kind, Tally())
        begin = time.perf_counter()
        try:
            status, answer = await asyncio.wait_for(self._exchange(path, body), 120)
        except (OSError, EOFError, TimeoutError) as error:
            tally.errors.append(f"{path}: {error!r}")
            self.close()
            return None
        if status == 429:
            tally.busy += 1
            await asyncio.sleep(0.2)
            return None
        if status >= 400:
            tally.errors.append(f"{path}: {status} {answer[:200]!r}")
            return None
        tally.seconds.append(time.perf_counter() - begin)
        return answer

    async def _exchange(self, path: str, body: bytes) -> tuple[int, bytes]:
        if self.writer is None or self.reader is None:
            self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        head = f"{'POST' if body else 'GET'} {path} HTTP/1.1\r\nHost: localhost\r\n"
        if body:
            head += f"Content-Type: multipart/form-data; boundary={BOUNDARY.decode()}\r\n"
            head += f"Content-Length: {len(body)}\r\n"
        self.writer.write(head.encode() + b"\r\n" + body)
        await self.writer.drain()
        lines = (await self.reader.readuntil(b"\r\n\r\n")).lower()
        length = re.search(rb"content-length: (\d+)", lines)
        answer = await self.reader.readexactly(int(length[1])) if length else b""
        return int(lines[9:12]), answer

    def close(self) -> None:
        """Drop the connection."""
        if self.writer is not None:
            self.writer.close()
        self.reader = self.writer = None


@dataclass(frozen=True)
class Load:
    """What clients ask for."""

    port: int
    ids: list[str]
    uploads: list[bytes]

    async def mixed(self, client: Client, draw: random.Random) -> None:
        """Ask for something."""
        [kind] = draw.choices(list(MIX), list(MIX.values()))
        one, few = draw.choice(self.ids), draw.choice(self.ids[:VIEWED])
        path = {
            "list": f"/api/shapes?limit=48&offset={draw.randrange(len(self.ids))}",
            "thumbnail": f"/api/shapes/{one}/thumbnail.png",
            "search by id": f"/api/shapes/{one}/neighbours?k=12",
            "one shape": f"/api/shapes/{one}",
            "view": f"/api/shapes/{few}/{draw.choice(('geometry', 'field'))}",
            "upload": "/api/search",
        }[kind]
        if kind == "upload":
            await self._upload(client, draw.choice(self.uploads))
        else:
            await client.ask(kind, path)

    async def search(self, client: Client, draw: random.Random) -> None:
        """Search by the id of a shape."""
        await client.ask("search by id alone", f"/api/shapes/{draw.choice(self.ids)}/neighbours?k=12")

    async def _upload(self, client: Client, body: bytes) -> None:
        begin = time.perf_counter()
        ticket = await client.ask("upload", "/api/search", body)
        state = "queued" if ticket else "refused"
        while state in ("queued", "running"):
            await asyncio.sleep(0.25)
            answer = await client.ask("progress", f"/api/jobs/{json.loads(ticket or b'')['job']}")
            state = json.loads(answer)["state"] if answer else "lost"
        tally = client.tallies.setdefault("upload to answers", Tally())
        if state == "done":
            tally.seconds.append(time.perf_counter() - begin)
        elif state != "refused":
            tally.errors.append(f"job {state}")


async def run_load(
    ask: Callable[[Client, random.Random], Awaitable[None]], port: int, seconds: float, seed: int
) -> dict[str, Tally]:
    """Let all clients ask for a while."""
    tallies: dict[str, Tally] = {}
    end = time.perf_counter() + seconds

    async def one(number: int) -> None:
        client, draw = Client(port, tallies), random.Random(f"{seed} {number}")  # noqa: S311
        while time.perf_counter() < end:
            await ask(client, draw)
        client.close()

    await asyncio.gather(*(one(number) for number in range(CLIENTS)))
    return tallies


@contextlib.contextmanager
def served(index: Path) -> Iterator[tuple[int, int]]:
    """Start a server as a process of its own, and stop it; yield its number and port."""
    command = [sys.executable, "-m", "spem", "serve", str(index), "--port", "0", "--rate", "0"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        line = process.stdout.readline() if process.stdout else ""
        port = int(line.rstrip().rstrip("/").rpartition(":")[2])
        for _ in range(600):
            with contextlib.suppress(OSError):
                urllib.request.urlopen(f"http://127.0.0.1:{port}/ready")
                break
            time.sleep(0.2)
        yield process.pid, port
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


def resident(pid: int) -> float:
    """Return the memory of a process, in MiB."""
    text = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    found = re.search(r"VmRSS:\s+(\d+)", text)
    return int(found[1]) / 1024 if found else float("nan")


def form(name: str, content: bytes) -> bytes:
    """Return the body of a form with a file."""
    head = b'Content-Disposition: form-data; name="file"; filename="' + name.encode() + b'"'
    return b"--" + BOUNDARY + b"\r\n" + head + b"\r\n\r\n" + content + b"\r\n--" + BOUNDARY + b"--\r\n"


def small_index(folder: Path) -> tuple[Path, list[bytes]]:
    """Make an index of stars, and uploads of rectangles."""
    import spem

    stars = [spem.synthetic.star_polygon(2 * n + 5, 2) for n in range(12)]
    spem.Index.open(folder / "small.index").add(stars, features="spem", n_centers=8)
    uploads = []
    for width in range(10, 20):
        content = io.BytesIO()
        np.save(content, np.pad(np.ones((20, width), np.uint8), 3))
        uploads.append(form("box.npy", content.getvalue()))
    return folder / "small.index", uploads


def real_index(data: Path) -> tuple[Path, list[bytes]]:
    """Return the index of SHREC'11, made where it is absent, and its files as uploads."""
    import spem

    folder, files = ROOT / "build" / "shrec11.index", sorted((data / "shrec11").glob("*.obj"))
    index = spem.Index.open(folder)
    if len(index) < len(files):
        index.add(data / "shrec11", labels=data / "shrec11" / "labels.csv", n_jobs=os.cpu_count() or 1)
    return folder, [form(file.name, file.read_bytes()) for file in files[::10]]


def measure(benchmark: Benchmark, name: str, index: Path, uploads: list[bytes]) -> None:
    """Measure a server on an index."""
    quick = QUICK_SECONDS if benchmark.quick else 0.0
    with served(index) as (pid, port):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/shapes?limit=500") as answer:
            ids = [entry["id"] for entry in json.load(answer)["shapes"]]
        load = Load(port, ids, uploads)
        asyncio.run(run_load(load.mixed, port, quick or WARM_SECONDS, 0))
        before = resident(pid)
        tallies = asyncio.run(run_load(load.mixed, port, quick or MIXED_SECONDS, 1))
        after = resident(pid)
        tallies |= asyncio.run(run_load(load.search, port, quick or READ_SECONDS, 2))
        last = resident(pid)
    benchmark.table(f"{name}: {CLIENTS} clients", [tally.row(kind) for kind, tally in tallies.items()])
    benchmark.table(
        f"{name}: memory of the server, MiB",
        [{"after warm-up": before, "after the mixed load": after, "after searches": last}],
    )
    errors = [error for tally in tallies.values() for error in tally.errors]
    for error in errors[:5]:
        print(f"error: {error}")
    alone = tallies["search by id alone"].seconds
    benchmark.target(f"{name}: errors other than 429", len(errors), 0)
    benchmark.target(f"{name}: memory at the end over that after warm-up", last / before, GROWTH)
    benchmark.target(f"{name}: search by id alone, p99 seconds", float(np.percentile(alone, 99)), P99_SECONDS)
    benchmark.fact(f"{name}: searches by id a second", len(alone) / (quick or READ_SECONDS))


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("server_load", str(__doc__).splitlines()[0], argv)
    data = data_root()
    if benchmark.quick:
        with tempfile.TemporaryDirectory() as folder:
            measure(benchmark, "small", *small_index(Path(folder)))
    elif data is None:
        benchmark.skip("shrec11: no folder of real shapes; set SPEM_DATA")
    else:
        measure(benchmark, "shrec11", *real_index(data))
    benchmark.write()


if __name__ == "__main__":
    main()
