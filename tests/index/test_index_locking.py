"""Tests of the lock of writers."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from spem.errors import ParameterError
from spem.index.locking import one_writer

_HOLDER = """
import sys, time
from pathlib import Path
from spem.index.locking import one_writer
with one_writer(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_second_writer_waits_and_gives_up(tmp_path: Path) -> None:
    """While one writes another waits, and after its patience says so."""
    told = pytest.raises(ParameterError, match="another process has been writing")
    with one_writer(tmp_path), told, one_writer(tmp_path, patience=0.05):
        pass
    with one_writer(tmp_path, patience=0.05):
        pass


def test_the_lock_of_a_killed_process_is_free(tmp_path: Path) -> None:
    """The system drops the lock with the process, however it ends."""
    holder = subprocess.Popen(
        [sys.executable, "-c", _HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    with pytest.raises(ParameterError, match="another process"), one_writer(tmp_path, patience=0.05):
        pass
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    holder.stdout.close()
    with one_writer(tmp_path, patience=5.0):
        pass


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    """Where there can be no folder there is no index."""
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match="cannot be written to"), one_writer(tmp_path / "file" / "db"):
        pass
