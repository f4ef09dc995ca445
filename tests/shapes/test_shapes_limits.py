"""What a reader checks before it reads."""

from __future__ import annotations

import pytest

from spem.errors import ParameterError, ReadError, SizeError
from spem.shapes.limits import (
    DEFAULT_MEMORY_LIMIT,
    check_file,
    check_size,
    format_size,
    memory_limit_bytes,
    parse_size,
)


def test_limit_comes_from_argument_then_environment_then_default(monkeypatch):
    """An argument beats SPEM_MEMORY_LIMIT, which beats two gibibytes."""
    monkeypatch.delenv("SPEM_MEMORY_LIMIT", raising=False)
    assert memory_limit_bytes() == DEFAULT_MEMORY_LIMIT
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "4G")
    assert memory_limit_bytes() == 4 << 30
    assert memory_limit_bytes(7) == 7


@pytest.mark.parametrize(
    ("text", "size"), [("10", 10), ("2k", 2048), ("1.5M", 3 << 19), ("4 GiB", 4 << 30), ("1TB", 1 << 40)]
)
def test_sizes_in_words_are_read(text, size):
    """Sizes take a number and a unit in powers of 1024."""
    assert parse_size(text) == size


@pytest.mark.parametrize("text", ["", "four", "-1G", "0", "3X"])
def test_sizes_that_mean_nothing_are_refused(monkeypatch, text):
    """Text that is no positive size is refused with an example of one."""
    with pytest.raises(ParameterError, match="such as 500M or 4G"):
        parse_size(text)
    if text:
        monkeypatch.setenv("SPEM_MEMORY_LIMIT", text)
        with pytest.raises(ParameterError, match="SPEM_MEMORY_LIMIT="):
            memory_limit_bytes()


def test_limits_that_are_not_positive_are_refused():
    """A limit of zero bytes is a mistake."""
    with pytest.raises(ParameterError, match=r"memory_limit=0: expected a positive"):
        memory_limit_bytes(0)


def test_grids_over_the_limit_are_refused_and_others_are_not():
    """The message names the size, the need, the limit and the way out."""
    check_size((100, 100), 8, 80_000, "small")
    with pytest.raises(
        SizeError, match=r"big: 100 x 101 cells need 78.9 KiB, the limit is 78.1 KiB; .*memory_limit"
    ):
        check_size((100, 101), 8, 80_000, "big")


def test_sizes_are_written_in_the_largest_unit():
    """Sizes read as people say them."""
    assert [format_size(n) for n in (12, 2048, 3 << 20, 5 << 30, 7 << 40)] == [
        "12 bytes",
        "2 KiB",
        "3 MiB",
        "5 GiB",
        "7 TiB",
    ]


def test_paths_that_hold_nothing_are_refused(tmp_path):
    """Missing and empty files and folders are told apart."""
    with pytest.raises(ReadError, match=r"absent.png: no such file; check the path"):
        check_file(tmp_path / "absent.png")
    with pytest.raises(ReadError, match="is a folder, expected a file"):
        check_file(tmp_path)
    empty = tmp_path / "empty.png"
    empty.touch()
    with pytest.raises(ReadError, match=r"empty.png: the file is empty \(0 bytes\)"):
        check_file(empty)
