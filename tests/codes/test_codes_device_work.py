"""Collections on a device: the codes, failures and work folder of those without one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from backends import DEVICES, use_device

import spem
from spem.codes import device_work, drafts
from spem.codes.codes import Codes
from spem.codes.collection import encode_collection, encode_file
from spem.codes.drafts import draft_shapes, load_drafts, save_drafts
from spem.codes.settings import Settings
from spem.codes.sources import find_files
from spem.codes.work import Work, clear_work
from spem.codes.workers import run_all
from spem.errors import ReadError, SizeError
from spem.fields.solvers.host import Host
from spem.shapes.shape import Shape

SETTINGS = Settings(features="spem", voxels=None, n_maps=3, n_centers=4, n_rho=16, nodes_per_shape=60)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of four ellipses."""
    shapes = tmp_path_factory.mktemp("shapes")
    y, x = np.mgrid[-11:12, -11:12]
    for i in range(4):
        np.save(shapes / f"e{i}.npy", (x / (4 + i)) ** 2 + (y / (10 - i)) ** 2 < 1)
    return shapes


@pytest.fixture(scope="module")
def whole(folder: Path) -> Codes:
    """Return the codes of the folder, made without a device."""
    return encode_collection(find_files([folder]), SETTINGS)


@dataclass(frozen=True)
class Broken:
    """A device that must not be used, or that has no room for anything."""

    error: type[BaseException] = KeyboardInterrupt

    def open(self, *_: Any) -> Any:
        """Fail."""
        message = "900 nodes do not fit on this device"
        raise self.error(message)


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_collection_with_a_device_is_that_without(folder: Path, whole: Codes, n_jobs: int) -> None:
    """Model and codes are the same, bit by bit, where the device computes as the host does."""
    codes = encode_collection(find_files([folder]), SETTINGS, n_jobs=n_jobs, device=Host())
    assert codes.model.digest == whole.model.digest
    np.testing.assert_array_equal(codes.vectors, whole.vectors)
    np.testing.assert_array_equal(codes.volumes, whole.volumes)
    assert (codes.names, codes.hashes) == (whole.names, whole.hashes)


@pytest.mark.parametrize("device", DEVICES)
def test_collection_on_a_device_has_the_codes_of_the_host(device: str, folder: Path) -> None:
    """With a given model a device makes the codes of the host to 1e-4."""
    settings = Settings.paper(voxels=None, n_maps=3, n_centers=4)
    files = find_files([folder])
    known = encode_collection(files, settings)
    codes = spem.encode(files, model=known.model, device=use_device(device))
    assert np.linalg.norm(codes.vectors - known.vectors, axis=1).max() < 1e-4
    answer = spem.search(codes, files[2], device=use_device(device))
    assert answer[0].name == "e2"


def test_other_kinds_are_made_by_workers(folder: Path) -> None:
    """Joined codes have all kinds; settings without SPEM maps need no device at all."""
    files = find_files([folder])
    joined = Settings(features="spem+sources", voxels=None, n_centers=4)
    for settings, device in ((joined, Host()), (replace(joined, features="sources"), Broken())):
        expected = encode_collection(files, settings)
        found = encode_collection(files, settings, device=device)
        np.testing.assert_array_equal(found.vectors, expected.vectors)
        again = encode_collection(files, model=expected.model, device=device)
        np.testing.assert_array_equal(again.vectors, expected.vectors)


def test_file_by_itself_has_its_code_of_the_collection(folder: Path, whole: Codes) -> None:
    """`encode_file` with a device gives the row of the collection."""
    code = encode_file(whole.paths[1], whole.model, device=Host())
    np.testing.assert_array_equal(code, whole.vectors[1])
    with pytest.raises(SizeError, match="do not fit on this device"):
        encode_file(whole.paths[1], whole.model, device=Broken(SizeError))


