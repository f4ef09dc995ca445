"""Volume files decoded to an array with its spacing: NumPy, TIFF stacks, NIfTI."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ReadError, SpemError
from spem.shapes.grids import declared_spacing
from spem.shapes.kinds import TIFF_SUFFIXES
from spem.shapes.limits import check_file, check_size, printable

# Arrays of an .npz in the order in which they are looked for.
_ARRAYS = ("mask", "volume", "labels")
# How many names of arrays a message lists.
_LISTED = 8
# NumPy refuses longer ones too, but only after it made room for them.
_LONGEST_HEADER = 10_000
_UNIT_AXES = "CTS"


@dataclass(frozen=True, eq=False)
class Stack:
    """The array of a volume and where it lies.

    Parameters
    ----------
    array
        ``(n_0, ..., n_{d-1})`` values at the voxel centres.
    spacing
        ``(d,)`` distance between voxel centres.
    origin
        ``(d,)`` coordinates of the centre of ``array[0, ..., 0]``.
    name
        Short name.
    source
        The file or call.
    affine
        ``(w + 1, d + 1)`` map from index to the w world coordinates, or None.
    notes
        What a report should say of the reading.
    """

    array: NDArray[Any]
    spacing: tuple[float, ...]
    origin: tuple[float, ...]
    name: str
    source: str
    affine: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def with_spacing(self, spacing: float | tuple[float, ...] | None, name: str) -> Stack:
        """Return the stack with another spacing, unless it is None.

        Raises
        ------
        ParameterError
            When it is not one positive number for all or each axis.
        """
        if spacing is None:
            return self
        return replace(self, spacing=declared_spacing(spacing, self.array.ndim, name))


def read_stack(path: Path, bytes_per_voxel: float, memory_limit: int | None) -> Stack:
    """Decode a volume file, after its header has been checked against the memory limit.

    In files whose axes have names (TIFF, NIfTI), axes of length one are dropped, and several times
    or channels are refused.

    Parameters
    ----------
    path
        A file with suffix .npy, .npz, .tif, .tiff, .nii or .nii.gz.
    bytes_per_voxel
        Most bytes that will be held for one voxel.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.

    Raises
    ------
    ReadError
        When the file is missing, empty, damaged or of another kind.
    SizeError
        When the header asks for more memory than the limit.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.savez(Path(folder, "box.npz"), mask=np.ones((2, 2)), spacing=[0.5, 2])
    ...     read_stack(Path(folder, "box.npz"), 8, None).spacing
    (0.5, 2.0)
    """
    check_file(path)
    decoder = _decoder(path)

    def check(shape: tuple[int, ...]) -> None:
        check_size(shape, bytes_per_voxel, memory_limit, str(path))

    try:
        stack = decoder(path, check)
    except SpemError:
        raise
    except MemoryError:
        raise
    except Exception as error:
        msg = f"{path}: damaged, truncated or not a {path.suffix} file ({printable(error)}); write it again"
        raise ReadError(msg) from error
    if stack.array.ndim == 0 or stack.array.size == 0 or stack.array.dtype.kind not in "biuf":
        msg = f"{path}: expected an array of numbers, got {stack.array.dtype} of shape {stack.array.shape}"
        raise ReadError(msg)
    return stack


def tiff_pages(path: Path) -> int:
    """Return the number of pages of a TIFF, 1 when it cannot be told; more than one are a volume."""
    import tifffile

    try:
        with tifffile.TiffFile(path) as tiff:
            series = tiff.series[0]
            return int(np.prod([n for n, a in zip(series.shape, series.axes, strict=True) if a not in "YXS"]))
    except Exception:  # noqa: BLE001 the image reader then says what is wrong with the file
        return 1


_Check = Callable[[tuple[int, ...]], None]


def _decoder(path: Path) -> Callable[[Path, _Check], Stack]:
    """Return the function that decodes files of this kind."""
    name = path.name.lower()
    decoders = {
        ".npy": _npy,
        ".npz": _npz,
        ".nii": _nifti,
        ".nii.gz": _nifti,
        **dict.fromkeys(TIFF_SUFFIXES, _tiff),
    }
    for suffix, decoder in decoders.items():
        if name.endswith(suffix):
            return decoder
    msg = f"{path}: not a volume file; expected one of {', '.join(decoders)}"
    raise ReadError(msg)


def _npy(path: Path, check: _Check) -> Stack:
    """Decode a NumPy array, after its header."""
    with path.open("rb") as file:
        check(_array_shape(file, str(path)))
    array = np.load(path, allow_pickle=False)
    return Stack(array, (1.0,) * array.ndim, (0.0,) * array.ndim, path.stem, str(path))


def _npz(path: Path, check: _Check) -> Stack:
    """Decode the volume of an archive of arrays, with its spacing and origin."""
    if not zipfile.is_zipfile(path):
        msg = f"{path}: damaged, truncated or not a .npz file (no archive of arrays); write it again"
        raise ReadError(msg)
    with np.load(path, allow_pickle=False) as archive:
        names = [n for n in archive.files if n not in ("spacing", "origin")]
        known = [n for n in _ARRAYS if n in names]
        if not known and len(names) != 1:
            listed = printable(", ".join(archive.files[:_LISTED])) or "(none)"
            more = f" and {len(archive.files) - _LISTED} more" if len(archive.files) > _LISTED else ""
            msg = (
                f"{path}: no volume among its arrays {listed}{more}; "
                f"expected one named {', '.join(_ARRAYS[:-1])} or {_ARRAYS[-1]}, or one array alone"
            )
            raise ReadError(msg)
        chosen = (known or names)[0]
        with zipfile.ZipFile(path) as members:
            for name in (chosen, *({"spacing", "origin"} & set(archive.files))):
                with members.open(f"{name}.npy") as member:
                    check(_array_shape(member, f"{path}, array {name!r}"))
        array = archive[chosen]
        d = array.ndim
        spacing = archive["spacing"] if "spacing" in archive.files else np.ones(d)
        origin = archive["origin"] if "origin" in archive.files else np.zeros(d)
        note: tuple[str, ...] = () if len(names) == 1 else (f"array {chosen!r} of {len(names)}",)
        note += ("spacing from the file",) if "spacing" in archive.files else ()
    stack = Stack(array, (1.0,) * d, _per_axis(origin, d, path, "origin"), path.stem, str(path), notes=note)
    return stack.with_spacing(_per_axis(spacing, d, path, "spacing"), str(path))


def _array_shape(file: IO[bytes], what: str) -> tuple[int, ...]:
    """Return the shape of a stored NumPy array from its header alone."""
    magic = np.lib.format.MAGIC_PREFIX
    start = file.read(len(magic) + 2)
    if not start.startswith(magic):
        msg = f"{what}: damaged, truncated or not a .npy file (it does not begin as one); write it again"
        raise ReadError(msg)
    length_bytes = 2 if start[-2] == 1 else 4
    length = file.read(length_bytes)
    if int.from_bytes(length, "little") > _LONGEST_HEADER:
        msg = f"{what}: its header says it has {int.from_bytes(length, 'little')} bytes; the file is damaged"
        raise ReadError(msg)
    file.seek(-length_bytes, os.SEEK_CUR)
    read = np.lib.format.read_array_header_1_0 if start[-2] == 1 else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    if dtype.hasobject:
        msg = (
            f"{what}: holds Python objects, which spem never loads; write an array of numbers with numpy.save"
        )
        raise ReadError(msg)
    return tuple(shape)


def _per_axis(values: NDArray[Any], d: int, path: Path, what: str) -> tuple[float, ...]:
    """Return one number per axis out of a stored scalar or array."""
    if np.size(values) not in (1, d):
        msg = f"{path}: its {what} has {np.size(values)} numbers, the volume {d} axes"
        raise ReadError(msg)
    return tuple(float(v) for v in np.broadcast_to(np.ravel(values), (d,)))


def _nifti(path: Path, check: _Check) -> Stack:
    """Decode NIfTI: spacing from the zooms of the header, the affine kept beside it."""
    import nibabel

    image = nibabel.load(path)
    shape = tuple(image.shape)
    check(shape)
    if any(n > 1 for n in shape[3:]):
        times = " x ".join(map(str, shape))
        msg = f"{path}: {times} values hold several times or channels; expected one, write it alone"
        raise ReadError(msg)
    kept = [axis for axis, n in enumerate(shape) if n > 1]
    zooms = tuple(float(image.header.get_zooms()[axis]) for axis in kept)
    array = np.asanyarray(image.dataobj).reshape([shape[axis] for axis in kept])
    name = path.name[: path.name.lower().index(".nii")]
    # the axes of length one lie at index 0, so that their columns say nothing
    affine = np.asarray(image.affine, np.float64)[:, [*kept, 3]]
    known = all(0 < z < np.inf for z in zooms)
    note = "spacing from the header" if known else "no spacing in the header, 1 taken"
    d = len(kept)
    return Stack(array, zooms if known else (1.0,) * d, (0.0,) * d, name, str(path), affine, (note,))


def _tiff(path: Path, check: _Check) -> Stack:
    """Decode a TIFF stack: the first series, its axes in file order."""
    import tifffile

    with tifffile.TiffFile(path) as tiff:
        series = tiff.series[0]
        shape = tuple(int(n) for n in series.shape)
        check(shape)
        axes = "".join(a for a, n in zip(series.axes, shape, strict=True) if n > 1)
        many = [a for a in axes if a in _UNIT_AXES]
        if many:
            msg = f"{path}: axes {axes} hold several channels or times; expected one, write it alone"
            raise ReadError(msg)
        spacing, note = _tiff_spacing(tiff, axes)
        array = series.asarray().reshape([n for n in shape if n > 1])
    return Stack(array, spacing, (0.0,) * array.ndim, path.stem, str(path), notes=(note,))


def _tiff_spacing(tiff: Any, axes: str) -> tuple[tuple[float, ...], str]:
    """Return the spacing along each axis, from OME or ImageJ metadata where all of it is there."""
    found: dict[str, float] = {}
    source = ""
    if tiff.is_ome:
        import tifffile

        source = "OME"
        images = tifffile.xml2dict(tiff.ome_metadata)["OME"]["Image"]
        pixels = (images[0] if isinstance(images, list) else images)["Pixels"]
        units = {pixels.get(f"PhysicalSize{a}Unit", "µm") for a in axes}
        if len(units) == 1:
            found = {a: float(pixels[f"PhysicalSize{a}"]) for a in axes if f"PhysicalSize{a}" in pixels}
    elif tiff.is_imagej:
        source = "ImageJ"
        tags = tiff.pages[0].tags
        found = {"Z": float(tiff.imagej_metadata.get("spacing", 0))}
        for axis, tag in (("X", "XResolution"), ("Y", "YResolution")):
            count, length = tags[tag].value if tag in tags else (0, 1)
            found[axis] = length / count if count else 0.0
    spacing = tuple(found.get(a, 0.0) for a in axes)
    if spacing and all(0 < h < np.inf for h in spacing):
        return spacing, f"spacing from the {source} metadata"
    return (1.0,) * len(axes), "no spacing in the file, 1 taken"
