"""Hostile files of odd numbers, and small ones that expand to large ones."""

from __future__ import annotations

import gzip
import io
import struct
import zlib
from collections.abc import Iterator

import numpy as np

from _hostile_case import Case
from _hostile_files import chunk, disk, nifti, npy, packed, png

_BOMB = 64 << 20


def values() -> Iterator[Case]:
    """Yield files whose numbers are no numbers, or out of any range."""
    faces = "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"
    corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1"]
    for odd in (
        "nan nan nan",
        "inf 0 0",
        "-inf 1e999 0",
        "1e308 0 0",
        "-1e308 1e308 0",
        "1e-320 0 0",
        "1e200 0 0",
        "0x41 0 0",
        "",
        "1",
        "1 2",
        "a b c",
        "1 " * 50_000,
        "١ ٢ ٣",
    ):
        lines = [f"v {corner}" for corner in (*corners[:3], odd)]
        yield Case("obj", f"vertex {odd[:14]!r}", "odd.obj", ("\n".join(lines) + "\n" + faces).encode())
    for face in (
        "f 1 2 999999999",
        "f -1 -2 -99999",
        "f 0 0 0",
        "f 1 1 1",
        "f 1/2/3/4/5 2 3",
        "f 1.5 2 3",
        "f " + "1 " * 50_000,
        "f",
        "f 99999999999999999999999 1 2",
        "f 1 2 3 nan",
    ):
        yield Case(
            "obj",
            f"face {face[:16]!r}",
            "odd.obj",
            ("\n".join(f"v {c}" for c in corners) + f"\n{faces}{face}\n").encode(),
        )
    flat = "\n".join(f"v {x} {y} 0" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    yield Case("obj", "flat", "odd.obj", (flat + "\nf 1 2 3\nf 1 3 4\n").encode())
    yield Case(
        "obj", "needle, 1 : 10^7", "odd.obj", ("v 0 0 0\nv 1e7 0 0\nv 0 1 0\nv 0 0 1\n" + faces).encode()
    )
    yield Case("obj", "all in one point", "odd.obj", ("v 5 5 5\n" * 4 + faces).encode())
    yield Case(
        "obj",
        "far away, tiny",
        "odd.obj",
        ("v 1e15 0 0\nv 1000000000000001 0 0\nv 1e15 1 0\nv 1e15 0 1\n" + faces).encode(),
    )
    yield Case("obj", "one line of 5 MB", "odd.obj", b"v " + b"1" * (5 << 20))
    yield Case("obj", "backslashes at the end of lines", "odd.obj", b"v 0 0 0 \\\n" * 20_000)
    for dtype, value in (
        ("<f8", np.nan),
        ("<f8", np.inf),
        ("<f8", 1e308),
        ("<f4", -np.inf),
        ("<f8", 1e-310),
        ("<i8", -(2**63)),
        ("<u8", 2**64 - 1),
        ("|i1", -128),
        ("<f2", 65504),
    ):
        array = np.zeros((8, 8, 8), dtype)
        array[2:6, 2:6, 2:6] = value
        buffer = io.BytesIO()
        np.save(buffer, array)
        yield Case("npy", f"values {dtype} {value}", "odd.npy", buffer.getvalue())
    noise = io.BytesIO()
    np.save(noise, np.random.default_rng(0).integers(0, 2**31, (12, 12, 12)))
    yield Case("npy", "each voxel a label of its own", "labels.npy", noise.getvalue())
    for spacing in (
        [0.0],
        [-1.0, 1, 1],
        [np.nan] * 3,
        [np.inf] * 3,
        [1e300] * 3,
        [1e-300] * 3,
        [1.0] * 7,
        ["a"],
        [1e-9, 1.0, 1e9],
    ):
        buffer = io.BytesIO()
        np.savez(buffer, mask=np.pad(np.ones((4, 4, 4), np.uint8), 2), spacing=np.array(spacing))
        yield Case("npz", f"spacing {str(spacing)[:20]}", "odd.npz", buffer.getvalue())
    for length in (np.nan, np.inf, 0.0, -1.0, 1e38):
        head = bytearray(nifti((6, 6, 6), extra=(np.pad(np.ones((4, 4, 4), np.uint8), 1)).tobytes()))
        head[80:92] = struct.pack("<3f", *(length,) * 3)
        yield Case("nii", f"spacing {length}", "odd.nii", bytes(head))


def bombs() -> Iterator[Case]:
    """Yield small files that expand to large ones."""
    zeros = bytes(_BOMB)
    shrunk, member = zlib.compress(zeros, 9), gzip.compress(zeros, 9, mtime=0)
    yield Case(
        "png",
        "bomb: 12000 x 12000 pixels",
        "bomb.png",
        png(12_000, 12_000, zlib.compress(bytes(12_001) * 12_000, 1)),
    )
    text = chunk(b"zTXt", b"Comment\0\0" + shrunk)
    profile = chunk(b"iCCP", b"p\0\0" + shrunk)
    for how, more in (("text of 64 MB", text), ("profile of 64 MB", profile)):
        yield Case("png", f"bomb: {how}", "bomb.png", png(8, 8, zlib.compress(b"\0" * 72), more))
    yield Case("png", "data of 64 MB for 8 x 8 pixels", "bomb.png", png(8, 8, shrunk))
    yield Case(
        "nii.gz",
        "bomb: 512 MB behind 1 voxel",
        "bomb.nii.gz",
        gzip.compress(nifti((5, 5, 5)), mtime=0) + member * 8,
    )
    yield Case(
        "nii.gz",
        "bomb: 32767 x 16000 voxels",
        "bomb.nii.gz",
        gzip.compress(nifti((32767, 16000)), mtime=0) + member * 8,
    )
    yield Case("nii.gz", "bomb in a bomb", "bomb.nii.gz", gzip.compress(member, mtime=0))
    big = npy("'|u1'", f"({_BOMB},)") + zeros
    yield Case("npz", "bomb: a row of 64 MB", "bomb.npz", packed({"mask.npy": big}))
    small = npy("'|u1'", "(4, 4)", bytes(range(16)))
    yield Case("npz", "bomb: spacing of 64 MB", "bomb.npz", packed({"mask.npy": small, "spacing.npy": big}))
    yield Case("npz", "bomb: origin of 64 MB", "bomb.npz", packed({"mask.npy": small, "origin.npy": big}))
    yield Case("npz", "20,000 members", "bomb.npz", packed({f"{i}.npy": b"" for i in range(20_000)}))
    whole = bytearray(packed({"mask.npy": small}))
    at = whole.rindex(b"PK\x01\x02")
    whole[at + 24 : at + 28] = struct.pack("<I", 2**32 - 2)
    yield Case("npz", "a size of 4 GB in the directory", "bomb.npz", bytes(whole))
    from PIL import Image

    frames = io.BytesIO()
    Image.fromarray(disk()).save(frames, "GIF", save_all=True, append_images=[Image.fromarray(disk())] * 500)
    yield Case("gif", "500 frames", "bomb.gif", frames.getvalue())
    pages = io.BytesIO()
    Image.new("1", (30_000, 30_000)).save(pages, "TIFF", compression="group4")
    yield Case("tif", "bomb: 30000 x 30000 pixels", "bomb.tif", pages.getvalue())
    chain = bytearray(
        b"II*\0\x08\0\0\0" + struct.pack("<H", 1) + struct.pack("<HHII", 256, 4, 1, 8) + struct.pack("<I", 8)
    )
    yield Case("tif", "pages in a loop", "loop.tif", bytes(chain))
    yield Case(
        "tif",
        "60,000 entries",
        "loop.tif",
        b"II*\0\x08\0\0\0" + struct.pack("<H", 60_000) + struct.pack("<HHII", 256, 4, 2**31, 8) * 60_000,
    )
