"""Uploads: names that are safe to show, kinds that may be read, archives and bombs that are refused."""

from __future__ import annotations

import gzip
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ReadError, SizeError
from spem.server.uploads import check_content, check_members, safe_name, upload_suffix


@given(st.text(max_size=300))
@settings(max_examples=100, deadline=None)
def test_no_name_leads_anywhere(name: str) -> None:
    """Whatever a client calls a file, what is shown is one short printable word or two, no path."""
    shown = safe_name(name)
    assert shown.isprintable()
    assert 0 < len(shown) <= 130
    assert not set(shown) & set("/\\:\0<>|*?\"'$`;")
    assert not shown.startswith(".")


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("../../etc/passwd.png", "passwd.png"),
        ("a\0b.png", "a_b.png"),
        ("\u202egnp.exe.png", "_gnp.exe.png"),
        ("COM1.stl", "_COM1.stl"),
        ("x" * 4096 + ".nii.gz", "x" * 120 + ".nii.gz"),
        (".png", "shape.png"),
        ("", "shape"),
        ("Füße 2.obj", "Füße 2.obj"),
    ],
)
def test_names_are_kept_where_they_are_harmless(name: str, shown: str) -> None:
    """Only what could be obeyed is replaced; letters of any script stay."""
    assert safe_name(name) == shown


@pytest.mark.parametrize("name", ["a.gz", "a.zip", "a.exe", "a", "a.png.zip", "a.spem", "a.gltf"])
def test_other_kinds_are_refused(name: str) -> None:
    """A kind that is no shape is refused by its name."""
    with pytest.raises(ReadError, match="unknown kind of file"):
        upload_suffix(name)


@pytest.mark.parametrize("magic", [b"PK\x03\x04", b"\x1f\x8b", b"BZh9", b"7z\xbc\xaf\x27\x1c", b"Rar!\x1a"])
def test_archives_are_refused_whatever_their_name(magic: bytes) -> None:
    """What begins as an archive is refused under the name of an image or a mesh."""
    for name in ("a.png", "a.obj", "a.nii"):
        with pytest.raises(ReadError, match="archive; send the file of the shape"):
            check_content(name, magic + bytes(500), 1000)


def test_a_tar_archive_is_refused() -> None:
    """What makes a tar archive stands in its middle."""
    with pytest.raises(ReadError, match="tar archive"):
        check_content("a.obj", bytes(257) + b"ustar\0" + bytes(300), 1000)


def test_packed_volumes_may_expand_up_to_the_limit() -> None:
    """All members of a gzip file count, and trailing rubbish is damage."""
    content = gzip.compress(bytes(600)) + gzip.compress(bytes(600))
    check_content("a.nii.gz", content, 1200)
    with pytest.raises(SizeError, match="expands to more"):
        check_content("a.nii.gz", content, 1199)
    with pytest.raises(ReadError, match="damaged or truncated gzip"):
        check_content("a.nii.gz", content[:-4], 1200)
    with pytest.raises(ReadError, match=r"not a \.nii\.gz file"):
        check_content("a.nii.gz", b"n+1", 1200)


def test_archives_of_arrays_are_limited_in_number_and_size(tmp_path: Path) -> None:
    """The directory of an .npz is believed only where it asks for little."""
    file = tmp_path / "upload.npz"
    np.savez_compressed(file, mask=np.zeros(5000))
    check_members(file, "a.npz", 50_000)
    with pytest.raises(SizeError, match=r"a\.npz: expands to more"):
        check_members(file, "a.npz", 10_000)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number in range(100):
            archive.writestr(f"{number}.npy", b"")
    file.write_bytes(buffer.getvalue())
    with pytest.raises(ReadError, match="holds 100 arrays"):
        check_members(file, "a.npz", 50_000)
    file.write_bytes(b"PK\x03\x04")
    with pytest.raises(ReadError, match=r"a\.npz: damaged"):
        check_members(file, "a.npz", 50_000)
