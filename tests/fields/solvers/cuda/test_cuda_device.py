"""The device as an object, and what is said where it cannot be had."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

import spem
from spem.errors import MissingExtraError, ParameterError
from spem.fields.solvers.cuda.cupy_runtime import require_compiler, require_driver
from spem.fields.solvers.cuda.device import Cuda, parse_device


class FakeCudaError(RuntimeError):
    """What CuPy raises."""


@dataclass
class Driver:
    """A driver of our own making, in the place of ``cupy.cuda.runtime``."""

    version: int = 13000
    wanted: int = 13020
    names: list[str] | None = field(default_factory=lambda: ["NVIDIA H200", "NVIDIA T4"])
    CUDARuntimeError = FakeCudaError

    def driverGetVersion(self) -> int:  # noqa: N802 - CuPy's name
        """CUDA of the driver."""
        return self.version

    def runtimeGetVersion(self) -> int:  # noqa: N802 - CuPy's name
        """CUDA that CuPy was made for."""
        return self.wanted

    def getDeviceCount(self) -> int:  # noqa: N802 - CuPy's name
        """Count devices, or fail as CuPy does where there are none."""
        if self.names is None:
            msg = "cudaErrorNoDevice: no CUDA-capable device is detected"
            raise FakeCudaError(msg)
        return len(self.names)

    def getDeviceProperties(self, number: int) -> dict[str, bytes]:  # noqa: N802 - CuPy's name
        """Name of a device."""
        return {"name": self.names[number].encode()}


def test_words_of_the_command_line() -> None:
    """Words name the CPU, the first device or one by number."""
    assert parse_device("cpu") is None
    assert parse_device("cuda") == Cuda(0) == spem.Cuda()
    assert parse_device("cuda:12") == Cuda(12)


@pytest.mark.parametrize("word", ["", "gpu", "CUDA", "cuda:", "cuda:-1", "cuda:x", "cuda:0 ", "0"])
def test_other_words_are_refused(word: str) -> None:
    """What is no device is an error of one line with the words that are."""
    expected = f"--device {word}: expected cpu, cuda or cuda:NUMBER; see spem devices"
    with pytest.raises(ParameterError, match=f"^{re.escape(expected)}$"):
        parse_device(word)


@pytest.mark.parametrize("index", [-1, 1.0, "0", True, None])
def test_numbers_that_are_no_index_are_refused(index: object) -> None:
    """An index is a whole number from 0 up."""
    with pytest.raises(ParameterError, match=r"^index of a CUDA device: expected 0, 1, \.\.\., got "):
        Cuda(index)


def test_a_device_that_works_is_taken() -> None:
    """Nothing is said of a device that can be used, also with a driver later than CuPy."""
    require_driver(Driver(), 1)
    require_driver(Driver(version=14010, wanted=12090), 0)


@pytest.mark.parametrize(
    ("driver", "index", "kind", "words"),
    [
        (Driver(version=0), 0, ParameterError, "no NVIDIA driver here"),
        (Driver(names=None), 0, ParameterError, "no CUDA device can be used: cudaErrorNoDevice"),
        (Driver(names=[]), 0, ParameterError, "no CUDA device 0; there are: none"),
        (Driver(), 2, ParameterError, "no CUDA device 2; there are: 0 NVIDIA H200, 1 NVIDIA T4$"),
        (
            Driver(version=11080),
            0,
            MissingExtraError,
            r"CuPy is for CUDA 13, the driver for CUDA 11\.8: update the driver$",
        ),
        (
            Driver(version=12040),
            0,
            MissingExtraError,
            r"CuPy is for CUDA 13, the driver for CUDA 12\.4: .* pip install 'spem\[cuda12\]'$",
        ),
    ],
)
def test_devices_that_cannot_be_used(driver: Driver, index: int, kind: type[Exception], words: str) -> None:
    """No driver, no device, no such device and a CuPy too new are told apart, each in one line."""
    with pytest.raises(kind, match=f"^{words}") as caught:
        require_driver(driver, index)
    assert "\n" not in str(caught.value)


def test_cupy_without_its_compiler() -> None:
    """A CuPy installed by itself lacks NVRTC; the command that brings it is named."""

    def lost() -> tuple[int, int]:
        msg = 'Failure finding "libnvrtc.so.13"\nNo such file'
        raise RuntimeError(msg)

    require_compiler(SimpleNamespace(getVersion=lambda: (13, 0)))
    with pytest.raises(MissingExtraError, match=r"^CuPy finds no compiler .* pip install 'spem\[cuda\]'.*$"):
        require_compiler(SimpleNamespace(getVersion=lost))


def test_cupy_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command that installs CuPy is named when a device is opened, not when it is chosen."""
    monkeypatch.setitem(sys.modules, "cupy", None)
    device = Cuda()
    with pytest.raises(MissingExtraError, match=r"^CuPy is .*; it comes with pip install 'spem\[cuda\]'$"):
        device.runtime()
