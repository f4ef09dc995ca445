"""What a reader checks before it reads: that there is a file, and that its grid fits the memory limit."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

from spem.errors import ParameterError, ReadError, SizeError

# A mesh has no grid of its own; the code of a shape no longer changes above this many voxels.
DEFAULT_VOXELS = 15_000
DEFAULT_MEMORY_LIMIT = 2 << 30
_UNITS = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}


def memory_limit_bytes(memory_limit: int | None = None) -> int:
    """Return the memory limit in force: the argument, else SPEM_MEMORY_LIMIT, else 2 GiB.

    Parameters
    ----------
    memory_limit
        Bytes, or None for the environment's or the default limit.

    Raises
    ------
    ParameterError
        When the argument or the environment's value is not a positive size.

    Examples
    --------
    >>> memory_limit_bytes(1024)
    1024
    """
    if memory_limit is not None:
        if memory_limit <= 0:
            msg = f"memory_limit={memory_limit}: expected a positive number of bytes"
            raise ParameterError(msg)
        return int(memory_limit)
    text = os.environ.get("SPEM_MEMORY_LIMIT", "")
    return parse_size(text, "SPEM_MEMORY_LIMIT") if text else DEFAULT_MEMORY_LIMIT


def parse_size(text: str, what: str = "size") -> int:
    """Return the bytes that a size in words stands for; K, M, G and T are powers of 1024.

    Raises
    ------
    ParameterError
        When the text is not a positive number with one of these units, or none.

    Examples
    --------
    >>> parse_size("4G"), parse_size("1.5 MiB")
    (4294967296, 1572864)
    """
    match = re.fullmatch(r"\s*(\d+(?:\.\d*)?|\.\d+)\s*([KMGT]?)(?:i?B)?\s*", text, re.IGNORECASE)
    size = int(float(match[1]) * _UNITS[match[2].upper()]) if match else 0
    if size <= 0:
        msg = f"{what}={text!r}: expected a positive size in bytes such as 500M or 4G"
        raise ParameterError(msg)
    return size


def check_size(shape: tuple[int, ...], bytes_per_cell: float, memory_limit: int | None, what: str) -> None:
    """Refuse a grid whose arrays would take more memory than the limit.

    Parameters
    ----------
    shape
        Cells along each axis.
    bytes_per_cell
        Most bytes held for one cell at a time.
    memory_limit
        Bytes, or None for SPEM_MEMORY_LIMIT or the default of 2 GiB.
    what
        The file or call, for the message.

    Raises
    ------
    SizeError
        When the limit would be passed.

    Examples
    --------
    >>> check_size((60_000, 60_000), 16, None, "wide.png")
    Traceback (most recent call last):
    ...
    spem.errors.SizeError: wide.png: 60000 x 60000 cells need 53.6 GiB, the limit is 2 GiB; ...
    """
    limit = memory_limit_bytes(memory_limit)
    needed = math.prod(shape) * bytes_per_cell
    if needed > limit:
        cells = " x ".join(map(str, shape))
        msg = (
            f"{what}: {cells} cells need {format_size(needed)}, the limit is {format_size(limit)}; "
            "use a coarser version, or raise memory_limit= or SPEM_MEMORY_LIMIT"
        )
        raise SizeError(msg)


def format_size(size: float) -> str:
    """Return bytes as text in the largest unit that keeps the number above one.

    Examples
    --------
    >>> format_size(1536)
    '1.5 KiB'
    """
    for unit in ("bytes", "KiB", "MiB", "GiB"):
        if size < 1024:
            return f"{size:.3g} {unit}"
        size /= 1024
    return f"{size:.4g} TiB"


def printable(error: object, most: int = 120) -> str:
    r"""Return what a library says of a damaged file as the words of one line, without its control characters.

    Parameters
    ----------
    error
        The error, or any text.
    most
        Most characters that are told.

    Examples
    --------
    >>> printable(ValueError("no magic:\n\x1b[31m"))
    'no magic: ?[31m'
    """
    text = "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in str(error))
    short = " ".join(text.split())
    name = "" if isinstance(error, str) else type(error).__name__
    return (short if len(short) <= most else f"{short[: most - 3]}...") or name


def check_file(path: Path) -> None:
    """Refuse a path that is no file, or an empty one.

    Parameters
    ----------
    path
        The path as the caller gave it.

    Raises
    ------
    ReadError
        When there is nothing to read at the path.

    Examples
    --------
    >>> check_file(Path("absent.png"))
    Traceback (most recent call last):
    ...
    spem.errors.ReadError: absent.png: no such file; check the path
    """
    if path.is_dir():
        msg = f"{path}: is a folder, expected a file"
        raise ReadError(msg)
    try:
        size = path.stat().st_size
    except (FileNotFoundError, NotADirectoryError) as error:
        msg = f"{path}: no such file; check the path"
        raise ReadError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be opened ({error.strerror}); check the path"
        raise ReadError(msg) from error
    if size == 0:
        msg = f"{path}: the file is empty (0 bytes)"
        raise ReadError(msg)