def test_interrupted_on_the_device_goes_on_without_reading_again(
    folder: Path, whole: Codes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shapes that workers have read wait in the work folder for the next call, which leaves none behind."""
    files, work = find_files([folder]), tmp_path / "work"
    with pytest.raises(KeyboardInterrupt):
        encode_collection(files, SETTINGS, work=work, device=Broken())
    assert len(list(work.rglob("*.draft.work"))) == 4
    with monkeypatch.context() as patch:
        patch.setattr(drafts, "read_shapes", lambda *_: pytest.fail("read again"))
        codes = encode_collection(files, SETTINGS, work=work, device=Host())
    np.testing.assert_array_equal(codes.vectors, whole.vectors)
    assert not list(work.rglob("*.draft.work"))
    clear_work(work)
    assert not work.exists()


def test_what_fails_on_the_device_ends_the_readers(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A batch that ends the work does not leave processes reading what nobody waits for."""
    ended: list[bool] = []

    def run(*arguments: Any) -> Iterator[Any]:
        try:
            yield from run_all(*arguments)
        finally:
            ended.append(True)

    monkeypatch.setattr(device_work, "run_all", run)
    monkeypatch.setattr(device_work, "BATCH_NODES", 1)
    with pytest.raises(KeyboardInterrupt) as caught:
        encode_collection(find_files([folder]), SETTINGS, device=Broken())
    assert caught.traceback
    assert ended == [True]


@pytest.mark.parametrize("first", [None, Host()])
def test_work_goes_on_with_or_without_a_device(
    folder: Path, whole: Codes, tmp_path: Path, first: Host | None
) -> None:
    """What was begun on the host goes on on a device, and the other way round, with nothing done twice."""
    files, work = find_files([folder]), tmp_path / "work"
    encode_collection(files[:2], SETTINGS, work=work, device=first)
    before = {path: path.stat().st_mtime_ns for path in work.rglob("*.work")}
    codes = encode_collection(files, SETTINGS, work=work, device=None if first else Host())
    assert before.items() <= {path: path.stat().st_mtime_ns for path in work.rglob("*.work")}.items()
    np.testing.assert_array_equal(codes.vectors, whole.vectors)


def test_damaged_drafts_are_made_again(folder: Path, whole: Codes, tmp_path: Path) -> None:
    """A truncated draft is replaced, not believed."""
    files = find_files([folder])
    with pytest.raises(KeyboardInterrupt):
        encode_collection(files, SETTINGS, work=tmp_path, device=Broken())
    torn = min(tmp_path.rglob("*.draft.work"))
    torn.write_bytes(torn.read_bytes()[:100])
    codes = encode_collection(files, SETTINGS, work=tmp_path, device=Host())
    np.testing.assert_array_equal(codes.vectors, whole.vectors)


def test_failures_are_those_of_the_host(folder: Path, tmp_path: Path) -> None:
    """Files that cannot be read and labels that cannot be swept fail with the same reasons."""
    (tmp_path / "empty.npy").write_bytes(b"")
    np.save(tmp_path / "thin.npy", np.ones((1, 9)))
    labels = np.zeros((14, 14), np.int16)
    labels[1:6, 1:6], labels[8, 2:12] = 2, 5
    np.save(tmp_path / "teeth.npy", labels)
    files = [*find_files([folder])[:2], *find_files([tmp_path])]
    settings = replace(SETTINGS, drop_boundary=True, per_label=True)
    heard: list[int] = []

    expected = encode_collection(files, settings)
    found = encode_collection(
        files,
        settings,
        device=Host(),
        progress=lambda stage, n, _: heard.append(n) if stage == "fields" else None,
    )
    assert found.names == expected.names
    assert sorted(map(str, found.failures)) == sorted(map(str, expected.failures))
    assert heard == list(range(len(files) + 1))
    np.testing.assert_array_equal(found.vectors, expected.vectors)


def test_nothing_that_fits_is_an_error_with_sizes(folder: Path, whole: Codes) -> None:
    """Shapes that no batch takes, even alone, fail; nothing is computed elsewhere in their place."""
    with pytest.raises(
        ReadError, match=r"no codes: .*e0\.npy: 900 nodes do not fit on this device \(and 3 more\)"
    ):
        encode_collection(find_files([folder]), model=whole.model, device=Broken(SizeError))


def test_drafts_survive_their_file(tmp_path: Path) -> None:
    """A shape that waits is read back as it was: mask, cuts, place, name and what is known of it."""
    disk = spem.synthetic.disk(radius=3.3, spacing=0.5)
    work = Work.open(tmp_path, SETTINGS)
    made = draft_shapes(disk, replace(SETTINGS, features="spem+sources"), None)
    save_drafts(work, "ab", made)
    [again] = load_drafts(work, "ab")
    shape, before = again.shape, made[0].shape
    assert isinstance(shape, Shape)
    assert isinstance(before, Shape)
    assert (shape.name, shape.spacing, shape.origin, shape.report) == (
        before.name,
        before.spacing,
        before.origin,
        before.report,
    )
    np.testing.assert_array_equal(shape.mask, before.mask)
    for name in ("voxel", "direction", "fraction"):
        np.testing.assert_array_equal(getattr(shape.cuts, name), getattr(before.cuts, name))
    np.testing.assert_array_equal(again.kinds[1][0], made[0].kinds[1][0])
    assert again.kinds[0] is None
    assert (again.ndim, again.volume) == (2, before.volume)
