"""What an addition has to do, from what the index has and what the files hold now."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TypeVar

from spem.codes.sources import Source, source_path
from spem.index.filters import as_text
from spem.index.row import names_file
from spem.shapes.shape import Shape

_T = TypeVar("_T")


@dataclass(frozen=True)
class Known:
    """What a plan needs of a row.

    Parameters
    ----------
    hash
        SHA-256 of the content, in hex.
    paths
        Its path and the paths of copies, from the working directory or absolute.
    """

    hash: str
    paths: tuple[str, ...]


@dataclass(frozen=True)
class Plan:
    """What is to be done.

    Parameters
    ----------
    encode
        Content hash → its sources, of contents that have no row; the first is read, the others are copies.
    gained, lost
        Content hash → paths that its rows are to gain, and to lose; rows that lose the last go. To be
        applied when what is to be encoded is written: killed before, the same plan comes out again.
    n_unchanged
        Number of sources that have a row under their path.
    n_updated
        Number of files of `encode` and `gained` under whose path there was other content.
    """

    encode: Mapping[str, tuple[Source, ...]] = field(default_factory=dict)
    gained: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lost: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    n_unchanged: int = 0
    n_updated: int = 0


def plan(
    existing: Iterable[Known], sources: Sequence[tuple[Source, str]], *, prune: Iterable[str | Path] = ()
) -> Plan:
    """Compare files with the rows of an index.

    Equal contents are one row with several paths. A path has one content: where it holds another now, the
    row of the old one loses it. Shapes that are no files have names for paths, and lose nothing.

    Parameters
    ----------
    existing
        What the index has.
    sources
        Files and shapes, each with its content hash.
    prune
        Folders and files; paths below them that are neither among the sources nor there any more are lost.

    Examples
    --------
    >>> shown = [(Path("a.png"), "1"), (Path("b.png"), "1"), (Path("c.png"), "2")]
    >>> made = plan([Known("1", ("a.png",)), Known("3", ("c.png",))], shown)
    >>> list(made.encode), dict(made.gained), dict(made.lost)
    (['2'], {'1': ('b.png',)}, {'3': ('c.png',)})
    >>> made.n_unchanged, made.n_updated
    (1, 1)
    """
    working = str(Path.cwd())
    places: dict[str, dict[str, str]] = defaultdict(dict)
    for row in existing:
        places[row.hash] |= {_place(path, working): path for path in row.paths}
    holds: dict[str, list[str]] = defaultdict(list)
    for content, known in places.items():
        for where in known:
            holds[where].append(content)

    encode: dict[str, list[Source]] = defaultdict(list)
    gained: dict[str, list[str]] = defaultdict(list)
    lost: dict[str, dict[str, None]] = defaultdict(dict)
    seen: set[str] = set()
    unchanged = updated = 0
    for source, content in sources:
        path, is_file = source_path(source), not isinstance(source, Shape)
        where = _place(path, working)
        if is_file and where in seen:
            continue
        others = [old for old in holds.get(where, ()) if old != content] if is_file else []
        for old in others:
            lost[old][places[old][where]] = None
        updated += bool(others)
        if is_file:
            seen.add(where)
        if content not in places:
            encode[content].append(source)
        elif where in places[content]:
            unchanged += 1
        else:
            gained[content].append(path)
    for content, path in _gone(places, seen, prune):
        lost[content][path] = None
    return Plan(_frozen(encode), _frozen(gained), _frozen(lost), unchanged, updated)


def place(path: str) -> Path:
    """Return where a file lies, whatever folder its path starts from; a link to a file is one of its own.

    Examples
    --------
    >>> place("shapes/../hand.png") == place("hand.png")
    True
    """
    return Path(_place(path, str(Path.cwd())))


def _place(path: str, working: str) -> str:
    """Return where a file lies as text, which is quicker for many of them."""
    folder, name = os.path.split(as_text(path))
    return os.path.join(_resolved(folder, working), name)  # noqa: PTH118


@cache
def _resolved(folder: str, working: str) -> str:
    """Resolve a folder once; what it means depends on the working directory."""
    return os.path.realpath(os.path.join(working, folder))  # noqa: PTH118


def _gone(
    places: Mapping[str, Mapping[str, str]], seen: set[str], prune: Iterable[str | Path]
) -> Iterable[tuple[str, str]]:
    """Yield the content and path of files below these folders that are no longer there."""
    roots = [Path(path).resolve() for path in prune]
    for content, known in places.items() if roots else ():
        for where, path in known.items():
            file = Path(where)
            below = names_file(path) and any(file.is_relative_to(root) for root in roots)
            if below and where not in seen and not file.exists():
                yield content, path


def _frozen(table: Mapping[str, Iterable[_T]]) -> dict[str, tuple[_T, ...]]:
    """Return a table of tuples."""
    return {key: tuple(values) for key, values in table.items()}
