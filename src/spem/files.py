"""Files written in one step, whole or not at all, and what reading damaged ones raises."""

from __future__ import annotations

import os
import secrets
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from spem.errors import ParameterError

#: What zipfile, numpy and json raise on bytes that are not what they expect.
DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
)


def write_whole(path: str | os.PathLike[str], write: Callable[[IO[bytes]], object]) -> None:
    """Write a file: all of it or, on any failure, nothing.

    Parameters
    ----------
    path
        File to write; one that is there is replaced at the end, in one step.
    write
        Called with the open file.

    Raises
    ------
    ParameterError
        When the folder is not there, cannot be written, or is full.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_whole(Path(folder, "a.txt"), lambda file: file.write(b"whole"))
    ...     Path(folder, "a.txt").read_bytes()
    b'whole'
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(target)
    except OSError as error:
        msg = f"{target}: cannot be written ({error.strerror}); give a file in a writable folder with room"
        raise ParameterError(msg) from error
    finally:
        temporary.unlink(missing_ok=True)
