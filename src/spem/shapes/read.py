"""One door for shapes: a file of any kind, an array, a mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, ReadError
from spem.shapes.components import keep_components
from spem.shapes.kinds import (
    IMAGE_SUFFIXES,
    MESH_SUFFIXES,
    SUFFIXES,
    TIFF_SUFFIXES,
    has_suffix,
    is_volume,
)
from spem.shapes.limits import check_file
from spem.shapes.rescale import to_inner_distance, to_spacing, to_voxel_budget
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    from spem.shapes.levels import Side


class _OfImage(TypedDict):
    """How inside is told from outside in an image."""

    threshold: float | None
    dark: bool | None


class _OfVolume(TypedDict):
    """How inside is told from outside in a volume."""

    label: int | None
    threshold: float | None
    signed_distance: Side | None


class _Values(_OfImage, _OfVolume):
    """How inside is told from outside by values; nothing of it applies to a mesh or a shape."""


class _Grid(TypedDict):
    """What the grid of the result shall be; one of the first three at most."""

    voxels: int | None
    spacing: float | tuple[float, ...] | None
    inner_radius: float | None
    memory_limit: int | None


def read(
    source: Any,
    *,
    voxels: int | None = None,
    spacing: float | tuple[float, ...] | None = None,
    inner_radius: float | None = None,
    label: int | None = None,
    threshold: float | None = None,
    dark: bool | None = None,
    signed_distance: Side | None = None,
    grid_spacing: float | tuple[float, ...] | None = None,
    components: Literal["largest", "all"] | None = None,
    memory_limit: int | None = None,
    name: str | None = None,
) -> Shape:
    """Make a shape of a file, an array, a mesh or another shape.

    Images and volumes keep their own grid unless `voxels`, `spacing` or `inner_radius` is given;
    meshes have none and take 15,000 voxels.

    Parameters
    ----------
    source
        A path to an image (PNG, GIF, JPEG, BMP, TIFF, WebP, PNM), a volume (NPY, NPZ, NIfTI, TIFF
        stack) or a mesh (OBJ, OFF, PLY, STL, GLB); an array: boolean, labels or grey,
        inside where it is True, not zero or brighter, or an 8-bit image, whose polarity is told
        from its border; a `trimesh.Trimesh`; a pair of vertices ``(n, 3)`` and faces ``(m, 3)``;
        or a `Shape`, which comes back as it is or resampled.
    voxels
        Number of nodes wanted.
    spacing
        Distance between voxel centres. Of an array, the spacing that it has; of anything else,
        the spacing wanted, in the unit of the source.
    inner_radius
        Distance wanted from the deepest node to the surface, in voxels.
    label
        The label to take from a label volume.
    threshold
        Grey level of the surface, of images and grey volumes.
    dark
        Whether the shape is darker than the background, of images.
    signed_distance
        The array or volume holds signed distances to the surface, "negative" or "positive" inside.
    grid_spacing
        The spacing that the grid of an image or volume file has, for all axes or one each, in place of
        what the file says, or of 1 where it says nothing.
    components
        Keep the "largest" component or "all"; by default the largest, and all of a `Shape`.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Name of the shape; the file's by default.

    Returns
    -------
    Shape
        Its `report` says how it was read and what was changed.

    Raises
    ------
    ReadError
        When a file is missing, empty, damaged or of an unknown kind.
    ShapeError
        When there is no shape in the source, or it is thinner than the grid.
    SizeError
        When reading would pass the memory limit.
    ParameterError
        When an argument is out of range, or does not go with the source or another argument.

    Examples
    --------
    >>> read(np.ones((8, 8), bool), name="square")
    Shape('square', 2-D, 64 nodes, grid 10 x 10, spacing 1 x 1)
    """
    array = not isinstance(source, (str, Path, Shape)) and not _is_mesh(source)
    _refuse_both(voxels, None if array else spacing, inner_radius)
    grid = _Grid(voxels=voxels, spacing=spacing, inner_radius=inner_radius, memory_limit=memory_limit)
    values = _Values(label=label, threshold=threshold, dark=dark, signed_distance=signed_distance)
    which = "largest" if components is None else components
    if isinstance(source, str):
        if not source:
            msg = "the source is an empty name; give a file"
            raise ParameterError(msg)
        source = Path(source)
    if array:
        _refuse_unused(name or "array", "an array, whose own is spacing=", grid_spacing=grid_spacing)
    if _is_mesh(source) or (isinstance(source, Path) and has_suffix(source, MESH_SUFFIXES)):
        _refuse_unused(name or _title(source), "a mesh", **values, grid_spacing=grid_spacing)
        return _with_warning(_mesh(source, grid, which, name))
    if isinstance(source, Shape):
        _refuse_unused(source.name, "a shape", **values, grid_spacing=grid_spacing)
        shape = source if name is None else replace(source, name=name)
        if components is None:
            return _regrid(shape, grid)
    elif array:
        shape = _array(np.asarray(source), spacing, values, memory_limit, name or "array")
        grid["spacing"] = None
    else:
        shape = _file(source, values, grid_spacing, memory_limit, name)
    return _with_warning(_keep(shape, which, grid))


def _keep(shape: Shape, components: Literal["largest", "all"], grid: _Grid) -> Shape:
    """Keep the components asked for, before and after resampling."""
    kept = keep_components(shape, components)
    regridded = _regrid(kept, grid)
    if regridded is kept or components == "all":
        return regridded
    # a neck that is thinner than the new grid breaks, and leaves components of its own
    again = keep_components(regridded, components)
    found = max(kept.report.components, again.report.components)
    return replace(again, report=replace(again.report, components=found))


def _with_warning(shape: Shape) -> Shape:
    """Say in the report when there are too few nodes for a field to tell one shape from another."""
    if shape.n_nodes >= 2**shape.ndim:
        return shape
    nodes = f"{shape.n_nodes} node{'s' if shape.n_nodes > 1 else ''}"
    return replace(shape, report=shape.report.with_repair(f"only {nodes} inside: use a finer grid"))


def read_all(
    path: str | Path,
    *,
    voxels: int | None = None,
    spacing: float | tuple[float, ...] | None = None,
    inner_radius: float | None = None,
    components: Literal["largest", "all"] = "largest",
    per_label: bool | None = None,
    memory_limit: int | None = None,
    name: str | None = None,
) -> list[Shape]:
    """Read every shape of a file: one for each label of a label volume, one of any other file.

    Parameters
    ----------
    path
        The file.
    voxels, spacing, inner_radius, components, memory_limit, name
        As `read`; the shapes of labels are named "<name>-<label>".
    per_label
        Whether the values of a volume are labels, also where they look like a mask or grey levels; told from
        the values where None, and where False all that are not zero are one shape.

    Raises
    ------
    ReadError, ShapeError, SizeError, ParameterError
        As `read`.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.save(Path(folder, "teeth.npy"), [[0, 3, 3, 0, 7]])
    ...     [shape.n_nodes for shape in read_all(Path(folder, "teeth.npy"))]
    [2, 1]
    """
    _refuse_both(voxels, spacing, inner_radius)
    grid = _Grid(voxels=voxels, spacing=spacing, inner_radius=inner_radius, memory_limit=memory_limit)
    path = Path(path)
    if not is_volume(path) or per_label is False:
        return [read(path, components=components, name=name, **grid)]
    from spem.shapes.volumes import read_labels

    shapes = read_labels(path, per_label=per_label, memory_limit=memory_limit, name=name)
    return [_regrid(keep_components(shape, components), grid) for shape in shapes]


def _file(
    path: Path,
    values: _Values,
    grid_spacing: float | tuple[float, ...] | None,
    memory_limit: int | None,
    name: str | None,
) -> Shape:
    """Read an image or a volume, on the grid that is declared where one is."""
    check_file(path)
    # one page of a TIFF may hold labels or distances as well as grey levels
    flat = values["label"] is not None or values["signed_distance"] is not None
    if is_volume(path) or (flat and has_suffix(path, TIFF_SUFFIXES)):
        from spem.shapes.volumes import read_volume

        how = _of_volume(values, str(path))
        volume = read_volume(path, spacing=grid_spacing, memory_limit=memory_limit, name=name, **how)
        return volume if grid_spacing is None else _declared(volume)
    if has_suffix(path, IMAGE_SUFFIXES):
        from spem.shapes.images import read_image

        chosen = _of_image(values, str(path))
        steps = 1.0 if grid_spacing is None else grid_spacing
        image = read_image(path, spacing=steps, memory_limit=memory_limit, name=name, **chosen)
        return image if grid_spacing is None else _declared(image)
    suffix = path.suffix.lower() or "(no suffix)"
    msg = f"{path}: unknown kind of file {suffix}; expected one of {', '.join(SUFFIXES)}"
    raise ReadError(msg)


def _declared(shape: Shape) -> Shape:
    """Say in the report that the spacing was given, in place of what the file says of it."""
    phrases = [phrase for phrase in shape.report.method.split("; ") if "spacing" not in phrase]
    return replace(shape, report=replace(shape.report, method="; ".join((*phrases, "spacing as given"))))


def _array(
    array: NDArray[Any],
    spacing: float | tuple[float, ...] | None,
    values: _Values,
    memory_limit: int | None,
    name: str,
) -> Shape:
    """Take an array for an image when it looks like one or is treated as one, else for a volume."""
    steps = 1.0 if spacing is None else spacing
    eight_bit = array.dtype == np.uint8 and array.size > 0
    colour = eight_bit and array.ndim == 3 and array.shape[2] in (3, 4)
    grey = eight_bit and array.ndim == 2 and array.max() == 255
    flat = values["label"] is None and values["signed_distance"] is None
    if flat and (colour or grey or values["dark"] is not None):
        from spem.shapes.images import image_shape

        chosen = _of_image(values, name)
        return image_shape(array, spacing=steps, memory_limit=memory_limit, name=name, **chosen)
    from spem.shapes.volumes import volume_shape

    return volume_shape(array, steps, memory_limit=memory_limit, name=name, **_of_volume(values, name))


def _mesh(source: Any, grid: _Grid, components: Literal["largest", "all"], name: str | None) -> Shape:
    """Read and fill a mesh."""
    from spem.shapes.meshes import mesh_shape, read_mesh

    if isinstance(source, Path):
        return read_mesh(source, components=components, name=name, **grid)
    vertices, faces = source if isinstance(source, tuple) else (source.vertices, source.faces)
    return mesh_shape(vertices, faces, components=components, name=name or "mesh", **grid)


def _regrid(shape: Shape, grid: _Grid) -> Shape:
    """Resample as asked, if anything was."""
    limit = grid["memory_limit"]
    if grid["voxels"] is not None:
        return to_voxel_budget(shape, grid["voxels"], memory_limit=limit)
    if grid["spacing"] is not None:
        return to_spacing(shape, grid["spacing"], memory_limit=limit)
    if grid["inner_radius"] is not None:
        return to_inner_distance(shape, grid["inner_radius"], memory_limit=limit)
    return shape


def _is_mesh(source: Any) -> bool:
    """Tell a mesh object, or a pair of vertices and faces, from other sources."""
    if isinstance(source, tuple):
        return len(source) == 2 and all(np.ndim(part) == 2 for part in source)
    return hasattr(source, "vertices") and hasattr(source, "faces")


def _of_image(values: _Values, name: str) -> _OfImage:
    """Return what the reader of images takes, or say that the rest does not apply."""
    _refuse_unused(name, "an image", label=values["label"], signed_distance=values["signed_distance"])
    return _OfImage(threshold=values["threshold"], dark=values["dark"])


def _of_volume(values: _Values, name: str) -> _OfVolume:
    """Return what the reader of volumes takes, or say that the rest does not apply."""
    _refuse_unused(name, "a volume", dark=values["dark"])
    return _OfVolume(
        label=values["label"], threshold=values["threshold"], signed_distance=values["signed_distance"]
    )


def _title(source: Any) -> str:
    """Name a source in a message."""
    return str(source) if isinstance(source, (str, Path)) else "mesh"


def _refuse_both(voxels: int | None, spacing: Any, inner_radius: float | None) -> None:
    """Raise unless at most one of the three ways to choose a grid is given."""
    given = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius}
    chosen = [f"{key}={value}" for key, value in given.items() if value is not None]
    if len(chosen) > 1:
        msg = f"{' and '.join(chosen)} exclude each other; give one of voxels, spacing, inner_radius"
        raise ParameterError(msg)


def _refuse_unused(name: str, kind: str, **arguments: Any) -> None:
    """Raise when an argument is given that means nothing for this kind of source."""
    for key, value in arguments.items():
        if value is not None:
            msg = f"{name}: {key}={value} does not apply to {kind}; leave it out"
            raise ParameterError(msg)
