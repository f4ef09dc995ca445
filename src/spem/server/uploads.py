"""Files that strangers send: a name that is safe to show, a kind that may be read, no archives."""

from __future__ import annotations

import gzip
import io
import unicodedata
import zipfile
import zlib
from pathlib import Path

from spem.errors import ReadError, SizeError
from spem.shapes.kinds import SUFFIXES

# A name is for people; beyond this it is no use to them.
_LONGEST_NAME = 120
# Letters, marks, digits; all else of a name becomes an underscore.
_SHOWN = ("L", "M", "N")
_PLAIN = " .-_()+"
# Windows opens these as devices, whatever their ending.
_DEVICES = {"con", "prn", "aux", "nul"} | {f"{port}{n}" for port in ("com", "lpt") for n in range(10)}
_ARCHIVES = {
    b"PK\x03\x04": "zip",
    b"PK\x05\x06": "zip",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"\x28\xb5\x2f\xfd": "Zstandard",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "rar",
}
_TAR_MAGIC = slice(257, 262)
# Kinds that are packed by nature.
_PACKED = {".npz": "zip", ".nii.gz": "gzip"}
# The volume, its spacing, its origin, and arrays beside it that are not read.
_MOST_MEMBERS = 64
_CHUNK = 1 << 20


def safe_name(name: str) -> str:
    r"""Return the last part of a file's name, fit to be shown: no folder, control, direction or device.

    Examples
    --------
    >>> safe_name("../../etc/passwd"), safe_name("C:\\scans\\tooth.nii.gz"), safe_name("con.png")
    ('passwd', 'tooth.nii.gz', '_con.png')
    """
    last = unicodedata.normalize("NFC", name.replace("\\", "/")).rpartition("/")[2]
    clean = "".join(c if unicodedata.category(c)[0] in _SHOWN or c in _PLAIN else "_" for c in last)
    clean = clean.lstrip().rstrip(" .")
    suffix = next((end for end in reversed(SUFFIXES) if clean.lower().endswith(end)), "")
    stem = clean.removesuffix(clean[len(clean) - len(suffix) :]) if suffix else clean
    stem = stem[:_LONGEST_NAME].strip(" .") or "shape"
    if stem.partition(".")[0].lower() in _DEVICES:
        stem = f"_{stem}"
    return stem + clean[len(clean) - len(suffix) :] if suffix else stem


def upload_suffix(name: str) -> str:
    """Return the kind of an upload: the suffix, in lower case, under which it is kept.

    Raises
    ------
    ReadError
        When it is none that spem reads.

    Examples
    --------
    >>> upload_suffix("Tooth.NII.GZ")
    '.nii.gz'
    """
    found = [suffix for suffix in SUFFIXES if name.lower().endswith(suffix)]
    if not found:
        msg = f"{safe_name(name)}: unknown kind of file; expected one of {', '.join(SUFFIXES)}"
        raise ReadError(msg)
    return max(found, key=len)


def check_content(name: str, content: bytes, most_bytes: int) -> None:
    r"""Refuse archives, and packed volumes that expand to more than a limit.

    Parameters
    ----------
    name
        Name of the upload.
    content
        What it holds.
    most_bytes
        Most that an .npz or a .nii.gz may expand to.

    Raises
    ------
    ReadError
        When it is empty or an archive.
    SizeError
        When it expands to more.

    Examples
    --------
    >>> check_content("hand.png", b"PK\x03\x04", 1000)
    Traceback (most recent call last):
    ...
    spem.errors.ReadError: hand.png: is a zip archive; send the file of the shape itself
    """
    shown, suffix = safe_name(name), upload_suffix(name)
    if not content:
        msg = f"{shown}: the file is empty (0 bytes)"
        raise ReadError(msg)
    kind = next((kind for magic, kind in _ARCHIVES.items() if content.startswith(magic)), "")
    if content[_TAR_MAGIC] == b"ustar":
        kind = "tar"
    expected = _PACKED.get(suffix, "")
    if kind and kind != expected:
        msg = f"{shown}: is a {kind} archive; send the file of the shape itself"
        raise ReadError(msg)
    if expected and not kind:
        msg = f"{shown}: damaged, or not a {suffix} file; write it again"
        raise ReadError(msg)
    if expected == "gzip":
        _check_gzip(shown, content, most_bytes)


def check_members(path: Path, shown: str, most_bytes: int) -> None:
    """Refuse an .npz file with too many arrays, or with more in them than a limit.

    Raises
    ------
    ReadError
        When it is damaged or has too many.
    SizeError
        When it expands to more.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = [member.file_size for member in archive.infolist()]
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
        msg = f"{shown}: damaged, truncated or not a .npz file; write it again"
        raise ReadError(msg) from error
    if len(sizes) > _MOST_MEMBERS:
        msg = f"{shown}: holds {len(sizes)} arrays, the limit is {_MOST_MEMBERS}; send the volume alone"
        raise ReadError(msg)
    if sum(sizes) > most_bytes:
        raise _too_large(shown, most_bytes)


def _check_gzip(shown: str, content: bytes, most_bytes: int) -> None:
    """Expand a gzip file to nowhere, up to the limit."""
    total = 0
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(content)) as file:
            while chunk := file.read(_CHUNK):
                total += len(chunk)
                if total > most_bytes:
                    raise _too_large(shown, most_bytes)
    except (OSError, EOFError, zlib.error) as error:
        msg = f"{shown}: damaged or truncated gzip ({error}); write it again"
        raise ReadError(msg) from error


def _too_large(shown: str, most_bytes: int) -> SizeError:
    """Say that a packed file expands beyond its limit."""
    return SizeError(f"{shown}: expands to more than {most_bytes >> 20} MiB; send a coarser version")
