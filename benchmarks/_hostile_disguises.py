"""Hostile files that refer to others, that are something else, or have names that no file should have."""

from __future__ import annotations

import io
import json
import pickle
from collections.abc import Callable, Iterator

import numpy as np

from _hostile_case import CANARY, Case
from _hostile_files import glb, packed, seeds

_BOMB = 64 << 20


def references() -> Iterator[Case]:
    """Yield files that name other files."""
    solid = (
        "\n".join(f"v {c}" for c in ("0 0 0", "1 0 0", "0 1 0", "0 0 1"))
        + "\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"
    )
    for target in (
        CANARY,
        f"../{CANARY}",
        f"../../{CANARY}",
        "/etc/passwd",
        f"file:///{CANARY}",
        "\\\\host\\share",
        "http://127.0.0.1:9/x.mtl",
        "CON",
        "/dev/zero",
        "/dev/stdin",
    ):
        yield Case("obj", f"material {target}", "refers.obj", f"mtllib {target}\nusemtl a\n{solid}".encode())
        tree = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": target}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": target}],
        }
        yield Case(
            "glb", f"buffer and picture {target}", "refers.glb", glb(json.dumps(tree).encode(), bytes(36))
        )
    yield Case(
        "ply",
        "texture",
        "refers.ply",
        f"ply\nformat ascii 1.0\ncomment TextureFile ../{CANARY}\n".encode()
        + b"element vertex 0\nelement face 0\nend_header\n",
    )


def disguises() -> Iterator[Case]:
    """Yield one kind under the name of another, and what should never be read at all."""
    made = seeds()

    class Evil:
        def __reduce__(self) -> tuple[Callable[..., object], tuple[str, str]]:
            return open, (CANARY, "w")

    evil = pickle.dumps(Evil())
    objects = io.BytesIO()
    np.save(objects, np.array([Evil()], dtype=object), allow_pickle=True)
    xml = (
        b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">'
        b'<!ENTITY b "&a;&a;&a;&a;">]><x>&b;</x>'
    )
    script = b"#!/bin/sh\ntouch " + CANARY.encode() + b"\n"
    html = b"<html><script>alert(1)</script></html>"
    deep, giant = b"[" * 2_000_000, b'{"a":' + b'"' + b"x" * (5 << 20) + b'"}'
    for suffix in ("png", "npy", "npz", "nii", "obj", "off", "ply", "stl", "glb", "tif", "webp", "nii.gz"):
        yield Case(suffix, "a pickle", f"evil.{suffix}", evil)
        yield Case(
            suffix, "an archive", f"evil.{suffix}", packed({"../../evil.txt": b"evil", "mask.npy": b""})
        )
    for suffix in ("png", "npy", "obj", "glb", "tif"):
        for how, content in (
            ("XML with entities", xml),
            ("a script", script),
            ("a page", html),
            ("random bytes", np.random.default_rng(1).bytes(5000)),
            ("deep JSON", deep),
            ("zeros", bytes(100_000)),
        ):
            yield Case(suffix, how, f"evil.{suffix}", content)
    yield Case("npy", "Python objects", "evil.npy", objects.getvalue())
    yield Case("npz", "Python objects", "evil.npz", packed({"mask.npy": objects.getvalue()}))
    yield Case(
        "npz",
        "Python objects for spacing",
        "evil.npz",
        packed({"mask.npy": made["npy"], "spacing.npy": objects.getvalue()}),
    )
    yield Case(
        "npz",
        "members outside",
        "evil.npz",
        packed({"../../mask.npy": made["npy"], "/mask.npy": made["npy"]}),
    )
    yield Case("glb", "deep JSON", "deep.glb", glb(deep[:200_000]))
    yield Case("glb", "giant JSON", "giant.glb", glb(giant))
    yield Case("glb", "JSON that is a number", "odd.glb", glb(b"1"))
    yield Case(
        "glb",
        "JSON of nulls",
        "odd.glb",
        glb(b'{"asset":null,"scenes":null,"nodes":[null],"meshes":[null]}'),
    )
    for suffix, kind in (
        ("png", "obj"),
        ("obj", "png"),
        ("npy", "nii"),
        ("nii", "npy"),
        ("stl", "ply"),
        ("glb", "stl"),
        ("tif", "npz"),
        ("gif", "glb"),
        ("off", "obj"),
        ("npz", "npy"),
        ("nii.gz", "nii"),
    ):
        yield Case(suffix, f"holds {kind}", f"wrong.{suffix}", made[kind])
    # Pillow would read these by their content, whatever the name; they need programs or are rare
    for how, content in (
        ("PostScript", b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\nquit\n"),
        ("an icon", b"\0\0\1\0\1\0"),
        ("FITS", b"SIMPLE  =                    T" + b" " * 2851),
        ("WMF", b"\xd7\xcd\xc6\x9a" + bytes(60)),
        ("PSD", b"8BPS\0\1" + bytes(60)),
    ):
        yield Case("png", how, "other.png", content)


def names() -> Iterator[Case]:
    """Yield a valid file under names that no file should have."""
    content = seeds()["png"]
    odd = (
        "../../etc/passwd.png", "/etc/passwd.png", "..\\..\\boot.png", "C:\\Windows\\system32.png",
        "a\x00b.png", "x" * 4096 + ".png", "\u202egnp.exe.png", "CON.png", "nul.png", "COM1.png", " .png",
        ".png", "..png", "a\nb\r\nSet-Cookie: x=1.png", "%2e%2e%2fpasswd.png", "$(touch canary.txt).png",
        "`id`.png", "; rm -rf x.png", "<script>alert(1)</script>.png", "\U0001f600.png", "name.png/",
        "name.png.", "name.PNG", "a" * 255 + ".png", "-rf.png", "~root.png", "|id.png", "*.png", "?.png",
        "name.exe", "name", "", ".", "..", "name.png.zip", "name.tar.gz", "name.gz", "name.spem",
        "name.svg", "name.py", "upload.png", "\u202e.png", "\ufdfd" * 60 + ".png", "\x1b[31mred.png",
        "\x00.png", "//server/share.png", "file:///etc/passwd.png",
    )  # fmt: skip
    for name in odd:
        yield Case("name", f"{name[:24]!r}", name, content)
