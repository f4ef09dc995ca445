"""One writer at a time: an advisory lock on a file of the folder, which the system drops with the process."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from spem.errors import ParameterError

LOCK_FILE = ".lock"
# Writes take milliseconds; an optimisation of a large index some minutes.
PATIENCE = 600.0
_FIRST_PAUSE, _LONGEST_PAUSE = 0.002, 0.1

if sys.platform == "win32":
    import msvcrt

    def _take(file: int) -> None:
        """Lock the first byte of a file, or raise OSError at once."""
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _take(file: int) -> None:
        """Lock a file, or raise OSError at once."""
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def one_writer(folder: Path, patience: float = PATIENCE) -> Iterator[None]:
    """Hold the lock of a folder, among threads as well as processes.

    Parameters
    ----------
    folder
        The folder; made where there is none.
    patience
        Seconds to wait for another writer.

    Raises
    ------
    ParameterError
        When the folder cannot be written to, or another holds the lock for longer.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder, one_writer(Path(folder)):
    ...     print("alone")
    alone
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666)
    except OSError as error:
        msg = f"{folder}: cannot be written to ({error.strerror}); check its permissions and its disk"
        raise ParameterError(msg) from error
    try:
        _wait(file, folder, patience)
        yield
    finally:
        # closing drops the lock
        os.close(file)


def _wait(file: int, folder: Path, patience: float) -> None:
    """Take the lock as soon as it is free."""
    until, pause = time.monotonic() + patience, _FIRST_PAUSE
    while True:
        try:
            return _take(file)
        except (BlockingIOError, PermissionError) as error:
            if time.monotonic() > until:
                msg = f"{folder}: another process has been writing for {patience:g} s; try again after it"
                raise ParameterError(msg) from error
        except OSError as error:
            msg = f"{folder}: this file system has no locks ({error.strerror}); keep the index on another one"
            raise ParameterError(msg) from error
        time.sleep(pause)
        pause = min(2 * pause, _LONGEST_PAUSE)
