"""Shapes taken apart into plain arrays and attributes, for files of any kind, and put together again."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.shapes.shape import Cuts, Report, Shape
from spem.shapes.surface import Surface


def pack_shape(shape: Shape) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return a shape as named arrays, and as attributes that JSON can hold.

    Examples
    --------
    >>> arrays, attributes = pack_shape(Shape.from_mask(np.ones((2, 3)), name="slab"))
    >>> unpack_shape(arrays, attributes)
    Shape('slab', 2-D, 6 nodes, grid 4 x 5, spacing 1 x 1)
    """
    cuts = shape.cuts
    arrays: dict[str, NDArray[Any]] = {
        "voxels": shape.voxels,
        "cut_voxel": cuts.voxel,
        "cut_direction": cuts.direction,
        "cut_fraction": cuts.fraction,
    }
    if shape.affine is not None:
        arrays["affine"] = shape.affine
    if shape.surface is not None:
        arrays |= {"surface_vertices": shape.surface.vertices, "surface_faces": shape.surface.faces}
    attributes: dict[str, Any] = {
        "name": shape.name,
        "grid": list(shape.mask.shape),
        "spacing": list(shape.spacing),
        "origin": list(shape.origin),
        "report": asdict(shape.report),
    }
    return arrays, attributes


def unpack_shape(arrays: dict[str, NDArray[Any]], attributes: dict[str, Any]) -> Shape:
    """Put a shape together from what `pack_shape` made of it."""
    mask = np.zeros(attributes["grid"], bool)
    mask.reshape(-1)[arrays["voxels"]] = True
    report = attributes["report"]
    has_surface = "surface_vertices" in arrays
    return Shape(
        mask,
        tuple(attributes["spacing"]),
        tuple(attributes["origin"]),
        attributes["name"],
        Cuts(arrays["cut_voxel"], arrays["cut_direction"], arrays["cut_fraction"]),
        Report(**{**report, "repairs": tuple(report["repairs"])}),
        arrays.get("affine"),
        Surface(arrays["surface_vertices"], arrays["surface_faces"]) if has_surface else None,
    )
