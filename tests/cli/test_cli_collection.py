"""encode, demo: exit statuses, files, resumption after Ctrl-C and kill -9."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from spem.codes.codes import Codes
from spem.index.index import Index

Spem = Callable[..., Result]
Start = Callable[..., subprocess.Popen[str]]

N_MANY = 80
QUICK = ("--own-grid", "--features", "spem", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")


def ellipse(a: float, b: float, half: int = 18) -> np.ndarray:
    """Return the mask of an ellipse with semi-axes `a` and `b`."""
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    return (x / a) ** 2 + (y / b) ** 2 < 1


def test_encode_writes_codes(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """All shapes of a folder get codes; what is told as JSON is what is in the file."""
    target = tmp_path / "deep" / "codes.spem"
    result = spem("encode", folder, "-o", target, *QUICK, "--json", "--seed", "3")
    assert result.exit_code == 0, result.stderr
    facts, codes = json.loads(result.stdout), Codes.load(target)
    assert (facts["n_shapes"], facts["n_failed"]) == (9, 0)
    assert facts["model"] == codes.model.digest
    assert (codes.model.settings.seed, codes.model.settings.voxels) == (3, None)
    assert not target.with_name("codes.spem.work").exists()


def test_encode_by_a_signature(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """The kind of features is kept with the codes; a setting of another kind is refused before any work."""
    target = tmp_path / "waves.spem"
    options = ("--own-grid", "--features", "wks", "--n-maps", "5", "--n-pairs", "20", "--n-centers", "4")
    assert spem("encode", folder, "-o", target, *options).exit_code == 0
    settings = Codes.load(target).model.settings
    assert (settings.features, settings.n_pairs, settings.n_maps) == ("wks", 20, 5)
    answers = json.loads(spem("search", target, folder / "long1.npy", "-k", "3", "--json").stdout)
    assert {answer["name"][:4] for answer in answers} == {"long"}
    result = spem("encode", folder, "-o", tmp_path / "c.spem", "--features", "si-hks", "--n-rho", "9")
    assert result.exit_code == 2
    assert "n_rho: a setting of features 'spem', not of 'si-hks'; leave it" in result.stderr
    assert not (tmp_path / "c.spem").exists()


def test_encode_tells_failures_and_saves_the_rest(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """One line a failed file, exit status 1, codes of the others."""
    (folder / "broken.npy").write_bytes(b"")
    result = spem("encode", folder, "-o", tmp_path / "c.spem", *QUICK)
    assert result.exit_code == 1
    assert len(result.stderr.strip().splitlines()) == 1
    assert "broken.npy" in result.stderr
    assert len(Codes.load(tmp_path / "c.spem")) == 9


def test_encode_of_nothing_readable(spem: Spem, tmp_path: Path) -> None:
    """When no file gives a shape nothing is written, exit status 2."""
    (tmp_path / "broken.npy").write_bytes(b"")
    result = spem("encode", tmp_path / "broken.npy", "-o", tmp_path / "c.spem")
    assert result.exit_code == 2
    assert "no shape could be read" in result.stderr
    assert not (tmp_path / "c.spem").exists()


def test_encode_adds_to_codes(spem: Spem, folder: Path, codes: Path) -> None:
    """New files join codes that are there, with their vocabulary; old rows stay as they are."""
    before = Codes.load(codes)
    np.save(folder.parent / "extra.npy", ellipse(6, 12))
    result = spem("encode", folder.parent / "extra.npy", "-o", codes)
    assert result.exit_code == 0, result.stderr
    after = Codes.load(codes)
    assert after.names == (*before.names, "extra")
    assert after.model.digest == before.model.digest
    np.testing.assert_array_equal(after.vectors[:-1], before.vectors)


def test_files_that_are_gone_are_told_and_pruned(spem: Spem, folder: Path, codes: Path) -> None:
    """A file that was deleted keeps its code until --prune; the rest and its order stay."""
    names = Codes.load(codes).names
    (folder / "long1.npy").unlink()
    told = spem("encode", folder, "-o", codes)
    assert f"1 shape of {codes} is no longer in {folder}; --prune removes it" in told.stderr
    assert set(Codes.load(codes).names) == set(names)
    pruned = spem("encode", folder, "-o", codes, "--prune")
    assert pruned.exit_code == 0, pruned.stderr
    assert set(Codes.load(codes).names) == set(names) - {"long1"}


def test_links_that_lead_nowhere_and_hidden_files(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """A dangling link is a failure; hidden files are left out, and counted."""
    (folder / "lost.npy").symlink_to(folder / "nowhere.npy")
    np.save(folder / ".hidden.npy", ellipse(5, 9))
    result = spem("encode", folder, "-o", tmp_path / "c.spem", *QUICK)
    assert result.exit_code == 1
    first, second = result.stderr.splitlines()
    assert first == "spem: 1 hidden file left out; give such files by name"
    assert second.endswith("lost.npy: no such file; check the path")


def test_no_folder_is_left_of_nothing(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """Wrong settings, and files of which none can be read, leave neither a folder nor work."""
    before = set(tmp_path.rglob("*"))
    assert spem("encode", folder, "-o", tmp_path / "new" / "c.spem", "--power", "3").exit_code == 2
    (tmp_path / "empty.npy").write_bytes(b"")
    assert spem("encode", tmp_path / "empty.npy", "-o", tmp_path / "c.spem").exit_code == 2
    assert set(tmp_path.rglob("*")) == before | {tmp_path / "empty.npy"}


def test_work_survives_codes_that_cannot_be_saved(
    spem: Spem, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When saving fails the work is kept, and the same command computes no field again."""
    from spem.codes import collection

    target, work = tmp_path / "c.spem", tmp_path / "c.spem.work"
    assert spem("encode", folder, "-o", target, *QUICK, "--n-rho", 12).exit_code == 0
    with monkeypatch.context() as patch:
        patch.setattr(Codes, "save", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
        result = spem("encode", folder, "-o", target, *QUICK, "--overwrite")
    assert result.exit_code == 2
    assert "No space left" in result.stderr
    assert len(list(work.rglob("*.work"))) == 9
    monkeypatch.setattr(collection, "shape_features", lambda *_, **__: pytest.fail("computed again"))
    again = spem("encode", folder, "-o", target, *QUICK, "--overwrite")
    assert again.exit_code == 0, again.stderr
    assert not work.exists()


def test_encode_refuses_other_settings_for_codes_there(spem: Spem, folder: Path, codes: Path) -> None:
    """Settings that contradict the codes are named; --overwrite makes them anew."""
    result = spem("encode", folder, "-o", codes, "--n-maps", "2")
    assert result.exit_code == 2
    assert "n_maps=2" in result.stderr
    done = spem("encode", folder, "-o", codes, "--overwrite", *QUICK, "--n-maps", "2")
    assert done.exit_code == 0, done.stderr
    assert Codes.load(codes).model.settings.n_maps == 2


def test_vocabulary_is_saved_and_reused(spem: Spem, folder: Path, codes: Path, tmp_path: Path) -> None:
    """A model file and the codes it came with give the same codes."""
    first, second, model = tmp_path / "a.spem", tmp_path / "b.spem", tmp_path / "model.spem"
    assert (
        spem("encode", folder, "-o", first, "--vocabulary", codes, "--save-vocabulary", model).exit_code == 0
    )
    assert spem("encode", folder, "-o", second, "--vocabulary", model).exit_code == 0
    np.testing.assert_array_equal(Codes.load(second).vectors, Codes.load(codes).vectors)


def test_interruption_of_saving_is_told_as_any(
    spem: Spem, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while the codes are saved keeps the work and says how to go on."""
    monkeypatch.setattr(Codes, "save", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    result = spem("encode", folder, "-o", tmp_path / "c.spem", *QUICK)
    assert result.exit_code == 130
    assert "give the same command again to go on" in result.stderr
    assert len(list((tmp_path / "c.spem.work").rglob("*.work"))) == 9


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--rho-range", "3"), "LOW:HIGH"),
        (("--rho-range", "0.3:0.1"), "LOW < HIGH"),
        (("--vocabulary", "none.spem"), "none.spem"),
        (("--power", "3"), "power=3"),
        (("--device", "cuda"), "cuda"),
        (("--own-grid", "--voxels", "500"), "--own-grid and --voxels 500 exclude each other"),
    ],
)
def test_encode_refuses_bad_options(spem: Spem, folder: Path, options: tuple[str, str], word: str) -> None:
    """Options out of range are named."""
    result = spem("encode", folder, "-o", folder / "c.spem", *options)
    assert result.exit_code == 2
    assert word in result.stderr


def test_paper_is_refused_beside_a_model(spem: Spem, folder: Path, codes: Path, tmp_path: Path) -> None:
    """--paper cannot change the settings of codes that are there, nor of a vocabulary."""
    for options in (("-o", codes), ("-o", tmp_path / "new.spem", "--vocabulary", codes)):
        result = spem("encode", folder, *options, "--paper")
        assert result.exit_code == 2
        assert f"--paper: {codes} has settings of its own" in result.stderr


def test_failures_told_are_those_of_the_run(spem: Spem, folder: Path, codes: Path) -> None:
    """Adding files tells the failures of those files, in number and by name; the codes keep all."""
    (folder / "old.npy").write_bytes(b"")
    first = spem("encode", folder, "-o", codes, "--json")
    assert [Path(each["path"]).name for each in json.loads(first.stdout)["failures"]] == ["old.npy"]
    np.save(folder.parent / "extra.npy", ellipse(6, 12))
    facts = json.loads(spem("encode", folder.parent / "extra.npy", "-o", codes, "--json").stdout)
    assert (facts["n_failed"], facts["failures"], facts["n_shapes"]) == (0, [], 10)
    assert [Path(each.path).name for each in Codes.load(codes).failures] == ["old.npy"]


def _many(tmp_path: Path) -> Path:
    """Write shapes that take a few seconds to encode."""
    shapes = tmp_path / "many"
    shapes.mkdir()
    for i in range(N_MANY):
        np.save(shapes / f"s{i:02d}.npy", ellipse(60 + i, 150 - i / 2, 155))
    return shapes


def _wait_for(work: Path, count: int, process: subprocess.Popen[str]) -> None:
    """Wait until so many shapes are done."""
    deadline = time.monotonic() + 60
    while len(list(work.rglob("[0-9a-f]*.work"))) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_stopped_encode_goes_on(start: Start, spem: Spem, tmp_path: Path) -> None:
    """After kill -9 and after Ctrl-C the same command goes on; the codes are those of one run."""
    shapes = _many(tmp_path)
    target, work = tmp_path / "c.spem", tmp_path / "c.spem.work"
    options = ("--features", "spem", "--n-maps", 3, "--n-centers", 4, "--voxels", 9000, "-j", 2)
    with start("encode", shapes, "-o", target, *options) as first:
        _wait_for(work, 5, first)
        os.kill(first.pid, signal.SIGKILL)
        first.communicate(timeout=60)
    done = len(list(work.rglob("[0-9a-f]*.work")))
    assert 5 <= done < N_MANY
    with start("encode", shapes, "-o", target, *options) as second:
        _wait_for(work, done + 5, second)
        os.killpg(second.pid, signal.SIGINT)
        _, said = second.communicate(timeout=60)
    assert second.returncode == 130
    assert "done already; going on" in said
    assert "give the same command again" in said
    assert len(said.strip().splitlines()) == 2, said
    third = spem("encode", shapes, "-o", target, *options[:-1], 1)
    assert third.exit_code == 0, third.stderr
    assert done + 5 <= int(third.stderr.split()[1]) < N_MANY
    assert not work.exists()
    assert spem("encode", shapes, "-o", tmp_path / "whole.spem", *options[:-1], 1).exit_code == 0
    np.testing.assert_array_equal(Codes.load(target).vectors, Codes.load(tmp_path / "whole.spem").vectors)


def test_demo(spem: Spem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`demo` leaves collections, codes, pictures, reports and an index, and says how to see them."""
    monkeypatch.setattr("spem.cli.demo.CREATURES_PER_CLASS", 2)
    monkeypatch.setattr("spem.cli.demo.VOXELS", 1500)
    monkeypatch.setattr("spem.cli.demo.KINDS", ("fish", "starfish"))
    result = spem("demo", tmp_path / "d")
    assert result.exit_code == 0, result.output
    for name in ("images.spem", "meshes.spem", "images-maps.png", "meshes-fields.png"):
        assert (tmp_path / "d" / name).stat().st_size > 1000
    for name in ("images-parts.png", "meshes-parts.png", "meshes-parts.html", "meshes-report.html"):
        assert name in result.stdout
        assert (tmp_path / "d" / name).stat().st_size > 1000
    assert result.stdout.splitlines()[-1].strip() == f"spem serve {tmp_path / 'd' / 'index'} --open"
    assert len(Index.open(tmp_path / "d" / "index")) == 8


def test_demo_without_the_index(spem: Spem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the packages of the index are not installed, `demo` does the rest, and says what is missing."""
    monkeypatch.setattr("spem.cli.demo.CREATURES_PER_CLASS", 2)
    monkeypatch.setattr("spem.cli.demo.VOXELS", 1000)
    monkeypatch.setattr("spem.cli.demo.KINDS", ("fish",))
    monkeypatch.setitem(sys.modules, "lancedb", None)
    result = spem("demo", tmp_path / "d")
    assert result.exit_code == 0, result.output
    assert "pip install 'spem[" in result.stderr
    assert not (tmp_path / "d" / "index").exists()
