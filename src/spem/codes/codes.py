"""The codes of a collection, with the names of its shapes and the model they were made with."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.container import read_container, write_container
from spem.codes.model import Model
from spem.codes.places import found_path, stored_path
from spem.errors import ModelError, ParameterError, ReadError


@dataclass(frozen=True)
class Failure:
    """A file that got no code.

    Parameters
    ----------
    path
        The file.
    reason
        The message of the error.
    """

    path: str
    reason: str

    def __str__(self) -> str:
        said = self.reason.startswith(self.path)
        return self.reason if said else f"{self.path}: {self.reason}"


@dataclass(frozen=True, eq=False)
class Codes:
    """Codes of the shapes of a collection.

    Parameters
    ----------
    names
        ``(n_shapes,)`` names for people.
    paths
        ``(n_shapes,)`` files, as they were given; in a codes file relative ones start from its folder.
    hashes
        ``(n_shapes,)`` SHA-256 of each file's bytes, in hex: equal files are told by it.
    vectors
        ``(n_shapes, n_code)`` codes.
    model
        What they were made with.
    failures
        Files of the collection that got no code, and why.
    volumes
        ``(n_shapes,)`` volumes, areas in 2-D, in the unit of each file to the power of the dimension; nan
        where they are not known, as of files from before they were kept.
    """

    names: tuple[str, ...]
    paths: tuple[str, ...]
    hashes: tuple[str, ...]
    vectors: NDArray[np.float32]
    model: Model
    failures: tuple[Failure, ...] = ()
    volumes: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "vectors", np.ascontiguousarray(self.vectors, np.float32))
        for column in ("names", "paths", "hashes", "failures"):
            object.__setattr__(self, column, tuple(getattr(self, column)))
        volumes = np.asarray(self.volumes, np.float64)
        object.__setattr__(self, "volumes", volumes if volumes.size else np.full(len(self.names), np.nan))
        if self.volumes.shape != (len(self.names),):
            msg = f"volumes of shape {self.volumes.shape}; expected one for each of {len(self.names)} shapes"
            raise ParameterError(msg)
        expected = (len(self.names), self.model.n_code)
        if self.vectors.shape != expected or not len(self.names) == len(self.paths) == len(self.hashes):
            msg = (
                f"{len(self.names)} names, {len(self.paths)} paths, {len(self.hashes)} hashes and vectors "
                f"{self.vectors.shape}; expected one of each a shape and vectors {expected}"
            )
            raise ParameterError(msg)

    def __len__(self) -> int:
        return len(self.names)

    def require_same_model(self, other: Codes | Model, name: str = "the query") -> None:
        """Refuse codes that cannot be compared with these.

        Parameters
        ----------
        other
            Codes, or the model that a query is to be coded with.
        name
            What to call `other` in the message.

        Raises
        ------
        ModelError
            When `other` was made with another vocabulary, settings or version.
        """
        model = other.model if isinstance(other, Codes) else other
        if model.digest == self.model.digest:
            return
        mine, theirs = self.model.settings.to_json(), model.settings.to_json()
        # What several kinds leave to each of them says nothing beside what one kind has.
        odd = [
            f"{key} {theirs[key]} against {mine[key]}"
            for key in mine
            if mine[key] != theirs[key]
            and (mine["features"] == theirs["features"] or None not in (mine[key], theirs[key]))
        ]
        why = "; ".join(odd) or "the same settings but another vocabulary"
        msg = (
            f"{name} has model {model.digest}, these codes have {self.model.digest} ({why}); "
            "make both with one model"
        )
        raise ModelError(msg)

    def take(self, index: Sequence[int] | NDArray[np.integer]) -> Codes:
        """Return the codes of some shapes, in the given order, without the failures."""
        rows = [int(i) for i in index]
        names, paths, hashes = (
            tuple(column[i] for i in rows) for column in (self.names, self.paths, self.hashes)
        )
        vectors, volumes = self.vectors[rows], self.volumes[rows]
        return Codes(names, paths, hashes, vectors, self.model, volumes=volumes)

    def join(self, other: Codes) -> Codes:
        """Return these codes followed by others of the same model.

        Raises
        ------
        ModelError
            When the models differ.
        """
        self.require_same_model(other, "the second collection")
        return Codes(
            self.names + other.names,
            self.paths + other.paths,
            self.hashes + other.hashes,
            np.concatenate([self.vectors, other.vectors]),
            self.model,
            self.failures + other.failures,
            np.concatenate([self.volumes, other.volumes]),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write codes and model to one file, in one step."""
        folder = Path(path).parent
        header = {
            "names": list(self.names),
            "paths": [stored_path(each, folder) for each in self.paths],
            "hashes": list(self.hashes),
            "failures": [[stored_path(each.path, folder), each.reason] for each in self.failures],
            **self.model.to_header(),
        }
        arrays: dict[str, NDArray[Any]] = {"vectors": self.vectors, "volumes": self.volumes}
        write_container(path, "codes", header, arrays | self.model.to_arrays("model."))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read codes.

        Raises
        ------
        ReadError
            When the file is missing, truncated, changed, or holds no codes.
        ModelError
            When it was made by another version of the method.
        """
        header, arrays = read_container(path, "codes")
        model = Model.from_parts(header, arrays, str(path), "model.")
        try:
            names, stored, hashes = (tuple(header[key]) for key in ("names", "paths", "hashes"))
            folder = Path(path).parent
            paths = tuple(found_path(each, folder) for each in stored)
            failures = tuple(Failure(found_path(each, folder), reason) for each, reason in header["failures"])
            _check_contents(arrays["vectors"], (*names, *stored, *hashes))
            volumes = np.asarray(arrays.get("volumes", ()), np.float64)
            return cls(names, paths, hashes, arrays["vectors"], model, failures, volumes)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            msg = f"{path}: not whole codes ({error}); make it again"
            raise ReadError(msg) from error

    def __repr__(self) -> str:
        return f"Codes({len(self)} shapes, {len(self.failures)} failures, {self.model!r})"


def _check_contents(vectors: NDArray[Any], texts: Sequence[Any]) -> None:
    """Refuse what no code and no name is, since the hash of a file vouches for its bytes alone."""
    if vectors.dtype.kind != "f" or not np.isfinite(vectors).all():
        msg = "vectors that are no finite numbers"
        raise TypeError(msg)
    if not all(isinstance(text, str) for text in texts):
        msg = "names, paths or hashes that are no text"
        raise TypeError(msg)


def file_hash(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file's bytes, in hex.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    ReadError
        When it cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "abc").write_bytes(b"abc")
    ...     file_hash(Path(folder, "abc"))[:12]
    'ba7816bf8f01'
    """
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError as error:
        msg = f"{path}: no such file; check the path"
        raise ReadError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check its permissions"
        raise ReadError(msg) from error
