"""Codes of collections: the same whatever the order, the workers or an interruption; failures as values."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spem.codes import collection
from spem.codes.codes import Codes
from spem.codes.collection import encode_collection, encode_file, merge
from spem.codes.settings import Settings
from spem.codes.sources import find_files, read_shapes, source_name
from spem.codes.work import Entry, clear_work
from spem.codes.workers import run_all
from spem.errors import ModelError, ParameterError, ReadError, ShapeError
from spem.shapes.shape import Shape

SETTINGS = Settings(features="spem", voxels=None, n_maps=3, n_centers=4, n_rho=16, nodes_per_shape=60)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of six ellipses and one text file."""
    shapes = tmp_path / "shapes"
    shapes.mkdir()
    y, x = np.mgrid[-15:16, -15:16]
    for i in range(6):
        np.save(shapes / f"e{i}.npy", (x / (5 + i)) ** 2 + (y / (13 - i)) ** 2 < 1)
    (shapes / "notes.txt").write_text("not a shape")
    return shapes


def test_order_and_workers_change_nothing(folder: Path) -> None:
    """Files in any order and any number of processes give the same model and the same code each."""
    files = find_files([folder])
    first = encode_collection(files, SETTINGS)
    second = encode_collection(files[::-1], SETTINGS, n_jobs=2)
    assert first.model.digest == second.model.digest
    np.testing.assert_array_equal(first.vectors, second.vectors[::-1])


@pytest.mark.parametrize(("n_jobs", "threads"), [(1, None), (2, 1)])
def test_several_processes_have_one_thread_each(
    folder: Path, monkeypatch: pytest.MonkeyPatch, n_jobs: int, threads: int | None
) -> None:
    """A sweep may take all cores only where it is alone."""
    tasks, true = [], collection.run_all
    monkeypatch.setattr(collection, "run_all", lambda task, *a: (tasks.append(task), true(task, *a))[1])
    encode_collection(find_files([folder])[:2], SETTINGS, n_jobs=n_jobs)
    assert [task.threads for task in tasks] == [threads]


def test_file_by_itself_has_its_code_of_the_collection(folder: Path) -> None:
    """`encode_file` with the model of a collection gives the row of the collection."""
    codes = encode_collection(find_files([folder]), SETTINGS)
    np.testing.assert_array_equal(encode_file(codes.paths[3], codes.model), codes.vectors[3])


def test_shapes_in_memory_have_the_codes_of_their_files(folder: Path) -> None:
    """Shapes given as objects are coded as the files that they were read from."""
    files = find_files([folder])
    shapes = [shape for file in files for _, shape in read_shapes(file, SETTINGS) if isinstance(shape, Shape)]
    codes = encode_collection(files, SETTINGS)
    again = encode_collection(shapes, SETTINGS, model=codes.model)
    np.testing.assert_array_equal(again.vectors, codes.vectors)


def test_failures_are_collected_and_the_rest_is_coded(folder: Path) -> None:
    """A missing, an empty and a blank file are failures with reasons; others get codes."""
    (folder / "empty.npy").write_bytes(b"")
    np.save(folder / "blank.npy", np.zeros((5, 5), bool))
    files = [*find_files([folder]), folder / "gone.npy"]
    heard = []
    codes = encode_collection(files, SETTINGS, on_failure=heard.append)
    assert len(codes) == 6
    assert {Path(failure.path).name for failure in codes.failures} == {"empty.npy", "blank.npy", "gone.npy"}
    assert list(codes.failures) == heard


