"""``spem paper``: what there is, what it writes, what it refuses."""

from __future__ import annotations

import json
import os
import signal
import time

import pytest

from spem.paper.catalogue import ITEMS, Item
from spem.paper.findings import Finding


@pytest.fixture(autouse=True)
def _no_real_shapes(monkeypatch):
    monkeypatch.delenv("SPEM_DATA", raising=False)


def test_without_items_they_are_listed(spem):
    """One line each, or JSON."""
    lines = spem("paper").stdout.splitlines()
    assert len(lines) == len(ITEMS) + 1
    listed = json.loads(spem("paper", "--json").stdout)
    assert [row["item"] for row in listed] == [item.name for item in ITEMS]


def test_an_item_gives_pictures_numbers_and_a_report(spem, tmp_path):
    """Each statement has a line; a second call keeps what is there."""
    call = ("paper", "fig1", "fig4", "--quick", "-o", tmp_path / "out")
    result = spem(*call)
    assert result.exit_code == 0
    assert "  holds: " in result.stdout
    assert (tmp_path / "out" / "index.html").is_file()
    for name in ("fig1", "fig4"):
        assert list((tmp_path / "out" / name).glob("*.png"))
        assert json.loads((tmp_path / "out" / name / "finding.json").read_text())["made"]["quick"] is True
    again = spem(*call)
    assert again.stdout.count("(kept)") == 2


def test_json_has_every_statement(spem, tmp_path):
    """And nothing else on stdout."""
    (record,) = json.loads(spem("paper", "fig1", "--quick", "--json", "-o", tmp_path).stdout)
    assert record["item"] == "fig1"
    assert {claim["verdict"] for claim in record["claims"]} == {"holds"}


def test_absent_collections_are_told_in_the_report(spem, tmp_path):
    """With what to do; the statements about them are not tested."""
    result = spem("paper", "fig19", "--quick", "-o", tmp_path)
    assert result.exit_code == 0
    assert "not tested" in result.stdout
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Absent collections" in page
    assert "put it into DIR/shrec11 and give --data DIR" in page


@pytest.mark.parametrize("name", ["fig21", "tabel1", "All"])
def test_unknown_items_are_refused(spem, refused, tmp_path, name):
    """Before anything is made."""
    refused(spem("paper", "fig1", name, "-o", tmp_path / "out"), f"{name}: no such item of the paper")
    assert not (tmp_path / "out").exists()


def test_folders_that_cannot_be_used_are_refused(spem, refused, tmp_path):
    """That of the data, and that of the results."""
    refused(spem("paper", "fig1", "--data", tmp_path / "none"), "none: no such folder")
    (tmp_path / "file").write_text("")
    refused(spem("paper", "fig1", "--quick", "-o", tmp_path / "file"), "file")


def test_a_wrong_spem_data_is_told(spem, tmp_path, monkeypatch):
    """And does not stop the run."""
    monkeypatch.setenv("SPEM_DATA", str(tmp_path / "none"))
    result = spem("paper", "fig1", "--quick", "-o", tmp_path)
    assert result.exit_code == 0
    assert result.stderr.startswith("spem: SPEM_DATA: ")


def test_a_folder_without_a_collection_is_told(spem, tmp_path):
    """The run goes on with shapes made here."""
    result = spem("paper", "fig4", "--quick", "--data", tmp_path, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert f"{tmp_path}: holds none of tari1000, shrec11, …; going on with shapes made here" in result.stderr


def test_an_interrupted_run_says_how_to_go_on(start, tmp_path):
    """One line, status 130; what was made is there."""
    process = start("paper", "fig1", "table1", "ingredients", "ablation", "--quick", "-o", tmp_path)
    limit = time.monotonic() + 60
    while not (tmp_path / "fig1" / "finding.json").exists() and time.monotonic() < limit:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.strip().splitlines()[-1].startswith("spem: interrupted; what is made is kept in")
    assert (tmp_path / "fig1" / "finding.json").is_file()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_while_an_object_is_freed_is_not_lost(spem, tmp_path, monkeypatch):
    """The interpreter drops what is raised there; the run ends after the item."""

    class Freed:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def make(item, data):
        Freed()
        return Finding("none")

    monkeypatch.setattr(Item, "make", make)
    before = signal.getsignal(signal.SIGINT)
    result = spem("paper", "fig1", "fig4", "-o", tmp_path)
    assert result.exit_code == 130
    assert (tmp_path / "fig1" / "finding.json").is_file()
    assert not (tmp_path / "fig4").exists()
    assert signal.getsignal(signal.SIGINT) is before
