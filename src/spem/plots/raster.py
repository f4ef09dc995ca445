"""Shaded pictures of triangle meshes by a small z-buffer: no screen and no graphics driver."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numba
import numpy as np
from matplotlib.colors import to_rgb
from scipy.ndimage import gaussian_filter

from spem.errors import ParameterError
from spem.plots.camera import Camera
from spem.plots.style import FIELD_CMAP, SOLID

if TYPE_CHECKING:
    from matplotlib.colors import Colormap
    from numpy.typing import ArrayLike, NDArray

    from spem.plots.camera import View

# Pixels of a picture for each of the figure that it is shown in: a little finer.
SHARPNESS = 1.35
# Pixels are computed twice as fine along each side and averaged.
SAMPLES = 2
# Directions to the lights in camera coordinates (right, up, toward the viewer) and their strengths.
KEY_LIGHT = (np.array([-0.45, 0.65, 0.61]), 0.52)
FILL_LIGHT = (np.array([0.8, -0.1, 0.59]), 0.18)
AMBIENT = 0.42
# Creases darken by how far a point lies behind its surroundings, in fractions of the picture.
CREASE_WIDTH = 0.012
CREASE_DEPTH = 0.03


def vertex_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return ``(n_vertices, 3)`` unit normals, the mean of those of the faces weighted by area.

    Examples
    --------
    >>> flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> vertex_normals(flat, np.array([[0, 1, 2]]))[0].tolist()
    [0.0, 0.0, 1.0]
    """
    corner = vertices[faces]  # (n_faces, 3, 3)
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total: NDArray[np.float64] = np.stack(
        [np.bincount(faces.ravel(), np.repeat(area[:, a], 3), len(vertices)) for a in range(3)], axis=1
    )
    return _unit(total)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows scaled to length one; rows of zeros stay."""
    scaled: NDArray[np.float64] = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return scaled


def render_surface(
    vertices: ArrayLike,
    faces: ArrayLike,
    vertex_values: ArrayLike | None = None,
    *,
    view: View = (20.0, -60.0),
    size: tuple[int, int] = (320, 320),
    cmap: str | Colormap = FIELD_CMAP,
    limits: tuple[float, float] | None = None,
    colour: str = SOLID,
    face_colours: ArrayLike | None = None,
    unlit: ArrayLike | None = None,
) -> NDArray[np.uint8]:
    """Draw a triangle mesh, shaded by two soft lights, on a transparent ground.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex numbers; either orientation, the mesh may be open.
    vertex_values
        ``(n_vertices,)`` values to colour by, or None for one colour.
    view
        Elevation and azimuth in degrees (axis 2 up), or a rotation ``(3, 3)`` whose rows point
        right, up and toward the viewer.
    size
        Width and height in pixels.
    cmap
        Matplotlib colour map of the values.
    limits
        Values at the two ends of the colour map; the smallest and largest value by default.
    colour
        Colour where there are no values.
    face_colours
        ``(n_faces, 3)`` red, green and blue of each face, 0 to 1, in place of values.
    unlit
        ``(n_faces,)`` True where a face has the very colour of its values, without light or shade.

    Returns
    -------
    picture
        ``(height, width, 4)`` red, green, blue and opacity, 0 to 255.

    Raises
    ------
    ParameterError
        If the arrays do not make a mesh, or there is not one colour for each face.

    Examples
    --------
    >>> picture = render_surface(np.eye(3), [[0, 1, 2]], size=(64, 48))
    >>> picture.shape
    (48, 64, 4)
    """
    corner, triangle, values = _mesh(vertices, faces, vertex_values)
    fine = (size[0] * SAMPLES, size[1] * SAMPLES)
    if min(fine) < 1:
        msg = f"a picture needs at least one pixel each way, not size={size}"
        raise ParameterError(msg)
    used = np.zeros(len(corner), bool)
    used[triangle] = True
    camera = Camera.fit(corner[used], view, fine)
    projected = camera.project(corner)
    height, face, weight = _rasterise(projected, triangle, fine[0], fine[1])
    seen = face >= 0
    part, share = triangle[face[seen]], weight[seen]  # (n_seen, 3), (n_seen, 3)
    normal = _seen_normals(corner, triangle, camera.rotation, face[seen], share)
    if face_colours is not None:
        rgb = _face_colours(face_colours, len(triangle))[face[seen]]
    elif values is None:
        rgb = np.broadcast_to(to_rgb(colour), normal.shape)
    else:
        low, high = limits or (float(values.min()), float(values.max()))
        level = (np.einsum("nk,nk->n", share, values[part]) - low) / max(high - low, 1e-300)
        rgb = mpl.colormaps.get_cmap(cmap)(np.clip(level, 0, 1))[:, :3]
    light = _light(normal) - _crease(height, seen, max(fine))
    if unlit is not None:
        light[np.asarray(unlit, bool)[face[seen]]] = 1
    picture = np.zeros((fine[1], fine[0], 4))
    picture[seen, :3] = np.clip(rgb * light[:, None], 0, 1)
    picture[seen, 3] = 1
    return _average(picture)


def _mesh(
    vertices: ArrayLike, faces: ArrayLike, values: ArrayLike | None
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Return the arrays of a mesh in the types the kernel takes, checked."""
    corner = np.ascontiguousarray(vertices, np.float64)
    triangle = np.ascontiguousarray(faces, np.int64)
    if corner.ndim != 2 or corner.shape[1] != 3 or triangle.ndim != 2 or triangle.shape[1] != 3:
        msg = f"a mesh is (n, 3) vertices and (m, 3) faces, not {corner.shape} and {triangle.shape}"
        raise ParameterError(msg)
    if triangle.size == 0 or triangle.min() < 0 or triangle.max() >= len(corner):
        msg = f"faces must name some of the {len(corner)} vertices and there must be at least one face"
        raise ParameterError(msg)
    if values is None:
        return corner, triangle, None
    value = np.asarray(values, np.float64)
    if value.shape != (len(corner),):
        msg = f"vertex_values must be ({len(corner)},), one a vertex, not {value.shape}"
        raise ParameterError(msg)
    return corner, triangle, value


