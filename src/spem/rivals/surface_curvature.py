"""Normals, areas and principal curvatures at the vertices of a triangle surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array


@dataclass(frozen=True, eq=False)
class SurfaceCurvature:
    """How a triangle surface bends at each of its vertices.

    Parameters
    ----------
    normals
        ``(n_vertices, 3)`` unit normals, outward.
    areas
        ``(n_vertices,)`` a third of the area of the faces around each.
    principal
        ``(n_vertices, 2)`` principal curvatures, larger first, positive where the surface is convex.
    """

    normals: NDArray[np.float64]
    areas: NDArray[np.float64]
    principal: NDArray[np.float64]

    @property
    def mean(self) -> NDArray[np.float64]:
        """``(n_vertices,)`` mean curvature, half the sum of the principal ones."""
        return np.asarray(self.principal.mean(axis=1))

    @property
    def shape_index(self) -> NDArray[np.float64]:
        """``(n_vertices,)`` Koenderink's shape index, 1 on a sphere, 0 on a saddle, −1 in a bowl."""
        largest, smallest = self.principal.T
        return np.asarray(2 / np.pi * np.arctan2(largest + smallest, largest - smallest))

    @property
    def curvedness(self) -> NDArray[np.float64]:
        """``(n_vertices,)`` root mean square of the principal curvatures."""
        return np.asarray(np.sqrt(np.square(self.principal).mean(axis=1)))


def surface_curvature(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> SurfaceCurvature:
    """Estimate curvatures from how the normals turn over each face.

    On each face the linear map from edges to differences of vertex normals is fitted; a vertex has the mean
    of its faces' maps by area (Rusinkiewicz, "Estimating curvatures and their derivatives on triangle
    meshes", 3DPVT 2004), averaged in space and then restricted to its tangent plane. Normals are Max's
    ("Weights for computing vertex normals from facet normals", 1999), exact on a sphere.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    >>> surface_curvature(ball.vertices, ball.faces).mean.mean().round(2)
    np.float64(0.5)
    """
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(cross, axis=1)
    to_vertices = _incidence(faces, len(vertices))
    normals = _vertex_normals(corners, faces, len(vertices))
    areas = np.asarray(to_vertices @ size) / 6
    tensors = np.asarray(to_vertices @ (_face_tensors(corners, normals[faces]) * size[:, None]))
    tensors = tensors.reshape(-1, 3, 3) / np.maximum(6 * areas, np.finfo(float).tiny)[:, None, None]
    return SurfaceCurvature(normals, areas, _principal(tensors, normals))


def tangent_frames(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(..., 2, 3)`` two unit vectors that make a right-handed frame with each unit normal.

    Examples
    --------
    >>> tangent_frames(np.array([0.0, 0.0, 1.0])).round().tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """
    # the axis that the normal is farthest from
    axis = np.eye(3)[np.argmin(np.abs(normals), axis=-1)]
    first = _unit(axis - (axis * normals).sum(axis=-1, keepdims=True) * normals)
    return np.stack([first, np.cross(normals, first)], axis=-2)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of length one; null ones stay."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1))


def _incidence(faces: NDArray[np.int64], n: int) -> csr_array:
    """Return the matrix that sums values of faces at their vertices."""
    column = np.repeat(np.arange(len(faces)), 3)
    return csr_array((np.ones(faces.size), (faces.reshape(-1), column)), shape=(n, len(faces)))


def _vertex_normals(corners: NDArray[np.float64], faces: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    """Return the unit sum, at each vertex, of the crosses of two edges over their squared lengths."""
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    scale = np.square(ahead).sum(axis=2) * np.square(back).sum(axis=2)
    parts = np.cross(ahead, back) / np.maximum(scale, np.finfo(float).tiny)[..., None]
    corner = np.arange(faces.size)
    gather = csr_array((np.ones(faces.size), (faces.reshape(-1), corner)), shape=(n, faces.size))
    return _unit(gather @ parts.reshape(-1, 3))


def _face_tensors(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(n_faces, 9)`` the symmetric map from edge to turn of the normal, least squares, in space."""
    edges = np.roll(corners, -1, axis=1) - corners
    turns = np.roll(normals, -1, axis=1) - normals
    frame = tangent_frames(_unit(np.cross(edges[:, 0], edges[:, 1])))
    u = frame @ edges.transpose(0, 2, 1)  # (f, 2, 3): axis, edge
    t = frame @ turns.transpose(0, 2, 1)
    zero = np.zeros_like(u[:, 0])
    # unknowns e, f, g of [[e, f], [f, g]]; two rows an edge
    design = np.concatenate(
        [np.stack([u[:, 0], u[:, 1], zero], axis=-1), np.stack([zero, u[:, 0], u[:, 1]], axis=-1)], axis=1
    )
    normal_matrix = design.transpose(0, 2, 1) @ design
    # slivers have no plane to fit in; a relative ridge leaves sound faces as they are
    ridge = 1e-10 * np.trace(normal_matrix, axis1=1, axis2=2) + np.finfo(float).tiny
    normal_matrix += ridge[:, None, None] * np.eye(3)
    rhs = np.einsum("fri,fr->fi", design, np.concatenate([t[:, 0], t[:, 1]], axis=1))
    e, f, g = np.linalg.solve(normal_matrix, rhs[..., None])[..., 0].T
    flat = np.stack([np.stack([e, f], axis=-1), np.stack([f, g], axis=-1)], axis=-2)
    return np.asarray((frame.transpose(0, 2, 1) @ flat @ frame).reshape(-1, 9))


def _principal(tensors: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the eigenvalues, larger first, of tensors restricted to the tangent planes."""
    frame = tangent_frames(normals)
    flat = frame @ tensors @ frame.transpose(0, 2, 1)
    half = (flat[:, 0, 0] + flat[:, 1, 1]) / 2
    spread = np.hypot((flat[:, 0, 0] - flat[:, 1, 1]) / 2, (flat[:, 0, 1] + flat[:, 1, 0]) / 2)
    return np.stack([half + spread, half - spread], axis=1)
