"""Parts on disk: one npz that plain NumPy reads, with the shape and the sources they belong to."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.parts import Parts
from spem.errors import ReadError, SpemError
from spem.fields.boundary.sources import restore_sources
from spem.fields.operator import assemble
from spem.files import DAMAGE, write_whole
from spem.shapes.packing import pack_shape, unpack_shape

FORMAT = 1


def save_parts(parts: Parts, path: str | os.PathLike[str]) -> None:
    """Write parts to an npz file, all of it or nothing; a file that is there is replaced.

    Arrays for any reader: ``points`` ``(n_nodes, d)``, ``labels`` of the nodes, ``components``, ``basis``,
    ``sources`` (their positions), ``source_labels``, ``intensity``, ``rho``, ``spacing``. The others rebuild
    the shape and its sources.

    Parameters
    ----------
    parts
        The parts.
    path
        The file, by custom ``*.npz``.

    Raises
    ------
    ParameterError
        When the file cannot be written.

    Examples
    --------
    >>> import spem, tempfile
    >>> from spem.decomposition.division import region_parts
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> system = assemble(spem.Shape.from_mask(np.ones((2, 10)), name="bar"))
    >>> parts = region_parts(solve_sources(point_sources(system), np.inf), 2)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_parts(parts, f"{folder}/bar.npz")
    ...     load_parts(f"{folder}/bar.npz")
    Parts('bar', 2 parts of its region, rho inf, sizes 50, 50 %)
    """
    arrays = _arrays(parts)
    write_whole(path, lambda file: np.savez(file, allow_pickle=False, **arrays))


def load_parts(path: str | os.PathLike[str]) -> Parts:
    """Read parts that `save_parts` wrote.

    Raises
    ------
    ReadError
        When there is no such file, or it does not hold whole parts of this format.
    """
    source = Path(path)
    if not source.is_file():
        msg = f"{source}: no such file; expected parts that spem wrote"
        raise ReadError(msg)
    try:
        # opened here, for NumPy leaves a damaged file open
        with source.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        about = json.loads(str(arrays["about"]))
        version = about["format"]
        if version == FORMAT:
            return _assemble(about, arrays)
        reason = f"format {version}, expected {FORMAT}"
    except (*DAMAGE, SpemError) as error:
        msg = f"{source}: no whole parts of a shape ({error}); divide the shape again"
        raise ReadError(msg) from error
    msg = f"{source}: parts of {reason}; divide the shape again with this spem"
    raise ReadError(msg)


def _arrays(parts: Parts) -> dict[str, NDArray[Any]]:
    """Everything as plain arrays, and a line of JSON."""
    shape, sources = parts.shape, parts.sources
    packed, attributes = pack_shape(shape)
    about = attributes | {"format": FORMAT, "boundary": sources.system.boundary, "over": parts.over}
    return packed | {
        "points": shape.points,
        "labels": parts.node_labels,
        "components": parts.components,
        "basis": parts.basis,
        "sources": sources.position,
        "source_labels": parts.source_labels,
        "intensity": parts.intensity,
        "rho": np.array(parts.rho),
        "spacing": np.array(shape.spacing),
        "edge_source": sources.edge_source,
        "about": np.array(json.dumps(about)),
    }


def _assemble(about: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Parts:
    """Put shape, sources and parts together from what was stored."""
    system = assemble(unpack_shape(arrays, about), about["boundary"])
    parts = Parts(
        restore_sources(system, arrays["edge_source"]),
        float(arrays["rho"]),
        about["over"],
        arrays["components"],
        arrays["basis"],
        arrays["labels"],
        arrays["source_labels"],
        arrays["intensity"],
    )
    _check(parts)
    return parts


def _check(parts: Parts) -> None:
    """Refuse arrays that do not belong together."""
    k, n, m = parts.n_parts, parts.shape.n_nodes, parts.sources.n_sources
    samples, features = (n, m) if parts.over == "region" else (m, n)
    expected = {
        "components": (k, samples),
        "basis": (k, features),
        "node_labels": (n,),
        "source_labels": (m,),
        "intensity": (k,),
    }
    if not parts.rho > 0:
        msg = f"rho is {parts.rho:g}"
        raise ReadError(msg)
    for name, size in expected.items():
        values = getattr(parts, name)
        kinds = "iu" if name.endswith("labels") else "f"
        if values.dtype.kind not in kinds or not np.isfinite(values).all():
            msg = f"{name} are no finite numbers of their kind"
            raise ReadError(msg)
        if values.shape != size or (name.endswith("labels") and not -1 <= values.min() <= values.max() < k):
            msg = f"{name} do not fit {k} parts, {n} nodes and {m} sources"
            raise ReadError(msg)
