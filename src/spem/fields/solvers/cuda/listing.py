"""The CUDA devices of this machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from spem.fields.solvers.cuda.cupy_runtime import load_cupy


@dataclass(frozen=True)
class DeviceFacts:
    """What is known of a device.

    Parameters
    ----------
    index
        Its number, as ``spem.Cuda`` takes it.
    name
        Name of the device.
    capability
        Compute capability, such as ``"9.0"``.
    total_bytes, free_bytes
        Memory, and what nobody uses of it.
    """

    index: int
    name: str
    capability: str
    total_bytes: int
    free_bytes: int


def list_devices() -> list[DeviceFacts]:
    """List the devices that CuPy can use.

    Raises
    ------
    MissingExtraError
        When CuPy is not installed, or does not fit the driver.
    ParameterError
        When there is no driver, or no device.
    """
    cupy = load_cupy(0)
    return [_facts(cupy.cuda, index) for index in range(cupy.cuda.runtime.getDeviceCount())]


def _facts(cuda: Any, index: int) -> DeviceFacts:
    """Ask for the facts of one device."""
    facts = cuda.runtime.getDeviceProperties(index)
    free, total = cuda.Device(index).mem_info
    capability = f"{facts['major']}.{facts['minor']}"
    return DeviceFacts(index, facts["name"].decode(), capability, int(total), int(free))
