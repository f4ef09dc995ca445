"""The view "geometry": nodes, contours or surface of a shape, and the patches of its boundary."""

from __future__ import annotations

import numpy as np

from spem.errors import ShapeError
from spem.server.views.options import Options, Reply, indices, shown_shape
from spem.server.views.outline import contours_of, mesh_of, shown_sources, vertex_patches
from spem.shapes.shape import Shape

_DRAWN = (2, 3)


def view_geometry(shape: Shape, options: Options) -> Reply:
    """Return what is needed to draw a shape, in indices of its grid.

    Parameters
    ----------
    shape
        A shape of two or three dimensions.
    options
        ``max_nodes``: a shape of more nodes is shown coarser.

    Returns
    -------
    header
        ``name``, ``ndim``, ``grid``, ``spacing``, ``origin``, ``axes`` (their names), ``n_nodes``, ``size``
        (volume to the power 1/d), ``n_patches``, ``coarser`` and ``repairs`` of the surface.
    arrays
        ``node (n, d)`` index of each node. In 2-D ``contour (m, 2)``, ``contour_start (c + 1,)``,
        ``contour_patch`` and ``contour_node (m,)``; in 3-D ``vertex (v, 3)``, ``face (f, 3)``,
        ``vertex_node`` and ``vertex_patch (v,)``.

    Raises
    ------
    ShapeError
        When the shape is of other dimensions.

    Examples
    --------
    >>> header, arrays = view_geometry(Shape.from_mask(np.ones((2, 3))), {})
    >>> header["grid"], arrays["node"][0].tolist(), arrays["contour_start"].tolist()
    ([4, 5], [1, 1], [0, 10])
    """
    if shape.ndim not in _DRAWN:
        msg = f"{shape.name}: no view of {shape.ndim}-D shapes; fields, maps and parts can be downloaded"
        raise ShapeError(msg)
    shown = shown_shape(shape, options)
    sources = shown_sources(shown)
    node = np.stack(np.unravel_index(shown.voxels, shown.mask.shape), axis=1)
    header = {
        "name": shape.name,
        "ndim": shown.ndim,
        "grid": list(shown.mask.shape),
        "spacing": list(shown.spacing),
        "origin": list(shown.origin),
        "axes": _axis_names(shape),
        "n_nodes": shown.n_nodes,
        "size": shown.size,
        "n_patches": sources.n_sources,
        "coarser": shown is not shape,
        "repairs": [],
    }
    arrays = {"node": indices(node)}
    if shown.ndim == 2:
        contours = contours_of(shown, sources)
        arrays["contour"] = contours.position.astype(np.float32)
        arrays["contour_start"] = contours.start
        arrays["contour_patch"] = indices(sources.group)
        arrays["contour_node"] = contours.node
        return header, arrays
    mesh = mesh_of(shown)
    arrays["vertex"] = mesh.position.astype(np.float32)
    arrays["face"] = mesh.faces.astype(np.uint32)
    arrays["vertex_node"] = mesh.node
    arrays["vertex_patch"] = indices(vertex_patches(shown, mesh, sources))
    return {**header, "repairs": list(mesh.repairs)}, arrays


def _axis_names(shape: Shape) -> list[str]:
    """Return the names of the axes: those of meshes, of images, or numbers."""
    if shape.surface is not None:
        return ["x", "y", "z"]
    return ["row", "column"] if shape.ndim == 2 else [f"axis {axis}" for axis in range(shape.ndim)]
