"""The sources of a collection by content, and what failed so far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from spem.codes.codes import Failure
from spem.codes.sources import Source, as_source, source_hash, source_path
from spem.codes.workers import one_line
from spem.errors import SpemError
from spem.shapes.shape import Shape


class Listing:
    """Sources in their order, each with the hash of its content, and a growing list of failures.

    Parameters
    ----------
    sources
        Files or shapes; one that cannot be read is a failure at once.
    report
        Called for each failure when it happens.

    Attributes
    ----------
    sources
        The sources, in order.
    first
        Hash -> first source of that content.
    broken
        Hashes of sources that failed as a whole, with the reason.
    failures
        All failures so far.

    Examples
    --------
    >>> Listing(["no such file.obj"]).failures[0].path
    'no such file.obj'
    """

    def __init__(
        self, sources: Iterable[str | Path | Shape], report: Callable[[Failure], None] | None = None
    ) -> None:
        self.sources: list[Source] = [as_source(source) for source in sources]
        self.first: dict[str, Source] = {}
        self.broken: dict[str, str] = {}
        self.failures: list[Failure] = []
        self._report = report
        self._keys = [self._hash(source) for source in self.sources]

    def __iter__(self) -> Iterator[tuple[Source, str | None]]:
        """Yield each source and its hash, None where it could not be read."""
        return iter(zip(self.sources, self._keys, strict=True))

    def fail(self, source: Source, reason: str, key: str | None = None) -> None:
        """Note and report a failure; with `key`, that of everything of this content."""
        if key is not None:
            self.broken[key] = reason
        failure = Failure(source_path(source), reason)
        self.failures.append(failure)
        if self._report is not None:
            self._report(failure)

    def fails_again(self, key: str, source: Source) -> bool:
        """Tell whether this content failed; a copy of the file that did is a failure of its own."""
        if key in self.broken and source is not self.first[key]:
            self.fail(source, self.broken[key])
        return key in self.broken

    def _hash(self, source: Source) -> str | None:
        """Return the hash of a source, or note why there is none."""
        try:
            key = source_hash(source)
        except SpemError as error:
            self.fail(source, one_line(error))
            return None
        self.first.setdefault(key, source)
        return key