def _face_colours(face_colours: ArrayLike, n_faces: int) -> NDArray[np.float64]:
    """Colours of the faces, checked."""
    colours = np.asarray(face_colours, np.float64)
    if colours.shape != (n_faces, 3):
        msg = f"face_colours must be ({n_faces}, 3), one a face, not {colours.shape}"
        raise ParameterError(msg)
    return colours


@numba.njit(cache=True)
def _rasterise(
    projected: NDArray[np.float64], faces: NDArray[np.int64], width: int, height: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Return for each pixel the height, number and corner weights of the face nearest the viewer."""
    top = np.full((height, width), -np.inf)
    face = np.full((height, width), -1, np.int64)
    weight = np.zeros((height, width, 3))
    for f in range(faces.shape[0]):
        ax, ay, az = projected[faces[f, 0]]
        bx, by, bz = projected[faces[f, 1]]
        cx, cy, cz = projected[faces[f, 2]]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        first_row = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        last_row = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        first_column = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        last_column = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        for row in range(first_row, last_row + 1):
            y = row + 0.5
            for column in range(first_column, last_column + 1):
                x = column + 0.5
                wa = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                wb = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                wc = 1 - wa - wb
                # A hair of slack, so that no pixel on a shared edge is missed by both faces.
                if wa < -1e-9 or wb < -1e-9 or wc < -1e-9:
                    continue
                z = wa * az + wb * bz + wc * cz
                if z > top[row, column]:
                    top[row, column] = z
                    face[row, column] = f
                    weight[row, column] = wa, wb, wc
    return top, face, weight


def _seen_normals(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    rotation: NDArray[np.float64],
    face: NDArray[np.int64],
    share: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Smooth unit normals of the pixels in camera coordinates, turned to the viewer's side."""
    smooth = vertex_normals(vertices, faces) @ rotation.T
    corner = vertices @ rotation.T
    a, b, c = (corner[faces[:, k], :2] for k in range(3))
    facing = np.sign((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    normal = np.einsum("nk,nkd->nd", share, smooth[faces[face]]) * facing[face, None]
    return _unit(normal)


def _light(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Brightness of unit normals: ambient light and two Lambert lights; near one facing the viewer."""
    light = np.full(len(normal), AMBIENT)
    for direction, strength in (KEY_LIGHT, FILL_LIGHT):
        light += strength * np.maximum(normal @ (direction / np.linalg.norm(direction)), 0)
    facing = AMBIENT + sum(s * d[2] / np.linalg.norm(d) for d, s in (KEY_LIGHT, FILL_LIGHT))
    light /= facing
    return light


def _crease(height: NDArray[np.float64], seen: NDArray[np.bool_], extent: int) -> NDArray[np.float64]:
    """How much darker a pixel is for lying behind its surroundings; 0 to 0.25."""
    # The surroundings are smooth: one sample of each pixel is enough to know them.
    coarse = (slice(None, None, SAMPLES),) * 2
    width = max(CREASE_WIDTH * extent / SAMPLES, 1.0)
    covered = gaussian_filter(seen[coarse].astype(np.float32), width)
    depth = np.where(seen, height, 0.0)
    blurred = gaussian_filter(depth[coarse].astype(np.float32), width) / np.maximum(covered, 1e-6)
    around = blurred.repeat(SAMPLES, axis=0).repeat(SAMPLES, axis=1)
    behind = (around - depth)[seen] / (CREASE_DEPTH * extent)
    darker: NDArray[np.float64] = 0.25 * np.clip(behind, 0, 1)
    return darker


def _average(picture: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Average the samples of each pixel, colours weighted by opacity."""
    rows, columns = picture.shape[0] // SAMPLES, picture.shape[1] // SAMPLES
    blocks = picture.reshape(rows, SAMPLES, columns, SAMPLES, 4).sum(axis=(1, 3))
    opacity = blocks[..., 3:]
    colour = blocks[..., :3] / np.maximum(opacity, 1)
    bytes_: NDArray[np.uint8] = np.rint(255 * np.concatenate([colour, opacity / SAMPLES**2], axis=2)).astype(
        np.uint8
    )
    return bytes_