def test_unexpected_exception_is_one_failure(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that nobody foresaw costs one shape, and the reason names its type."""
    true, number = collection.shape_features, itertools.count()

    def fragile(shape: Shape, settings: Settings, threads: int | None) -> object:
        if next(number) == 2:
            message = "two\nlines"
            raise ZeroDivisionError(message)
        return true(shape, settings, threads)

    monkeypatch.setattr(collection, "shape_features", fragile)
    codes = encode_collection(find_files([folder]), SETTINGS)
    assert len(codes) == 5
    assert codes.failures[0].reason == "unexpected ZeroDivisionError: two lines; please report it"


def test_nothing_to_code_is_an_error(tmp_path: Path) -> None:
    """A collection without one readable shape is refused."""
    (tmp_path / "a.npy").write_bytes(b"")
    message = r"no shape could be read.*: .*b\.npy: no such file; check the path \(and 1 more\)$"
    with pytest.raises(ReadError, match=message) as caught:
        encode_collection([tmp_path / "a.npy", tmp_path / "b.npy"], SETTINGS)
    assert [Path(failure.path).name for failure in caught.value.failures] == ["b.npy", "a.npy"]
    with pytest.raises(ParameterError, match="no sources were given"):
        encode_collection([], SETTINGS)


def test_volume_whose_labels_all_fail_tells_why(tmp_path: Path) -> None:
    """When every label of the only volume fails, the error has the reason of the first."""
    np.save(tmp_path / "teeth.npy", np.diag([2, 0, 5, 0])[:, :, None] * np.ones(3, int))
    with pytest.raises(ReadError, match=r"no codes: .*teeth\.npy: 2: .*next to the boundary"):
        encode_collection([tmp_path / "teeth.npy"], replace(SETTINGS, drop_boundary=True))


def test_merge_knows_a_file_by_its_place(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Relative, absolute and indirect paths are of one file; a link to it is another."""
    (folder / "link.npy").symlink_to(folder / "e0.npy")
    known = encode_collection([folder / "e0.npy", folder / "e1.npy", folder / "link.npy"], SETTINGS)
    monkeypatch.chdir(folder)
    again = merge(known, encode_collection(["e0.npy", "../shapes/e1.npy"], model=known.model))
    assert again.paths == (str(folder / "link.npy"), "e0.npy", "../shapes/e1.npy")


def test_interrupted_call_goes_on(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was done before an interruption is not done again, and the outcome is that of one run."""
    files, work = find_files([folder]), tmp_path / "codes.work"
    whole = encode_collection(files, SETTINGS)
    true, calls = collection.shape_features, []

    def counted(shape: Shape, settings: Settings, threads: int | None) -> object:
        calls.append(shape.name)
        if len(calls) == 4:
            message = "stopped"
            raise KeyboardInterrupt(message)
        return true(shape, settings, threads)

    monkeypatch.setattr(collection, "shape_features", counted)
    with pytest.raises(KeyboardInterrupt, match="stopped"):
        encode_collection(files, SETTINGS, work=work)
    assert work.is_dir()
    codes = encode_collection(files, SETTINGS, work=work)
    assert len(calls) == 4 + 3
    encode_collection(files, SETTINGS, work=work)
    assert len(calls) == 4 + 3
    np.testing.assert_array_equal(codes.vectors, whole.vectors)


def test_damaged_work_is_done_again(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A truncated file of the work folder is replaced, not believed."""
    files, work = find_files([folder]), tmp_path / "codes.work"
    with monkeypatch.context() as patch:
        patch.setattr(collection, "_fit", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt("stopped")))
        with pytest.raises(KeyboardInterrupt, match="stopped"):
            encode_collection(files, SETTINGS, work=work)
    done = sorted(work.rglob("*.work"))
    done[0].write_bytes(done[0].read_bytes()[:200])
    codes = encode_collection(files, SETTINGS, work=work)
    np.testing.assert_array_equal(codes.vectors, encode_collection(files, SETTINGS).vectors)


def test_other_settings_do_not_share_work(folder: Path, tmp_path: Path) -> None:
    """Work is kept apart by the settings that features depend on."""
    one = collection.Work.open(tmp_path, SETTINGS)
    assert one == collection.Work.open(tmp_path, Settings(**(SETTINGS.to_json() | {"seed": 5})))
    assert one != collection.Work.open(tmp_path, Settings(**(SETTINGS.to_json() | {"n_rho": 17})))


def test_work_is_cleared_and_nothing_else(tmp_path: Path) -> None:
    """Work of all settings and torn files go; what somebody else put there stays, with its folders."""
    root = tmp_path / "mine"
    one = collection.Work.open(root, SETTINGS)
    two = collection.Work.open(root, Settings(features="spem"))
    for work in (one, two):
        work.save("ab", [Entry("")])
        (work.folder / ".cd.work.0123").write_bytes(b"torn")
    (root / "notes").mkdir()
    (root / "notes" / "a.work").write_text("mine")
    (two.folder / "mine.txt").write_text("mine")
    clear_work(root)
    left = {path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file()}
    assert left == {"notes/a.work", f"{two.folder.name}/mine.txt"}
    assert not one.folder.exists()
    clear_work(tmp_path / "none")


def test_known_codes_are_taken_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Adding files computes the new ones only, with the vocabulary that is there."""
    files = find_files([folder])
    known = encode_collection(files[:4], SETTINGS)
    calls = []
    true = collection.shape_features
    monkeypatch.setattr(collection, "shape_features", lambda *a: (calls.append(1), true(*a))[1])
    codes = encode_collection(files, known=known)
    assert len(calls) == 2
    np.testing.assert_array_equal(codes.vectors[:4], known.vectors)
    assert codes.model.digest == known.model.digest
    assert merge(known, codes).names == codes.names


def test_equal_files_are_computed_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy of a file gets the code of the first without being computed."""
    (folder / "copy.npy").write_bytes((folder / "e0.npy").read_bytes())
    calls = []
    true = collection.shape_features
    monkeypatch.setattr(collection, "shape_features", lambda *a: (calls.append(1), true(*a))[1])
    codes = encode_collection(find_files([folder]), SETTINGS)
    assert (len(codes), len(calls)) == (7, 6)
    np.testing.assert_array_equal(codes.vectors[0], codes.vectors[codes.names.index("e0")])


def test_label_volume_gives_a_shape_a_label(tmp_path: Path) -> None:
    """Every label of a volume has a row under its own name, also when it is reused."""
    labels = np.zeros((12, 12, 12), int)
    labels[1:6, 1:6, 1:6], labels[7:11, 2:9, 3:9] = 2, 5
    np.save(tmp_path / "teeth.npy", labels)
    codes = encode_collection([tmp_path / "teeth.npy"], SETTINGS)
    assert codes.names == ("teeth-2", "teeth-5")
    assert encode_collection([tmp_path / "teeth.npy"], known=codes).names == codes.names
    with pytest.raises(ShapeError, match="holds 2 labels"):
        encode_file(tmp_path / "teeth.npy", codes.model)


def test_other_dimensions_are_failures(folder: Path, tmp_path: Path) -> None:
    """The commonest dimension of a collection is that of its model; a stray shape of another one fails."""
    np.save(folder / "a_ball.npy", np.ones((9, 9, 9), bool))
    codes = encode_collection(find_files([folder]), SETTINGS)
    [failure] = codes.failures
    assert (failure.path, codes.model.ndim, len(codes)) == (str(folder / "a_ball.npy"), 2, 6)
    assert failure.reason == "a 3-D shape among 2-D ones, which are more; encode them apart"
    codes.save(tmp_path / "c.spem")
    model = Codes.load(tmp_path / "c.spem").model
    assert (model.ndim, model.digest) == (2, codes.model.digest)
    with pytest.raises(ModelError, match=r"a_ball\.npy: a 3-D shape, but the vocabulary is of 2-D ones"):
        encode_file(folder / "a_ball.npy", model)
    with pytest.raises(ReadError, match="a 3-D shape, but the vocabulary is of 2-D ones"):
        encode_collection([folder / "a_ball.npy"], model=model)


def test_model_of_other_settings_is_refused(folder: Path) -> None:
    """Settings that contradict the model are named."""
    codes = encode_collection(find_files([folder]), SETTINGS)
    with pytest.raises(ModelError, match="n_maps 8 against 3"):
        encode_collection(find_files([folder]), Settings(features="spem"), model=codes.model)


def test_codes_survive_their_file(folder: Path, tmp_path: Path) -> None:
    """Codes of a collection are read back as they were."""
    codes = encode_collection(find_files([folder]), SETTINGS)
    codes.save(tmp_path / "c.spem")
    again = Codes.load(tmp_path / "c.spem")
    assert (again.names, again.paths, again.model.digest) == (codes.names, codes.paths, codes.model.digest)


def test_find_files_knows_folders_patterns_and_files(folder: Path) -> None:
    """Folders give known kinds only, patterns what fits, files themselves, each once."""
    assert [p.name for p in find_files([folder])] == [f"e{i}.npy" for i in range(6)]
    assert [p.name for p in find_files([folder / "e[12].npy", folder / "e1.npy"])] == ["e1.npy", "e2.npy"]
    assert find_files([folder / "notes.txt"]) == [folder / "notes.txt"]


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("*.obj", "no file fits this pattern; give a folder, or a pattern of files"),
        (".", "no shape in this folder"),
        ("f*", "only folders fit this pattern; give one, or a pattern"),
    ],
)
def test_find_files_refuses_what_leads_to_nothing(tmp_path: Path, path: str, message: str) -> None:
    """A pattern or folder without a shape is an error that says so."""
    (tmp_path / "folder").mkdir()
    with pytest.raises(ReadError, match=message):
        find_files([tmp_path / path])


