"""What the Python around the kernels needs of a device.

Kernels are launched through a `Runtime`, and arrays on its device made, moved and worked on through it, so
that the same code runs on a GPU by CuPy and in a simulator over NumPy.

``runtime.program("cycle.cu", ORDER=2)`` compiles a source of this folder,
``runtime.program("spem.codes.cuda/vlad.cu")`` one of another package (`spem.fields.solvers.cuda.programs`);
``.launch("name", n_blocks, *arguments)`` runs a kernel of it; ``.bind`` takes the same, to run it again and
again.

Host and device arrays are never mixed: `Runtime.upload` and `Runtime.download` are the ways between them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

#: Threads of a block, in every launch.
THREADS = 256
#: Rows of a tile: two threads a row.
TILE = 128

Array = Any


class Program(Protocol):
    """A compiled source."""

    def launch(self, kernel: str, n_blocks: int, *arguments: Any) -> None:
        """Run a kernel on n_blocks blocks of `THREADS` threads; on none when n_blocks is 0.

        Parameters
        ----------
        kernel
            Its name.
        n_blocks
            Blocks of a grid of one dimension.
        *arguments
            Contiguous device arrays, None for no array, and NumPy scalars of the exact types.

        Raises
        ------
        TypeError
            When number or types of the arguments are not those of the kernel.
        """
        ...

    def bind(self, kernel: str, n_blocks: int, *arguments: Any) -> Callable[[], None]:
        """Check a launch once, and return what runs it, many times over; it holds on to its arrays.

        Parameters and errors are those of `launch`.
        """
        ...


class Runtime(Protocol):
    """A device, or what stands for one."""

    #: Exceptions that mean that the device has no memory left.
    memory_errors: tuple[type[BaseException], ...]

    @property
    def xp(self) -> Any:
        """Array functions of the device: CuPy, or a stand-in."""
        ...

    @property
    def name(self) -> str:
        """Name of the device, for messages."""
        ...

    def program(self, source: str, **macros: int) -> Program:
        """Return a source of a package, compiled with macros; the same program for the same macros."""
        ...

    def upload(self, values: NDArray[Any]) -> Array:
        """Copy a host array to the device."""
        ...

    def download(self, array: Array) -> NDArray[Any]:
        """Copy a device array to the host, when all work before is done."""
        ...

    def zeros(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
        """Make a device array of zeros."""
        ...

    def empty(self, shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
        """Make a device array that holds anything."""
        ...

    def address(self, array: Array) -> int:
        """Return where a device array starts, for kernels that take tables of addresses."""
        ...

    def free_bytes(self) -> int:
        """Return the bytes of memory that can still be had."""
        ...

    def release(self) -> None:
        """Give memory that is held but not used back to the device."""
        ...

    def synchronize(self) -> None:
        """Wait for all work."""
        ...

    def mark(self) -> Any:
        """Return an event at the end of the work so far."""
        ...

    def elapsed(self, start: Any, end: Any) -> float:
        """Return the seconds between two events, when the second is reached."""
        ...


def addresses(runtime: Runtime, arrays: list[Array]) -> NDArray[np.int64]:
    """Return the addresses of device arrays, a table for kernels to be uploaded."""
    return np.array([runtime.address(array) for array in arrays], np.int64)
