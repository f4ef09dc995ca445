"""Shapes out of volumes: masks, label volumes and grey volumes, of any dimension."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from spem.errors import ParameterError, ShapeError
from spem.shapes.levels import (
    Side,
    border_repairs,
    level_shape,
    otsu_level,
    refuse_non_finite,
    signed_distance_shape,
)
from spem.shapes.limits import check_size
from spem.shapes.shape import Report, Shape
from spem.shapes.stacks import Stack, read_stack

# The array, its level function as float64 twice, masks: the most held for one voxel.
_BYTES_PER_VOXEL = 28
# Up to this many whole values are labels whatever their pattern.
_FEW_LABELS = 32
_LISTED = 12


def read_volume(
    path: str | Path,
    *,
    label: int | None = None,
    threshold: float | None = None,
    signed_distance: Side | None = None,
    spacing: float | tuple[float, ...] | None = None,
    memory_limit: int | None = None,
    name: str | None = None,
) -> Shape:
    """Read one shape from a volume file: .npy, .npz, a TIFF stack, NIfTI.

    Parameters
    ----------
    path
        The file. An .npz holds the volume as `mask`, `volume`, `labels` or its only array, and may
        hold `spacing` and `origin`.
    label
        The label to take from a label volume; all that are not zero by default.
    threshold
        The grey level of the surface; by Otsu's method by default.
    signed_distance
        The values are signed distances to the surface, which have this sign inside.
    spacing
        Distance between voxel centres; the file's own by default, or 1.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Name of the shape; the file's by default.

    Raises
    ------
    ReadError
        When the file is missing, empty, damaged or no volume.
    SizeError
        When reading would pass the memory limit; told from the file's header.
    ShapeError
        As `volume_shape`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "box.npy"), np.ones((3, 4, 5), bool))
    ...     read_volume(Path(folder, "box.npy"))
    Shape('box', 3-D, 60 nodes, grid 5 x 6 x 7, spacing 1 x 1 x 1)
    """
    stack = read_stack(Path(path), _BYTES_PER_VOXEL, memory_limit)
    name = name or stack.name
    return _shape(stack.with_spacing(spacing, name), label, threshold, signed_distance, name)


def read_labels(
    path: str | Path,
    *,
    per_label: bool | None = None,
    spacing: float | tuple[float, ...] | None = None,
    memory_limit: int | None = None,
    name: str | None = None,
) -> list[Shape]:
    """Read one shape for each non-zero label of a label volume, named "<name>-<label>".

    A volume that is a mask or a grey volume gives one shape, under its own name, unless `per_label` says that
    its values are labels.

    Parameters
    ----------
    path, spacing, memory_limit, name
        As `read_volume`.
    per_label
        Whether the values are labels, whatever they look like; told by `volume_shape`'s rule where None.

    Raises
    ------
    ReadError, SizeError, ShapeError
        As `read_volume`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "teeth.npy"), [[0, 3, 3, 0, 7]])
    ...     [shape.name for shape in read_labels(Path(folder, "teeth.npy"))]
    ['teeth-3', 'teeth-7']
    """
    stack = read_stack(Path(path), _BYTES_PER_VOXEL, memory_limit)
    name = name or stack.name
    stack = stack.with_spacing(spacing, name)
    refuse_non_finite(stack.array, name)
    kind, values = _kind(stack.array)
    if kind != "labels" and not per_label:
        return [_shape(stack, None, None, None, name)]
    if per_label:
        values = _labels(stack.array, name)
    found = values[values != 0]
    dense = np.searchsorted(found, stack.array) + 1
    dense[stack.array == 0] = 0
    shapes = []
    for number, box in enumerate(ndimage.find_objects(dense), start=1):
        inside = dense[box] == number
        origin = tuple(o + h * s.start for o, h, s in zip(stack.origin, stack.spacing, box, strict=True))
        label = int(found[number - 1])
        shapes.append(
            Shape.from_mask(
                inside,
                stack.spacing,
                origin=origin,
                name=f"{name}-{label}",
                report=_report(stack, f"label {label} of {found.size}"),
                affine=stack.affine,
            )
        )
    return shapes


def volume_shape(
    array: ArrayLike,
    spacing: float | tuple[float, ...] = 1.0,
    *,
    label: int | None = None,
    threshold: float | None = None,
    signed_distance: Side | None = None,
    origin: tuple[float, ...] | None = None,
    memory_limit: int | None = None,
    name: str = "volume",
) -> Shape:
    """Make a shape of an array: a mask, a label volume or a grey volume.

    Two values are a mask, the non-zero or greater one inside. Whole numbers from zero up are labels,
    unless there are more than 32 of them and most voxels differ from their neighbours, or they are
    8-bit up to 255: those, and all others, are grey levels, inside above `level`.

    Parameters
    ----------
    array
        ``(n_0, ..., n_{d-1})`` values.
    spacing
        One spacing for all axes, or one per axis.
    label
        The label to take; all that are not zero by default.
    threshold
        The grey level of the surface; by Otsu's method by default.
    signed_distance
        The values are signed distances to the surface, which have this sign inside.
    origin
        Coordinates of the centre of ``array[0, ..., 0]``; zeros by default.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Short name.

    Raises
    ------
    ShapeError
        When a value is NaN or infinite, the label is not there, or no voxel lies inside.
    ParameterError
        When more than one of label, threshold and signed distance is given.

    Examples
    --------
    >>> volume_shape([[0, 1, 1], [0, 2, 2]], label=2).n_nodes
    2
    """
    values = np.asarray(array)
    if values.ndim == 0 or values.size == 0 or values.dtype.kind not in "biuf":
        msg = f"{name}: expected an array of numbers, got {values.dtype} of shape {values.shape}"
        raise ShapeError(msg)
    check_size(values.shape, _BYTES_PER_VOXEL, memory_limit, name)
    start = (0.0,) * values.ndim if origin is None else tuple(map(float, origin))
    stack = Stack(values, (1.0,) * values.ndim, start, name, "array").with_spacing(spacing, name)
    return _shape(stack, label, threshold, signed_distance, name)


def _shape(
    stack: Stack, label: int | None, threshold: float | None, signed_distance: Side | None, name: str
) -> Shape:
    """Make the shape that the array and the arguments ask for."""
    array = stack.array
    asked = {"label": label, "threshold": threshold, "signed_distance": signed_distance}
    given = [f"{key}={value}" for key, value in asked.items() if value is not None]
    if len(given) > 1:
        msg = f"{name}: {' and '.join(given)} exclude each other; give one"
        raise ParameterError(msg)
    refuse_non_finite(array, name)
    if signed_distance is not None:
        return _signed(stack, signed_distance, name)
    if threshold is not None:
        return _grey(stack, float(threshold), "given", name)
    if label is not None:
        inside = array == label
        if not inside.any():
            msg = f"{name}: no label {label} in the volume; it has {_listed(np.unique(array))}"
            raise ShapeError(msg)
        return _mask(stack, inside, f"label {label}", name)
    return _by_kind(stack, name)


def _by_kind(stack: Stack, name: str) -> Shape:
    """Make the shape that the values of the array suggest."""
    array = stack.array
    kind, values = _kind(array)
    if values.size == 1:
        if not values[0]:
            msg = f"{name}: all {array.size} values are zero, so no voxel lies inside"
            raise ShapeError(msg)
        return _mask(stack, np.ones(array.shape, bool), f"all values {values[0]:g}", name)
    if kind == "grey":
        how = "Otsu"
        if array.dtype.kind == "f" and array.min() < 0 < array.max():
            how = "Otsu; were these signed distances, signed_distance would put the surface at zero"
        return _grey(stack, otsu_level(array), how, name)
    if kind == "mask":
        low, high = values
        inner = low if high == 0 else high
        return _mask(stack, array == inner, f"two values, {low:g} and {high:g}; inside is {inner:g}", name)
    count = np.count_nonzero(values)
    return _mask(stack, array != 0, f"{count} labels together: {_listed(values[values != 0])}", name)


def _signed(stack: Stack, side: Side, name: str) -> Shape:
    """Make the shape whose surface is at zero."""
    return signed_distance_shape(
        stack.array,
        stack.spacing,
        inside=side,
        origin=stack.origin,
        name=name,
        report=_report(stack, f"signed distance, {side} inside"),
        affine=stack.affine,
    )


def _grey(stack: Stack, level: float, how: str, name: str) -> Shape:
    """Make the shape inside a grey level."""
    array = stack.array
    low, high = float(array.min()), float(array.max())
    if not level < high:
        msg = f"{name}: threshold={level:g} leaves no voxel inside: the values run {low:g} to {high:g}"
        raise ShapeError(msg)
    # single precision keeps every 16-bit grey level apart
    wide = array.dtype.itemsize > (4 if array.dtype.kind == "f" else 2)
    report = _report(stack, f"grey volume over {level:.4g} ({how})")
    return level_shape(
        np.subtract(array, level, dtype=np.float64 if wide else np.float32),
        stack.spacing,
        origin=stack.origin,
        name=name,
        report=report,
        affine=stack.affine,
    )


def _mask(stack: Stack, inside: NDArray[np.bool_], method: str, name: str) -> Shape:
    """Make the shape of a mask."""
    report = _report(stack, method).with_repair(*border_repairs(inside))
    return Shape.from_mask(
        inside, stack.spacing, origin=stack.origin, name=name, report=report, affine=stack.affine
    )


def _report(stack: Stack, method: str) -> Report:
    """Return the report of a volume: where from, how read, and where its spacing is from."""
    return Report(stack.source, "; ".join((method, *stack.notes)))


def _kind(array: NDArray[Any]) -> tuple[Literal["mask", "labels", "grey"], NDArray[Any]]:
    """Tell masks, labels and grey levels apart; return the values of the first two in rising order."""
    low, high = array.min(), array.max()
    if low == high:
        return "mask", np.array([low])
    if array.dtype == bool or ((array == low) | (array == high)).all():
        return "mask", np.array([low, high])
    grey: tuple[Literal["grey"], NDArray[Any]] = "grey", np.empty(0)
    if low < 0 or (array.dtype == np.uint8 and high == 255):
        return grey
    if array.dtype.kind == "f" and not (array == np.rint(array)).all():
        return grey
    values = np.flatnonzero(np.bincount(array.ravel())) if _countable(array, high) else np.unique(array)
    if values.size > _FEW_LABELS and np.mean(array[..., 1:] == array[..., :-1]) < 0.5:
        return grey
    return "labels", values


def _labels(array: NDArray[Any], name: str) -> NDArray[Any]:
    """Return the values of an array that are to be labels, in rising order; refuse what no label is."""
    values = np.unique(array)
    odd = values[(values < 0) | (values != np.rint(values))]
    if odd.size or not values.any():
        found = f"{odd[0]:g} among them" if odd.size else "nothing but 0"
        msg = f"{name}: its values are no labels, {found}; expected whole numbers, 0 outside"
        raise ShapeError(msg)
    return values


def _countable(array: NDArray[Any], high: Any) -> bool:
    """Tell whether counting values beats sorting them."""
    return bool(array.dtype.kind in "iu" and array.dtype != np.uint64 and int(high) < (1 << 16))


def _listed(values: NDArray[Any]) -> str:
    """Return values as text, the first few of many."""
    text = ", ".join(f"{v:g}" for v in values[:_LISTED])
    return f"{text}, ... ({values.size} in all)" if values.size > _LISTED else text
