"""A CUDA device as the place where a sweep runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from spem.errors import ParameterError
from spem.fields.operator import System

if TYPE_CHECKING:
    from spem.fields.solvers.cuda.cupy_runtime import CupyRuntime
    from spem.fields.solvers.engine import Backend, SourceEngine


@dataclass(frozen=True)
class Cuda:
    """A CUDA device that a sweep runs on; needs ``pip install 'spem[cuda]'``.

    Nothing is tried before the device is used, and nothing else is used when it cannot be.

    Parameters
    ----------
    index
        Number of the device.

    Raises
    ------
    ParameterError
        When the number is not a whole number from 0 up.

    Examples
    --------
    >>> Cuda()
    Cuda(index=0)
    >>> Cuda(-1)
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: index of a CUDA device: expected 0, 1, ..., got -1
    """

    index: int = 0

    def __post_init__(self) -> None:
        index: Any = self.index
        if not isinstance(index, int) or isinstance(index, bool) or index < 0:
            msg = f"index of a CUDA device: expected 0, 1, ..., got {index!r}"
            raise ParameterError(msg)

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> SourceEngine:
        """Make an engine for systems of one dimension.

        Parameters
        ----------
        systems
            The batch.
        dtype
            Precision of the basis, float32 or float64.

        Returns
        -------
        SourceEngine
            To be closed after use.

        Raises
        ------
        MissingExtraError
            When CuPy is not installed, or does not fit the driver.
        ParameterError
            When there is no driver, no device, or none of this number.
        SizeError
            When the systems do not fit into the device's memory.
        """
        from spem.fields.solvers.cuda.engine import CudaEngine

        return CudaEngine(systems, dtype, self.runtime())

    def runtime(self) -> CupyRuntime:
        """Start the device.

        Raises
        ------
        MissingExtraError, ParameterError
            As by `open`.
        """
        from spem.fields.solvers.cuda.cupy_runtime import CupyRuntime

        return CupyRuntime(self.index)


def parse_device(text: str) -> Backend | None:
    """Return the device that a word of the command line names.

    Parameters
    ----------
    text
        ``"cpu"``, ``"cuda"`` or ``"cuda:1"``.

    Returns
    -------
    Backend or None
        None for the CPU.

    Raises
    ------
    ParameterError
        For other words.

    Examples
    --------
    >>> parse_device("cuda:1")
    Cuda(index=1)
    >>> parse_device("gpu")
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: --device gpu: expected cpu, cuda or cuda:NUMBER; see spem devices
    """
    if text == "cpu":
        return None
    match = re.fullmatch(r"cuda(?::([0-9]+))?", text)
    if match is None:
        msg = f"--device {text}: expected cpu, cuda or cuda:NUMBER; see spem devices"
        raise ParameterError(msg)
    return Cuda(int(match[1] or 0))
