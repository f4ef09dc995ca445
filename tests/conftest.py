"""Fixtures shared by all tests."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest


def pytest_configure() -> None:
    """Let processes be interrupted: a job in the background of a shell would ignore it, and all it starts."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs a CUDA device, with the reason why there is none, before anything is drawn for it."""
    if item.get_closest_marker("cuda"):
        from backends import use_backend

        use_backend("cuda")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Return the folder of real shapes: SPEM_DATA, or ../shared/data beside the repository."""
    root = Path(os.environ.get("SPEM_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not root.is_dir():
        pytest.skip(f"no real shapes: {root} is absent; set SPEM_DATA to the folder that holds them")
    return root
