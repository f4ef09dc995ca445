"""The work folder of a collection: what each source came to, kept until the codes are saved."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.container import content_hash, read_container, write_container
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ParameterError, SpemError

_KIND = "work"
_SUFFIX = ".work"
# Raised when the layout of these files changes.
_LAYOUT = 3
# Length of the digest that a folder of work is named by.
_DIGITS, _HEX = 12, set("0123456789abcdef")
# Settings that change codes but not the features that they are made of.
_LATER = ("n_centers", "power", "scaling", "moments", "levels", "nodes_per_shape", "seed")


@dataclass(frozen=True)
class Entry:
    """What one shape of a source came to.

    Parameters
    ----------
    suffix
        What tells the shape from others of its source.
    reason
        Why there is nothing, or empty.
    ndim
        Dimension of the shape; 0 where there is nothing.
    arrays
        Node features of each band ``(n_nodes, n_maps)``, or one code ``(n_code,)``.
    volume
        Volume of the shape, in the unit of its file to the power of its dimension; nan where it is not known.
    """

    suffix: str
    reason: str = ""
    ndim: int = 0
    arrays: tuple[NDArray[Any], ...] = ()
    volume: float = math.nan


def dimension(entries: Iterable[Entry]) -> int:
    """Return the dimension that the shapes of a source have, 0 where none gave anything.

    Examples
    --------
    >>> dimension([Entry("-2", "too thin"), Entry("-3", ndim=3)])
    3
    """
    return max((entry.ndim for entry in entries), default=0)


@dataclass(frozen=True)
class Work:
    """A folder with a file for each source that is done, named by the hash of the source.

    Parameters
    ----------
    folder
        Where the files lie; one for each digest of settings or model.
    """

    folder: Path

    @classmethod
    def open(cls, root: Path, settings: Settings, model: Model | None = None) -> Work:
        """Make the folder under `root` that belongs to these settings, or to this model.

        Its name tells settings, their ``code_format`` and the version of spem apart; a change of the
        source that raises neither is not seen, and work from before it is believed.

        Raises
        ------
        ParameterError
            When the folder cannot be made.
        """
        values = {key: value for key, value in settings.to_json().items() if key not in _LATER}
        digest = (
            content_hash({"features": values, "entries": _LAYOUT}, {})[:_DIGITS]
            if model is None
            else model.digest
        )
        folder = root / digest
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"{root}: the work folder cannot be made ({error.strerror}); write to another folder"
            raise ParameterError(msg) from error
        return cls(folder)

    def dimension(self, key: str) -> int | None:
        """Return the dimension of a source, as `dimension` does; None where it is not done."""
        try:
            return dimension(self.load(key))
        except SpemError:
            return None

    def save(self, key: str, entries: list[Entry]) -> None:
        """Write what a source came to, in one step."""
        header = {"shapes": [[e.suffix, e.reason, e.ndim, len(e.arrays)] for e in entries]}
        arrays = {f"{i}.{j}": a for i, entry in enumerate(entries) for j, a in enumerate(entry.arrays)}
        arrays["volumes"] = np.array([entry.volume for entry in entries])
        write_container(self.folder / f"{key}{_SUFFIX}", _KIND, header, arrays)

    def load(self, key: str) -> list[Entry]:
        """Read what a source came to.

        Raises
        ------
        ReadError
            When it is not there, or damaged.
        """
        header, arrays = read_container(self.folder / f"{key}{_SUFFIX}", _KIND)
        volumes = arrays["volumes"].tolist()
        return [
            Entry(
                suffix, reason, ndim, tuple(np.asarray(arrays[f"{i}.{j}"]) for j in range(count)), volumes[i]
            )
            for i, (suffix, reason, ndim, count) in enumerate(header["shapes"])
        ]

    def features(self, keys: list[str], limit: int) -> WorkFeatures:
        """Return the node features of the sources, of at most `limit` shapes."""
        return WorkFeatures(self, tuple(keys), limit)


@dataclass(frozen=True)
class WorkFeatures:
    """Node features in a work folder, read shape by shape each time they are gone through.

    Parameters
    ----------
    work
        The folder.
    keys
        Sources, in order.
    limit
        Most shapes.
    """

    work: Work
    keys: tuple[str, ...]
    limit: int

    def __iter__(self) -> Iterator[tuple[NDArray[Any], ...]]:
        entries = (entry for key in self.keys for entry in self.work.load(key) if entry.arrays)
        return (entry.arrays for entry in islice(entries, self.limit))


def clear_work(root: str | Path) -> None:
    """Delete the work of all settings and models below a folder, once the codes are saved.

    What spem did not write stays, and the folders that hold it; those left empty go, `root` too.

    Parameters
    ----------
    root
        The work folder; nothing is done where it is not there.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Work.open(Path(folder, "work"), Settings(features="spem"))
    ...     clear_work(Path(folder, "work"))
    ...     Path(folder, "work").exists()
    False
    """
    top = Path(root)
    folders = [path for path in top.glob("?" * _DIGITS) if path.is_dir() and not set(path.name) - _HEX]
    for folder in folders:
        # A name that goes on after the suffix is of a file whose writing was cut off.
        for file in (*folder.glob(f"*{_SUFFIX}"), *folder.glob(f".*{_SUFFIX}.*")):
            file.unlink(missing_ok=True)
    for folder in (*folders, top):
        # The folder holds something else, or is gone.
        with suppress(OSError):
            folder.rmdir()
