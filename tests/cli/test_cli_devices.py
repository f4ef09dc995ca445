"""``spem devices`` and ``--device``: what there is, and one line where it is not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import Result

from spem.codes.codes import Codes
from spem.errors import MissingExtraError, ParameterError, SpemError
from spem.fields.solvers.cuda import cupy_runtime, device, listing
from spem.fields.solvers.host import Host

QUICK = ("--own-grid", "--features", "spem", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")
Spem = Callable[..., Result]
Refused = Callable[..., None]
ABSENT = {
    "CuPy is not installed; it comes with pip install 'spem[cuda]'": MissingExtraError,
    "no NVIDIA driver here: install one, give a container its GPUs, or take no device": ParameterError,
    "no CUDA device 0; there are: none": ParameterError,
}


@pytest.fixture(params=ABSENT.items(), ids=["no CuPy", "no driver", "no device"])
def absent(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Take all devices away, and return what is said of that."""
    reason, error = request.param

    def refuse(_: int) -> SpemError:
        raise error(reason)

    monkeypatch.setattr(cupy_runtime, "load_cupy", refuse)
    monkeypatch.setattr(listing, "load_cupy", refuse)
    return str(reason)


@pytest.fixture
def present(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Let a device of any number be the processor; return the numbers that were asked for."""
    asked: list[int] = []
    monkeypatch.setattr(device.Cuda, "runtime", lambda self: asked.append(self.index))
    monkeypatch.setattr(device.Cuda, "open", lambda _, systems, dtype: Host().open(systems, dtype))
    return asked


@pytest.mark.parametrize(
    "command",
    [
        ("field", "no-such-shape.png", "--rho", "2"),
        ("maps", "no-such-shape.png"),
        ("encode", "no-such-folder", "-o", "codes.spem"),
        ("index", "add", "shapes.db", "no-such-folder"),
    ],
    ids=lambda command: command[0],
)
def test_absent_device_is_told_before_anything_is_read(
    spem: Spem, refused: Refused, absent: str, command: tuple[str, ...], tmp_path: Path, monkeypatch
) -> None:
    """Without CuPy, driver or device a command ends in one line that says which, and does nothing."""
    monkeypatch.chdir(tmp_path)
    refused(spem(*command, "--device", "cuda"), f"--device cuda: {absent}")
    assert not list(tmp_path.iterdir())


def test_other_words_are_refused(spem: Spem, refused: Refused, image: Path) -> None:
    """A device is cpu, cuda or cuda with a number."""
    for word in ("gpu", "cuda:x", "cuda:-1", "CPU"):
        expected = f"--device {word}: expected cpu, cuda or cuda:NUMBER; see spem devices"
        refused(spem("maps", image, "--device", word), expected)


def test_no_devices_are_no_error(spem: Spem, absent: str) -> None:
    """`spem devices` tells in one line why there is none, and all is well."""
    result = spem("devices")
    assert result.exit_code == 0
    assert result.stdout == f"no CUDA device: {absent}\n"
    assert json.loads(spem("devices", "--json").stdout) == {"devices": [], "reason": absent}


def test_devices_are_listed(spem: Spem, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each device has a line with its number, name and memory."""
    facts = {"name": b"NVIDIA H200", "major": 9, "minor": 0}
    runtime = SimpleNamespace(getDeviceCount=lambda: 2, getDeviceProperties=lambda _: facts)
    one = SimpleNamespace(mem_info=(3 << 30, 4 << 30))
    cuda = SimpleNamespace(runtime=runtime, Device=lambda _: one)
    monkeypatch.setattr(listing, "load_cupy", lambda _: SimpleNamespace(cuda=cuda))
    lines = spem("devices").stdout.splitlines()
    told = "NVIDIA H200  4.0 GiB, 3.0 free  compute capability 9.0"
    assert lines == [f"cuda:{index}  {told}" for index in range(2)]
    [first, second] = json.loads(spem("devices", "--json").stdout)["devices"]
    assert second == first | {"index": 1}


def test_field_and_maps_run_on_the_device(
    spem: Spem, image: Path, tmp_path: Path, present: list[int]
) -> None:
    """What a device computes is written as what the processor does."""
    for number, command in enumerate((("field", image, "--rho", "2,5"), ("maps", image)), 3):
        here, there = tmp_path / "here.npz", tmp_path / "there.npz"
        assert spem(*command, "-o", here).exit_code == 0
        assert spem(*command, "-o", there, "--device", f"cuda:{number}").exit_code == 0
        with np.load(here) as one, np.load(there) as other:
            assert all(np.array_equal(one[name], other[name]) for name in one)
    assert present == [3, 4]


def test_single_sources_stay_on_the_processor(
    spem: Spem, refused: Refused, image: Path, tmp_path: Path, absent: str
) -> None:
    """Fields of single sources are solved on the processor alone; any device is refused."""
    result = spem("field", image, "--source", "5,5", "-o", tmp_path / "f.npz", "--device", "cuda")
    refused(result, "--device cuda", "every digit")


def test_collections_run_on_the_device(spem: Spem, folder: Path, tmp_path: Path, present: list[int]) -> None:
    """Codes and rows that a device makes, here the processor as one, are those of processes."""
    here, there, db = tmp_path / "here.spem", tmp_path / "there.spem", tmp_path / "shapes.db"
    assert spem("encode", folder, "-o", here, *QUICK).exit_code == 0
    assert spem("encode", folder, "-o", there, *QUICK, "--device", "cuda").exit_code == 0
    np.testing.assert_array_equal(Codes.load(there).vectors, Codes.load(here).vectors)
    result = spem("index", "add", db, folder, *QUICK, "--device", "cuda:1", "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["model"] == Codes.load(here).model.digest
    assert set(present) == {0, 1}


def test_a_device_without_work_is_told(spem: Spem, folder: Path, tmp_path: Path, present: list[int]) -> None:
    """Features that no device makes are made all the same, with one line that says so."""
    for command in (
        ("encode", folder, "-o", tmp_path / "codes.spem"),
        ("index", "add", tmp_path / "db", folder),
    ):
        options = ("--own-grid", "--features", "hks", "--n-centers", "4")
        result = spem(*command, *options, "--device", "cuda")
        assert result.exit_code == 0, result.stderr
        assert "--device cuda: not used by features hks; --features spem is made there\n" in result.stderr
        assert "--device" not in spem(*command, *options).stderr
