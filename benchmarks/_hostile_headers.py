"""Hostile files that announce more than they hold."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator

from _hostile_case import Case
from _hostile_files import glb, nifti, npy, png

_BOMB = 64 << 20


def headers() -> Iterator[Case]:
    """Yield files that announce more than they hold, or than any machine holds."""
    big = 1_000_000_000
    ply = (
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    yield from (
        Case("png", f"{w} x {h} pixels", "huge.png", png(w, h, zlib.compress(b"\0" * 100)))
        for w, h in ((2**31 - 1, 2**31 - 1), (60_000, 60_000), (2**31 - 1, 1), (0, 0))
    )
    yield Case(
        "bmp",
        "2^31 pixels",
        "huge.bmp",
        b"BM"
        + struct.pack("<IHHIIiiHHIIiiII", 70, 0, 0, 54, 40, 2**31 - 1, 2**31 - 1, 1, 24, 0, 0, 1, 1, 0, 0),
    )
    yield Case(
        "gif",
        "65535 x 65535 pixels",
        "huge.gif",
        b"GIF89a"
        + struct.pack("<HHBBB", 65535, 65535, 0, 0, 0)
        + b","
        + struct.pack("<HHHHB", 0, 0, 65535, 65535, 0)
        + b"\x08\x01\x00\x00;",
    )
    for magic, suffix in ((b"P5", "pgm"), (b"P6", "ppm"), (b"P4", "pbm"), (b"P2", "pgm")):
        yield Case(
            suffix,
            "10^9 x 10^9 pixels",
            f"huge.{suffix}",
            magic + b"\n1000000000 1000000000\n255\n" + bytes(64),
        )
    yield Case("pgm", "negative size", "huge.pgm", b"P5\n-5 -5\n255\n" + bytes(64))
    yield Case("pgm", "a number of 100,000 digits", "huge.pgm", b"P5\n" + b"9" * 100_000 + b" 5\n255\n")
    for descr, shape in (
        ("'|u1'", "(1000000000, 1000000000)"),
        ("'<f8'", "(4611686018427387904, 4)"),
        ("'|u1'", "(-5, 5)"),
        ("'|u1'", "()"),
        ("'|u1'", "(0, 5)"),
        ("'<U1000000'", "(5, 5)"),
        ("'|S10'", "(3, 3)"),
        ("'<c16'", "(3, 3)"),
        ("'<M8[s]'", "(3, 3)"),
        ("[('a', '<f8')]", "(3, 3)"),
        ("'|V100000000'", "(9,)"),
        ("'|u1'", "(1,) * 40"),
        ("'|u1'", str((2,) * 33)),
        ("'|u1'", str((1,) * 20)),
        ("'|b1'", "(True, 4)"),
        ("'<f2'", "(3, 3)"),
    ):
        yield Case("npy", f"header {descr} {shape[:24]}", "huge.npy", npy(descr, shape, bytes(4096)))
    yield Case(
        "npy",
        "header of 65 kB of brackets",
        "huge.npy",
        b"\x93NUMPY\x01\x00" + struct.pack("<H", 65000) + b"(" * 65000,
    )
    yield Case(
        "npy", "header of 4 GB", "huge.npy", b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**32 - 1) + b"{"
    )
    yield Case("npy", "version 9", "huge.npy", b"\x93NUMPY\x09\x00" + struct.pack("<H", 10) + b" " * 10)
    for dims in ((32767, 32767, 32767), (0, 5, 5), (-3, 5, 5), (5, 5, 5, 5, 5, 5, 5), (1, 1, 1)):
        yield Case("nii", f"dimensions {dims}", "huge.nii", nifti(dims, extra=bytes(4096)))
    yield Case("nii", "unknown type", "huge.nii", nifti((5, 5, 5), code=9999, extra=bytes(4096)))
    yield Case("nii", "colour type", "huge.nii", nifti((5, 5, 5), code=128, extra=bytes(4096)))
    yield Case("nii", "complex type", "huge.nii", nifti((5, 5, 5), code=32, extra=bytes(4096)))
    yield Case("nii", "data beyond the end", "huge.nii", nifti((5, 5, 5), offset=1e30, extra=bytes(400)))
    yield Case("nii", "data at NaN", "huge.nii", nifti((5, 5, 5), offset=float("nan"), extra=bytes(400)))
    yield Case(
        "nii",
        "extension of 2 GB",
        "huge.nii",
        nifti((5, 5, 5), offset=2e9, extra=b"\1\0\0\0" + struct.pack("<ii", 2**31 - 16, 4) + bytes(400)),
    )
    yield Case("off", "10^9 vertices", "huge.off", f"OFF\n{big} {big} 0\n0 0 0\n".encode())
    yield Case("off", "negative counts", "huge.off", b"OFF\n-4 -4 0\n0 0 0\n")
    yield Case(
        "off", "face of 10^9 corners", "huge.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n1000000000 0 1 2\n"
    )
    yield Case("off", "count of 100,000 digits", "huge.off", b"OFF\n" + b"9" * 100_000 + b" 1 0\n")
    for form in ("ascii", "binary_little_endian", "binary_big_endian"):
        yield Case(
            "ply", f"10^9 vertices, {form}", "huge.ply", ply.format(form, big, big).encode() + bytes(64)
        )
    yield Case(
        "ply",
        "list of 2^32 entries",
        "huge.ply",
        ply.format("binary_little_endian", 3, 1).replace("uchar int", "uint int").encode()
        + bytes(36)
        + struct.pack("<I", 2**32 - 1)
        + bytes(12),
    )
    yield Case("ply", "no end of header", "huge.ply", b"ply\nformat ascii 1.0\n" + b"comment x\n" * 50_000)
    yield Case(
        "ply",
        "unknown type",
        "huge.ply",
        ply.format("ascii", 3, 1).replace("float x", "quaternion x").encode(),
    )
    yield Case(
        "ply",
        "10,000 properties",
        "huge.ply",
        b"ply\nformat ascii 1.0\nelement vertex 1\n"
        + b"".join(b"property float p%d\n" % i for i in range(10_000))
        + b"end_header\n"
        + b"0 " * 10_000,
    )
    for count in (big, 2**32 - 1, 0):
        yield Case("stl", f"{count} faces", "huge.stl", bytes(80) + struct.pack("<I", count) + bytes(100))
    yield Case(
        "glb",
        "length of 4 GB",
        "huge.glb",
        struct.pack("<4sII", b"glTF", 2, 2**32 - 1) + struct.pack("<I4s", 2**32 - 1, b"JSON") + b"{}",
    )
    yield Case("glb", "version 99", "huge.glb", struct.pack("<4sII", b"glTF", 99, 20) + bytes(8))
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": big, "type": "VEC3"},
            {"bufferView": 0, "componentType": 5125, "count": 2**40, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 2**40}],
        "buffers": [{"byteLength": 2**40}],
    }
    yield Case("glb", "accessor of 10^9 entries", "huge.glb", glb(json.dumps(tree).encode(), bytes(64)))
    yield Case(
        "glb",
        "node that is its own child",
        "loop.glb",
        glb(json.dumps({**tree, "nodes": [{"children": [0], "mesh": 0}]}).encode(), bytes(64)),
    )
    yield Case(
        "glb",
        "negative count",
        "huge.glb",
        glb(
            json.dumps(
                {
                    **tree,
                    "accessors": [{"bufferView": 0, "componentType": 5126, "count": -5, "type": "VEC3"}] * 2,
                }
            ).encode(),
            bytes(64),
        ),
    )
    sparse = {"bufferView": 0, "componentType": 5126, "count": big, "type": "VEC3", "sparse": {"count": big}}
    yield Case(
        "glb",
        "zeros without data",
        "zeros.glb",
        glb(
            json.dumps(
                {**tree, "accessors": [{k: v for k, v in sparse.items() if k != "bufferView"}] * 2}
            ).encode(),
            bytes(64),
        ),
    )
