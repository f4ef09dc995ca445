"""What is shown of a shape as files: NPZ and CSV for programs, PLY for viewers of meshes."""

from __future__ import annotations

import csv
import io
import re
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from spem.errors import ParameterError
from spem.fields.hyperfield import Hyperfield
from spem.server.views.division import divide, on_shape
from spem.server.views.field import QUANTILES, population, shown_maps
from spem.server.views.options import Options, Reply, whole_option
from spem.server.views.surface_file import surface_file
from spem.shapes.shape import Shape

Download: TypeAlias = tuple[bytes, str, str]

_NPZ, _CSV, _PLY = "application/x-npz", "text/csv; charset=utf-8", "model/ply"
_PLAIN_NAME = re.compile(r"[^\w\-]+", re.ASCII)


def field_npz(shape: Shape, options: Options) -> Download:
    """Return the fields of all ρ: ``fields (n_nodes, n_rho)``, ``rho``, and what `node_arrays` has.

    Examples
    --------
    >>> content, _, name = field_npz(Shape.from_mask(np.ones((3, 3)), name="slab"), {})
    >>> name, np.load(io.BytesIO(content))["fields"].shape
    ('slab-field.npz', (9, 64))
    """
    field, _ = shown_maps(shape, options, 1)
    arrays = {"fields": field.fields(), "rho": field.rho, "boundary": field.boundary}
    return _npz(arrays | node_arrays(field.shape)), _NPZ, _file_name(shape, "field.npz")


def maps_npz(shape: Shape, options: Options) -> Download:
    """Return the SPEM maps: ``maps (n_nodes, n_maps)``, ``basis (n_rho, n_maps)``, ``explained``, ``rho``.

    Examples
    --------
    >>> content, _, _ = maps_npz(Shape.from_mask(np.ones((3, 3))), {})
    >>> np.load(io.BytesIO(content))["maps"].shape
    (9, 8)
    """
    field, maps = shown_maps(shape, options)
    arrays = {"maps": maps.values, "basis": maps.basis, "explained": maps.explained, "rho": maps.rho}
    return _npz(arrays | node_arrays(field.shape)), _NPZ, _file_name(shape, "maps.npz")


def parts_npz(shape: Shape, options: Options) -> Download:
    """Return the parts as `spem.Parts.save` writes them, ``k`` of them where it is given.

    Examples
    --------
    >>> content, _, _ = parts_npz(Shape.from_mask(np.ones((4, 12))), {"k": 2})
    >>> np.bincount(np.load(io.BytesIO(content))["labels"]).tolist()
    [24, 24]
    """
    parts = on_shape(divide(shape, options))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "parts.npz")
        parts.save(file)
        return file.read_bytes(), _NPZ, _file_name(shape, "parts.npz")


def node_csv(shape: Shape, options: Options) -> Download:
    """Return v against ρ at one ``node``, beside the quantiles over all nodes.

    Raises
    ------
    ParameterError
        When there is no such node.

    Examples
    --------
    >>> content, _, name = node_csv(Shape.from_mask(np.ones((3, 3)), name="slab"), {"node": 4})
    >>> name, content.decode().splitlines()[0]
    ('slab-node-4.csv', 'rho,rho_relative,v,v_q5,v_q25,v_q50,v_q75,v_q95')
    """
    field, _ = shown_maps(shape, options, 1)
    node = whole_option(options, "node", -1, 0, field.shape.n_nodes - 1)
    if node < 0:
        msg = f"{shape.name}: node=None: expected a whole number from 0 to {field.shape.n_nodes - 1}"
        raise ParameterError(msg)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["rho", "rho_relative", "v", *(f"v_q{percent}" for percent in QUANTILES)])
    columns = np.column_stack(
        [field.rho, field.rho / field.shape.size, _profile(field, node), population(field)]
    )
    writer.writerows([f"{value:.7g}" for value in row] for row in columns)
    return text.getvalue().encode(), _CSV, _file_name(shape, f"node-{node}.csv")


def surface_ply(shape: Shape, options: Options) -> Download:
    """Return the surface of a solid with values and colours at its vertices, as `surface_file` makes it.

    Raises
    ------
    ShapeError
        When the shape is not of three dimensions.

    Examples
    --------
    >>> content, _, _ = surface_ply(Shape.from_mask(np.ones((3, 3, 3))), {"show": "map", "map": 2})
    >>> content[:3]
    b'ply'
    """
    return surface_file(shape, options), _PLY, _file_name(shape, "surface.ply")


#: Files of a shape by name: the content, its media type, and a name for it made of the shape's.
DOWNLOADS: Mapping[str, Callable[[Shape, Options], Download]] = MappingProxyType(
    {
        "field.npz": field_npz,
        "maps.npz": maps_npz,
        "parts.npz": parts_npz,
        "node.csv": node_csv,
        "surface.ply": surface_ply,
    }
)


def view_download(shape: Shape, options: Options) -> Reply:
    """Return a file as a view: its bytes as one array.

    Parameters
    ----------
    shape
        Any shape.
    options
        ``file``, a name of `DOWNLOADS`, and the options of that.

    Returns
    -------
    header
        ``file``, a name to save it under, and ``media_type``.
    arrays
        ``body``, its bytes.

    Raises
    ------
    ParameterError
        When there is no such file.

    Examples
    --------
    >>> header, arrays = view_download(Shape.from_mask(np.ones((3, 3))), {"file": "maps.npz"})
    >>> header["file"], bytes(arrays["body"][:2])
    ('shape-maps.npz', b'PK')
    """
    wanted = str(options.get("file"))
    if wanted not in DOWNLOADS:
        msg = f"file={wanted!r}: expected one of {', '.join(DOWNLOADS)}"
        raise ParameterError(msg)
    content, media_type, name = DOWNLOADS[wanted](shape, options)
    return {"file": name, "media_type": media_type}, {"body": np.frombuffer(content, np.uint8)}


def node_arrays(shape: Shape) -> dict[str, Any]:
    """Return where the nodes of a shape lie: grid indices and coordinates, and the grid itself.

    Examples
    --------
    >>> node_arrays(Shape.from_mask(np.ones((2, 2))))["node"].tolist()
    [[1, 1], [1, 2], [2, 1], [2, 2]]
    """
    return {
        "node": np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1).astype(np.int32),
        "points": shape.points,
        "grid": np.array(shape.mask.shape),
        "spacing": np.array(shape.spacing),
        "origin": np.array(shape.origin),
        "name": np.array(shape.name),
    }


def _profile(field: Hyperfield, node: int) -> Any:
    """Return the sampled fields at one node."""
    coefficients = field.coefficients()
    return coefficients[0] + field.basis[node] @ coefficients[1:]


def _npz(arrays: Mapping[str, Any]) -> bytes:
    """Return arrays as the bytes of an npz file."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    return content.getvalue()


def _file_name(shape: Shape, ending: str) -> str:
    """Return a name for a file of a shape, of Latin letters, digits, - and _."""
    return f"{_PLAIN_NAME.sub('_', shape.name).strip('_') or 'shape'}-{ending}"
