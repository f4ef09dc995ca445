"""A corpus of hostile files: valid ones made by code, then cut, mutated, inflated and lied about."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from _hostile_case import Case
from _hostile_disguises import disguises, names, references
from _hostile_files import seeds
from _hostile_headers import headers
from _hostile_values import bombs, values

SEED = 20260
_HUGE = (0x7FFFFFFF, 0xFFFFFFFF, 1_000_000_000, 0x80000000, 0)

Rng = np.random.Generator


def corpus(seed: int = SEED) -> list[Case]:
    """Return all cases, the same for the same seed."""
    rng = np.random.default_rng(seed)
    cases = []
    for kind, content in {**seeds(), "spem": codes()}.items():
        cases.append(Case(kind, "valid", f"seed.{kind.partition('-')[0]}", content))
        cases += _damaged(kind, content, rng)
    for made in (headers, values, bombs, references, disguises, names):
        cases += made()
    return cases


def codes() -> bytes:
    """Return a valid file of codes."""
    from spem.codes.collection import encode_collection
    from spem.codes.settings import Settings
    from spem.shapes.synthetic import disk

    made = encode_collection([disk(1.0, 0.2), disk(1.0, 0.1)], Settings(features="spem", n_centers=4))
    with tempfile.TemporaryDirectory() as folder:
        made.save(Path(folder, "codes.spem"))
        return Path(folder, "codes.spem").read_bytes()


def _damaged(kind: str, content: bytes, rng: Rng) -> Iterator[Case]:
    """Yield cut and mutated versions of a file."""
    name = f"damaged.{kind.partition('-')[0]}"
    ways: dict[str, tuple[int, Callable[[bytes, Rng], bytes]]] = {
        "truncated": (4, _cut),
        "bits flipped": (4, _flip),
        "bytes inserted": (2, _insert),
        "spliced": (2, _splice),
        "number made huge": (4, _inflate),
    }
    for how, (count, mutate) in ways.items():
        for _ in range(count):
            yield Case(kind, how, name, mutate(content, rng))
    yield Case(kind, "one byte", name, content[:1])
    yield Case(kind, "empty", name, b"")


def _cut(content: bytes, rng: Rng) -> bytes:
    """Cut the end off."""
    return content[: int(rng.integers(1, len(content)))]


def _flip(content: bytes, rng: Rng) -> bytes:
    """Change bytes, most of them in the header."""
    changed = bytearray(content)
    for _ in range(int(rng.integers(1, 12))):
        reach = len(content) if rng.random() < 0.4 else min(len(content), 128)
        changed[int(rng.integers(reach))] = int(rng.integers(256))
    return bytes(changed)


def _insert(content: bytes, rng: Rng) -> bytes:
    """Put random bytes somewhere in between."""
    at = int(rng.integers(len(content)))
    return content[:at] + rng.bytes(int(rng.integers(1, 64))) + content[at:]


def _splice(content: bytes, rng: Rng) -> bytes:
    """Repeat one piece of the file at the place of another."""
    a, b, n = (int(rng.integers(1, len(content))) for _ in range(3))
    return content[:a] + content[b : b + n] + content[a:]


def _inflate(content: bytes, rng: Rng) -> bytes:
    """Overwrite four bytes at an even place of the header with a number out of any range."""
    at = 2 * int(rng.integers(0, max(1, min(len(content) - 4, 200) // 2)))
    order = "<I" if rng.random() < 0.5 else ">I"
    return content[:at] + struct.pack(order, int(rng.choice(_HUGE))) + content[at + 4 :]
