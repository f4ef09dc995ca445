"""The full hyperfield on disk: a zarr group written and read block by block, each with its hash."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray

from spem.errors import ReadError
from spem.fields.boundary.sources import restore_sources
from spem.fields.operator import assemble
from spem.fields.storage import digest, only_writer, put_in_place, write_arrays
from spem.fields.superposition.fields import Progress
from spem.fields.superposition.hyperfield import SourceHyperfield
from spem.shapes.packing import pack_shape, unpack_shape

FORMAT = 1
_MARK = "spem_source_hyperfield"
_FIELDS, _HASHES = "fields", "hashes"


def save_source_hyperfield(
    hyperfield: SourceHyperfield, path: str | Path, progress: Progress | None = None
) -> None:
    """Write a hyperfield to the zarr group `path`, replacing one that is there and nothing else.

    The group is written beside its place, in ``path.part``, and moved there when it is whole. A save that
    was stopped continues with the blocks that are still missing.

    Parameters
    ----------
    hyperfield
        The hyperfield; its fields are solved block by block, never held all at once.
    path
        Folder of the group, by custom ``*.zarr``.
    progress
        Called with ``"fields"``, the number of fields written and that of all.

    Raises
    ------
    ReadError
        If something else than a hyperfield over sources is there.
    ParameterError
        If it cannot be written, or someone else is writing it.

    Examples
    --------
    >>> import tempfile
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones((3, 4)))))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_source_hyperfield(SourceHyperfield(sources, [2.0, np.inf]), f"{folder}/brick.zarr")
    ...     load_source_hyperfield(f"{folder}/brick.zarr")
    SourceHyperfield('shape', 2 rho 2 to inf, 14 sources, 12 nodes)
    """
    target = Path(path)
    if target.exists():
        _open(target)
    draft = target.with_name(target.name + ".part")
    with only_writer(target):
        _write(hyperfield, draft, progress)
        put_in_place(draft, target)


def _write(hyperfield: SourceHyperfield, draft: Path, progress: Progress | None) -> None:
    """Write what is still missing of a draft."""
    group = _begin(hyperfield, draft)
    fields, hashes = _array(group, _FIELDS), _array(group, _HASHES)
    size, blocks = fields.chunks[1], hyperfield.blocks
    n_rho, n_sources, _ = hyperfield.size
    done = np.asarray(np.asarray(hashes[...]).any(axis=2))  # (n_rho, n_blocks)
    for index, block in np.ndindex(n_rho, done.shape[1]):
        start, stop = block * size, min((block + 1) * size, n_sources)
        if not done[index, block]:
            values = hyperfield.take((index, slice(start, stop), slice(None)), log=blocks.log)
            fields[index, start:stop] = values
            hashes[index, block] = _hash(values)
        if progress is not None:
            progress("fields", index * n_sources + stop, n_rho * n_sources)


def load_source_hyperfield(path: str | Path, memory_limit: int | None = None) -> SourceHyperfield:
    """Open a hyperfield that `save_source_hyperfield` wrote; fields are read when they are asked for.

    Raises
    ------
    ReadError
        If there is no such group, or it is not a whole one of this format; later, when a block that is
        asked for turns out to be damaged.
    """
    group, attributes = _open(path)
    try:
        arrays = _head(group)
        if _seal(arrays, attributes) != attributes["sha256"]:
            raise _damaged(path, "its numbers are not those that were written")
        system = assemble(unpack_shape(arrays, attributes), attributes["boundary"])
        stored = StoredBlocks(Path(path), _array(group, _FIELDS), _array(group, _HASHES), attributes["log"])
        sources = restore_sources(system, arrays["edge_source"])
    except (KeyError, TypeError, ValueError, IndexError, RuntimeError, OSError, MemoryError) as error:
        raise _damaged(path, str(error)) from error
    return SourceHyperfield(sources, arrays["rho"], memory_limit=memory_limit, stored=stored)


@dataclass(frozen=True, eq=False)
class StoredBlocks:
    """Blocks of a zarr group.

    Parameters
    ----------
    path
        Its folder, for messages.
    fields
        ``(n_rho, n_sources, n_nodes)`` the fields, in chunks of one block.
    hashes
        ``(n_rho, n_blocks, 32)`` SHA-256 of each block, zeros where it is not written.
    log
        Whether the fields are logarithms.
    """

    path: Path
    fields: zarr.Array[Any]
    hashes: zarr.Array[Any]
    log: bool

    @property
    def size(self) -> int:
        """Sources in a block."""
        return int(self.fields.chunks[1])

    def read(self, index: int, start: int, stop: int) -> NDArray[np.float64]:
        """Read one block and check it.

        Raises
        ------
        ReadError
            If it is not what was written.
        """
        try:
            values = np.asarray(self.fields[index, start:stop])
            if np.array_equal(np.asarray(self.hashes[index, start // self.size]), _hash(values)):
                return values
            reason = f"sources {start} to {stop - 1} at rho {index} are not those that were written"
        except (ValueError, RuntimeError, OSError) as error:
            reason = str(error)
        raise _damaged(self.path, reason)


def _open(path: str | Path) -> tuple[zarr.Group, dict[str, Any]]:
    """Open a group that a save began."""
    try:
        group = zarr.open_group(path, mode="r")
        attributes = dict(group.attrs)
    except (OSError, ValueError, KeyError, TypeError) as error:
        msg = f"{path}: no hyperfield over sources there ({error}); give a folder that its save wrote"
        raise ReadError(msg) from error
    if attributes.get(_MARK) != FORMAT:
        found = attributes.get(_MARK)
        msg = f"{path}: expected a hyperfield over sources of format {FORMAT}, found {found}; write it again"
        raise ReadError(msg)
    return group, attributes


def _begin(hyperfield: SourceHyperfield, draft: Path) -> zarr.Group:
    """Open the draft of a save that was stopped, if it is of the same hyperfield, or a new one."""
    sources, system = hyperfield.sources, hyperfield.sources.system
    arrays, attributes = pack_shape(hyperfield.shape)
    arrays |= {"rho": hyperfield.rho, "edge_source": sources.edge_source}
    attributes |= {_MARK: FORMAT, "boundary": system.boundary, "log": hyperfield.blocks.log}
    attributes["sha256"] = _seal(arrays, attributes)
    try:
        if _open(draft)[1]["sha256"] == attributes["sha256"]:
            return zarr.open_group(draft, mode="r+")
    except (ReadError, KeyError):
        pass
    shutil.rmtree(draft, ignore_errors=True)
    group = zarr.open_group(draft, mode="w")
    write_arrays(group, arrays)
    n_rho, n_sources, n_nodes = hyperfield.size
    size = hyperfield.blocks.size
    chunks = (1, min(size, n_sources), n_nodes)
    # logarithms of fields have too many random digits to be worth compressing
    group.create_array(
        _FIELDS,
        shape=hyperfield.size,
        dtype=np.float64,
        chunks=chunks,
        compressors=None,
        dimension_names=("rho", "source", "node"),
    )
    group.create_array(
        _HASHES,
        shape=(n_rho, -(-n_sources // size), 32),
        dtype=np.uint8,
        chunks=(1, 1, 32),
        dimension_names=("rho", "block", "byte"),
    )
    # last, so that a draft without it is known to be incomplete
    group.attrs.update(attributes)
    return group


def _head(group: zarr.Group) -> dict[str, NDArray[Any]]:
    """Read all arrays but the fields."""
    return {name: np.asarray(a[...]) for name, a in group.arrays() if name not in (_FIELDS, _HASHES)}


def _seal(arrays: dict[str, NDArray[Any]], attributes: dict[str, Any]) -> str:
    """SHA-256 of all arrays but the fields, and of the attributes."""
    told = json.dumps({key: attributes[key] for key in sorted(attributes) if key != "sha256"})
    return digest(arrays | {"attributes": np.frombuffer(told.encode(), np.uint8)})


def _array(group: zarr.Group, name: str) -> zarr.Array[Any]:
    """Return an array of a group."""
    found = group[name]
    if not isinstance(found, zarr.Array):
        msg = f"{name} is no array"
        raise TypeError(msg)
    return found


def _hash(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    """SHA-256 of a block, ``(32,)``."""
    return np.frombuffer(hashlib.sha256(np.ascontiguousarray(values).tobytes()).digest(), np.uint8)


def _damaged(path: str | Path, reason: str) -> ReadError:
    """Return the error for a store that is not what was written."""
    return ReadError(f"{path}: the hyperfield is damaged ({reason}); write it again")
