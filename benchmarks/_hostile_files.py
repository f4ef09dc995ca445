"""Valid files of every kind, made by code, and writers that put any header on them."""

from __future__ import annotations

import gzip
import io
import struct
import zipfile
import zlib

import numpy as np


def seeds() -> dict[str, bytes]:
    """Return one valid file of each kind."""
    return {**_images(), **_volumes(), **_meshes()}


def disk(size: int = 24) -> np.ndarray:
    """Return a white disk on black."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    return np.where(x**2 + y**2 < (size / 3) ** 2, 255, 0).astype(np.uint8)


def _images() -> dict[str, bytes]:
    """Write a disk in each format of images."""
    from PIL import Image

    picture, found = Image.fromarray(disk()), {}
    formats = {"png": "PNG", "gif": "GIF", "jpg": "JPEG", "bmp": "BMP", "tif": "TIFF", "webp": "WEBP"}
    for suffix, form in {**formats, "pgm": "PPM", "ppm": "PPM", "pbm": "PPM"}.items():
        mode = {"ppm": "RGB", "pbm": "1"}.get(suffix, "L")
        buffer = io.BytesIO()
        picture.convert(mode).save(buffer, form)
        found[suffix] = buffer.getvalue()
    return found


def _volumes() -> dict[str, bytes]:
    """Write a ball in each format of volumes."""
    import nibabel
    import tifffile

    grid = np.mgrid[:12, :12, :12] - 5.5
    ball = ((grid**2).sum(0) < 16).astype(np.uint8)
    array, archive, stack = io.BytesIO(), io.BytesIO(), io.BytesIO()
    np.save(array, ball)
    np.savez(archive, mask=ball, spacing=[1.0, 1.0, 2.0])
    tifffile.imwrite(stack, ball)
    nifti = nibabel.Nifti1Image(ball, np.eye(4)).to_bytes()
    return {
        "npy": array.getvalue(),
        "npz": archive.getvalue(),
        "nii": nifti,
        "nii.gz": gzip.compress(nifti, mtime=0),
        "tif-stack": stack.getvalue(),
    }


def _meshes() -> dict[str, bytes]:
    """Write a sphere in each format of meshes."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=1)
    return {
        "obj": ball.export(file_type="obj").encode(),
        "off": ball.export(file_type="off").encode(),
        "ply": ball.export(file_type="ply"),
        "ply-ascii": ball.export(file_type="ply", encoding="ascii"),
        "stl": ball.export(file_type="stl"),
        "stl-ascii": ball.export(file_type="stl_ascii").encode(),
        "glb": trimesh.Scene(ball).export(file_type="glb"),
    }


def chunk(tag: bytes, data: bytes) -> bytes:
    """Return a chunk of a PNG file."""
    return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))


def png(width: int, height: int, data: bytes, *more: bytes) -> bytes:
    """Return a grey PNG file with this packed data."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(more) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def npy(descr: str, shape: str, data: bytes = b"") -> bytes:
    """Return a NumPy file with any header."""
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def packed(members: dict[str, bytes]) -> bytes:
    """Return a packed archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def glb(tree: bytes, data: bytes = b"") -> bytes:
    """Return a GLB file with any JSON."""
    tree += b" " * (-len(tree) % 4)
    data += bytes(-len(data) % 4)
    body = struct.pack("<I4s", len(tree), b"JSON") + tree
    if data:
        body += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def nifti(dims: tuple[int, ...], code: int = 2, offset: float = 352.0, extra: bytes = b"") -> bytes:
    """Return a NIfTI header with any dimensions, and next to no data."""
    head = bytearray(352)
    head[0:4] = struct.pack("<i", 348)
    full = (len(dims), *dims, *(1,) * (7 - len(dims)))
    head[40:56] = struct.pack("<8h", *full)
    head[70:74] = struct.pack("<hh", code, 8)
    head[76:108] = struct.pack("<8f", *(1.0,) * 8)
    head[108:112] = struct.pack("<f", offset)
    head[344:348] = b"n+1\0"
    return bytes(head) + extra
