"""One door for shapes: a file of any kind, an array, a mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, ReadError
from spem.shapes.components import keep_components
from spem.shapes.rescale import to_inner_distance, to_spacing, to_voxel_budget
from spem.shapes.shape import Shape

# Kept apart from the readers, whose libraries are loaded for the kind that is read only.
IMAGE_SUFFIXES = (
    ".png", ".gif", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pbm", ".pnm",
)  # fmt: skip
VOLUME_SUFFIXES = (".npy", ".npz", ".nii", ".nii.gz")
TIFF_SUFFIXES = (".tif", ".tiff")
MESH_SUFFIXES = (".obj", ".off", ".ply", ".stl", ".glb")


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
    components: Literal["largest", "all"] = "largest",
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
    components
        Keep the "largest" component or "all".
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
    if isinstance(source, Shape):
        _refuse_unused(source.name, "a shape", label=label, threshold=threshold, dark=dark)
        return _regrid(source if name is None else replace(source, name=name), grid)
    if _is_mesh(source) or _suffix(source) in MESH_SUFFIXES:
        _refuse_unused(name or _title(source), "a mesh", label=label, threshold=threshold, dark=dark)
        return _mesh(source, grid, components, name)
    if array:
        shape = _array(np.asarray(source), spacing, label, threshold, dark, memory_limit, name or "array")
        grid["spacing"] = None
    else:
        shape = _file(Path(source), label, threshold, dark, memory_limit, name)
    kept = keep_components(shape, components)
    regridded = _regrid(kept, grid)
    if regridded is kept or components == "all":
        return regridded
    # a neck that is thinner than the new grid breaks, and leaves components of its own
    again = keep_components(regridded, components)
    found = max(kept.report.components, again.report.components)
    return replace(again, report=replace(again.report, components=found))


def read_all(
    path: str | Path,
    *,
    voxels: int | None = None,
    spacing: float | tuple[float, ...] | None = None,
    inner_radius: float | None = None,
    components: Literal["largest", "all"] = "largest",
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
    if not _is_volume(path):
        return [read(path, components=components, name=name, **grid)]
    from spem.shapes.volumes import read_labels

    shapes = read_labels(path, memory_limit=memory_limit, name=name)
    return [_regrid(keep_components(shape, components), grid) for shape in shapes]


def _file(
    path: Path,
    label: int | None,
    threshold: float | None,
    dark: bool | None,
    memory_limit: int | None,
    name: str | None,
) -> Shape:
    """Read an image or a volume."""
    suffix = _suffix(path)
    if suffix in VOLUME_SUFFIXES or (label is not None and suffix in TIFF_SUFFIXES) or _is_volume(path):
        from spem.shapes.volumes import read_volume

        _refuse_unused(str(path), "a volume", dark=dark)
        return read_volume(path, label=label, level=threshold, memory_limit=memory_limit, name=name)
    if suffix in IMAGE_SUFFIXES:
        from spem.shapes.images import read_image

        _refuse_unused(str(path), "an image", label=label)
        return read_image(path, threshold=threshold, dark=dark, memory_limit=memory_limit, name=name)
    kinds = ", ".join((*IMAGE_SUFFIXES, *VOLUME_SUFFIXES, *MESH_SUFFIXES))
    msg = f"{path}: unknown kind of file {suffix or '(no suffix)'}; expected one of {kinds}"
    raise ReadError(msg)


def _array(
    array: NDArray[Any],
    spacing: float | tuple[float, ...] | None,
    label: int | None,
    threshold: float | None,
    dark: bool | None,
    memory_limit: int | None,
    name: str,
) -> Shape:
    """Take an array for an image when it looks like one or is treated as one, else for a volume."""
    steps = 1.0 if spacing is None else spacing
    eight_bit = array.dtype == np.uint8 and array.size > 0
    colour = eight_bit and array.ndim == 3 and array.shape[2] in (3, 4)
    grey = eight_bit and array.ndim == 2 and array.max() == 255
    if label is None and (colour or grey or dark is not None):
        from spem.shapes.images import image_shape

        return image_shape(
            array, spacing=steps, threshold=threshold, dark=dark, memory_limit=memory_limit, name=name
        )
    from spem.shapes.volumes import volume_shape

    _refuse_unused(name, "a label volume", dark=dark)
    return volume_shape(array, steps, label=label, level=threshold, memory_limit=memory_limit, name=name)


def _mesh(source: Any, grid: _Grid, components: Literal["largest", "all"], name: str | None) -> Shape:
    """Read and fill a mesh."""
    from spem.shapes.meshes import mesh_shape, read_mesh

    if isinstance(source, (str, Path)):
        return read_mesh(source, components=components, name=name, **_three(grid))
    vertices, faces = source if isinstance(source, tuple) else (source.vertices, source.faces)
    return mesh_shape(vertices, faces, components=components, name=name or "mesh", **_three(grid))


def _three(grid: _Grid) -> Any:
    """Return the grid's arguments as the readers of meshes take them."""
    return grid


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


def _is_volume(path: Path) -> bool:
    """Tell whether a file is a volume, which for a TIFF depends on its pages."""
    if _suffix(path) in TIFF_SUFFIXES and path.is_file():
        from spem.shapes.stacks import tiff_pages

        return tiff_pages(path) > 1
    return _suffix(path) in VOLUME_SUFFIXES


def _suffix(source: Any) -> str:
    """Return the suffix of a path in lower case, with the one before .gz; nothing for other sources."""
    if not isinstance(source, (str, Path)):
        return ""
    suffixes = [s.lower() for s in Path(source).suffixes]
    return "".join(suffixes[-2:] if suffixes[-1:] == [".gz"] else suffixes[-1:])


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
