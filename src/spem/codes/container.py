"""The file of models and codes: arrays and a JSON header in one npz, hashed, without pickle."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ModelError, ReadError
from spem.files import DAMAGE, write_whole
from spem.shapes.kinds import kind_of

# Raised when the layout of the file changes: names of arrays, keys of the header, the hash.
CONTAINER_FORMAT = 1


def content_hash(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> str:
    """Return the SHA-256, in hex, of a header and arrays: values, types, shapes and names.

    Parameters
    ----------
    header
        What `json` can write; the order of its keys does not matter.
    arrays
        Arrays by name; their order and memory layout do not matter.

    Examples
    --------
    >>> content_hash({"a": 1, "b": 2}, {}) == content_hash({"b": 2, "a": 1}, {})
    True
    """
    digest = hashlib.sha256(_to_json(header))
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"\n{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def write_container(
    path: str | os.PathLike[str], kind: str, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write a header and arrays to one file: all of it or, on any failure, nothing.

    Parameters
    ----------
    path
        File to write; one that is there is replaced at the end, in one step.
    kind
        What the file is, so that a model is not taken for codes.
    header
        What `json` can write.
    arrays
        Arrays by name, of plain types.

    Raises
    ------
    ParameterError
        When the folder is not there or cannot be written.
    """
    envelope = {"kind": kind, "format": CONTAINER_FORMAT, "header": dict(header)}
    members = {**arrays, "header": np.frombuffer(_to_json(envelope), np.uint8)}
    members["sha256"] = np.frombuffer(bytes.fromhex(content_hash(envelope, arrays)), np.uint8)
    write_whole(path, lambda file: _write_members(file, members))


def read_container(path: str | os.PathLike[str], kind: str) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Read what `write_container` wrote, and refuse anything else.

    Parameters
    ----------
    path
        File to read.
    kind
        What the file must be.

    Returns
    -------
    tuple
        The header and the arrays by name.

    Raises
    ------
    ReadError
        When the file is missing, truncated, changed after it was written, or of another kind.
    ModelError
        When it was written by a later version of spem.
    """
    source = Path(path)
    if not source.is_file():
        msg = f"{source}: no such file; expected spem {kind}"
        raise ReadError(msg)
    try:
        members = _read_members(source)
        stated = members.pop("sha256").tobytes().hex()
        envelope = json.loads(members.pop("header").tobytes())
        found, version, header = envelope["kind"], int(envelope["format"]), dict(envelope["header"])
    except DAMAGE as error:
        other = kind_of(source)
        if other:
            msg = f"{source}: is {other}, not spem {kind}; give another file"
            raise ReadError(msg) from error
        msg = f"{source}: not a whole file of spem {kind}; it may be truncated: make it again"
        raise ReadError(msg) from error
    if version > CONTAINER_FORMAT:
        msg = f"{source}: file format {version} is later than {CONTAINER_FORMAT}; upgrade spem to read it"
        raise ModelError(msg)
    if found != kind:
        msg = f"{source}: is a file of spem {found}, expected spem {kind}"
        raise ReadError(msg)
    if content_hash(envelope, members) != stated:
        msg = f"{source}: contents do not match their SHA-256; the file was changed or damaged: make it again"
        raise ReadError(msg)
    return header, members


def _write_members(file: IO[bytes], members: Mapping[str, NDArray[Any]]) -> None:
    """Write an npz without compression; equal arrays make equal files, for zip's default date is fixed."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, array in members.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)


def _read_members(source: Path) -> dict[str, NDArray[Any]]:
    """Read all arrays; members must be stored plainly, so none can unpack to more than the file holds."""
    with zipfile.ZipFile(source) as archive:
        size = source.stat().st_size
        for member in archive.infolist():
            if member.compress_type != zipfile.ZIP_STORED or member.file_size > size:
                msg = f"{source}: member {member.filename} is compressed"
                raise ValueError(msg)
    with np.load(source, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _to_json(header: Mapping[str, Any]) -> bytes:
    """Write JSON in one canonical way, so that equal headers have equal hashes."""
    return json.dumps(header, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