def test_names_lose_double_endings() -> None:
    """Compressed NIfTI files are named without both endings."""
    assert source_name(Path("a/b.nii.gz")) == "b"


def test_jobs_are_at_least_one() -> None:
    """No processes is refused."""
    with pytest.raises(ParameterError, match="n_jobs=0"):
        list(run_all(int, ["1"], 0))


def _die(task: int) -> int:
    """End the process on one task, as a crash of a library does."""
    import os

    if task == 1:
        os._exit(9)
    return task


def test_worker_that_dies_costs_its_task_only() -> None:
    """A crash in a worker process is a failure of its task; all others are done."""
    outcomes = {task: (result, reason) for task, result, reason in run_all(_die, range(3), 2)}
    assert outcomes[1] == (None, "its process died, perhaps for want of memory")
    assert all(outcomes[task] == (task, "") for task in (0, 2))


def test_volumes_are_kept_in_the_unit_of_the_file(tmp_path):
    """Codes know the volume of each object of a segmentation, also after they are saved and joined."""
    seg = np.zeros((30, 30), np.int16)
    seg[2:12, 2:12], seg[16:20, 4:24] = 3, 8
    np.savez(tmp_path / "seg.npz", labels=seg, spacing=[0.5, 2.0])
    settings = Settings(features="spem", voxels=None, n_maps=2, n_centers=4, per_label=True)
    codes = encode_collection([tmp_path / "seg.npz"], settings)
    assert codes.names == ("seg-3", "seg-8")
    np.testing.assert_allclose(codes.volumes, [100.0, 80.0])
    codes.save(tmp_path / "codes.spem")
    again = Codes.load(tmp_path / "codes.spem")
    np.testing.assert_allclose(again.take([1]).join(again.take([0])).volumes, [80.0, 100.0])
    reused = encode_collection([tmp_path / "seg.npz"], known=again)
    np.testing.assert_allclose(reused.volumes, codes.volumes)
    whole = Settings(features="spem", voxels=None, n_maps=2, n_centers=4, per_label=False)
    assert encode_collection([tmp_path / "seg.npz"], whole).names == ("seg",)


def test_workers_follow_the_working_directory(tmp_path, monkeypatch):
    """Relative paths start from where the caller is, also for workers that an earlier call has left."""
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        for i in range(3):
            np.save(folder / f"{name}{i}.npy", np.ones((9 + i, 9)))
        monkeypatch.chdir(folder)
        files = [Path(f"{name}{i}.npy") for i in range(3)]
        settings = Settings(features="spem", voxels=None, n_maps=2, n_centers=4)
        assert len(encode_collection(files, settings, n_jobs=2)) == 3
