"""Hyperfields on disk: a zarr group with the low-rank form and the shape it belongs to."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
import zarr
from numpy.typing import NDArray

from spem.errors import ParameterError, ReadError
from spem.fields.hyperfield import Hyperfield
from spem.shapes.packing import pack_shape, unpack_shape

FORMAT = 1
# Nodes in a chunk: about a megabyte of basis.
_CHUNK = 32_768
# By these names xarray opens a stored hyperfield as a dataset; it takes no name twice in an array.
_DIMENSIONS = {
    "voxels": ("node",),
    "cut_voxel": ("cut",),
    "cut_direction": ("cut",),
    "cut_fraction": ("cut",),
    "affine": ("affine_row", "affine_column"),
    "basis": ("node", "column"),
    "gram": ("term", "other_term"),
    "mass": ("column", "other_column"),
    "stiffness": ("column", "other_column"),
    "source": ("column",),
    "rho": ("rho",),
    "edge_source": ("boundary_edge",),
}


def save_hyperfield(field: Hyperfield, path: str | Path) -> None:
    """Write a hyperfield to the zarr group `path`, replacing a hyperfield that is there and nothing else.

    The group is written beside its place and moved there when it is whole.

    Parameters
    ----------
    field
        The hyperfield.
    path
        Folder of the group, by custom ``*.zarr``.

    Raises
    ------
    ReadError
        If something else than a hyperfield is there.
    ParameterError
        If it cannot be written, or someone else is writing it.

    Examples
    --------
    >>> import spem, tempfile
    >>> field = spem.sweep(spem.synthetic.disk(radius=8.0, spacing=1.0), rho=[2, 4])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_hyperfield(field, f"{folder}/disk.zarr")
    ...     load_hyperfield(f"{folder}/disk.zarr")
    Hyperfield('disk', 193 nodes, 2 rho 2 to 4, rank ...)
    """
    target = Path(path)
    if target.exists():
        load_hyperfield(target)
    with only_writer(target):
        draft = target.with_name(target.name + ".part")
        _write(field, draft)
        put_in_place(draft, target)


def _write(field: Hyperfield, draft: Path) -> None:
    """Write all arrays and attributes to a new group."""
    shutil.rmtree(draft, ignore_errors=True)
    group = zarr.open_group(draft, mode="w")
    shape_arrays, shape_attributes = pack_shape(field.shape)
    arrays: dict[str, NDArray[Any]] = shape_arrays | {
        "basis": field.basis,
        "gram": field.gram,
        "mass": field.mass,
        "stiffness": field.stiffness,
        "source": field.source,
        "rho": field.rho,
    }
    write_arrays(group, arrays)
    own = {"spem_hyperfield": FORMAT, "boundary": field.boundary, "error": field.error}
    group.attrs.update(shape_attributes | own | {"sha256": digest(arrays)})


def load_hyperfield(path: str | Path) -> Hyperfield:
    """Read a hyperfield that `save_hyperfield` wrote.

    Raises
    ------
    ReadError
        If there is no such group, or it is not a whole hyperfield of this format.
    """
    try:
        group = zarr.open_group(path, mode="r")
        attributes = dict(group.attrs)
    except (OSError, ValueError, KeyError, TypeError) as error:
        msg = f"{path}: no hyperfield there ({error}); give a folder that Hyperfield.save wrote"
        raise ReadError(msg) from error
    if attributes.get("spem_hyperfield") != FORMAT:
        found = attributes.get("spem_hyperfield")
        msg = (
            f"{path}: expected a hyperfield of format {FORMAT}, found {found}; write it again with this spem"
        )
        raise ReadError(msg)
    try:
        arrays = {name: np.asarray(array[...]) for name, array in group.arrays()}
        if digest(arrays) == attributes["sha256"]:
            return _assemble(attributes, arrays)
        reason = "its numbers are not those that were written"
    except (KeyError, TypeError, ValueError, IndexError, RuntimeError, OSError, MemoryError) as error:
        reason = str(error)
    msg = f"{path}: the hyperfield is damaged ({reason}); write it again"
    raise ReadError(msg)


def write_arrays(group: zarr.Group, arrays: dict[str, NDArray[Any]]) -> None:
    """Write whole arrays under their names, with those of their dimensions."""
    for name, values in arrays.items():
        chunks = (min(_CHUNK, max(values.shape[0], 1)), *values.shape[1:])
        dimensions = _DIMENSIONS[name]
        group.create_array(
            name, shape=values.shape, dtype=values.dtype, chunks=chunks, dimension_names=dimensions
        )
        group[name][...] = values  # type: ignore[index]


@contextmanager
def only_writer(target: Path) -> Iterator[None]:
    """Keep others from writing to the same place meanwhile; the lock of a process that is killed falls.

    Raises
    ------
    ParameterError
        When someone else is writing there, or nothing can be written.
    """
    lock = target.with_name(f".{target.name}.lock")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with lock.open("wb") as file:
            if not _locked(file, lock):
                msg = f"{target}: is being written by another process; wait for it, or write elsewhere"
                raise ParameterError(msg)
            try:
                yield
            finally:
                lock.unlink(missing_ok=True)
    except OSError as error:
        msg = f"{target}: cannot be written ({error}); give a place in a writable folder with room"
        raise ParameterError(msg) from error


def _locked(file: IO[bytes], lock: Path) -> bool:
    """Lock a file, if nobody has; not one that its last owner has just removed."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return os.path.samestat(os.fstat(file.fileno()), lock.stat())
    except (BlockingIOError, FileNotFoundError):
        return False


def put_in_place(draft: Path, target: Path) -> None:
    """Move a whole draft to its place, over what is there."""
    old = target.with_name(target.name + ".old")
    shutil.rmtree(old, ignore_errors=True)
    if target.exists():
        target.rename(old)
    draft.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def digest(arrays: dict[str, NDArray[Any]]) -> str:
    """SHA-256 of names, types, shapes and bytes."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        total.update(f"{name} {values.dtype.str} {values.shape}".encode())
        total.update(values.tobytes())
    return total.hexdigest()


def _assemble(attributes: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Hyperfield:
    """Put shape and hyperfield together from what was stored."""
    return Hyperfield(
        unpack_shape(arrays, attributes),
        arrays["rho"],
        arrays["basis"],
        arrays["gram"],
        arrays["mass"],
        arrays["stiffness"],
        arrays["source"],
        attributes["boundary"],
        attributes["error"],
    )
