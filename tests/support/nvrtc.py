"""CUDA's run-time compiler, which needs no device: what CuPy compiles with."""

from __future__ import annotations

import ctypes
import importlib.util
import re
from collections.abc import Sequence
from ctypes.util import find_library
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class Usage:
    """What a compiled kernel takes of a multiprocessor; bytes a thread, and of a block's shared memory."""

    registers: int
    stack: int
    spilled: int
    shared: int


class CompilationError(Exception):
    """A source that the compiler refuses."""


@cache
def load() -> ctypes.CDLL | None:
    """Load the compiler from its wheel or from the system; None where it is not."""
    spec = importlib.util.find_spec("nvidia")
    folders = [Path(place) for place in (spec.submodule_search_locations or ())] if spec else []
    wheels = [path for folder in folders for path in sorted(folder.glob("**/libnvrtc.so.*"))]
    for name in [*(str(path) for path in wheels), find_library("nvrtc")]:
        if name and "builtins" not in name:
            return ctypes.CDLL(name)
    return None


def compile_kernels(text: str, options: Sequence[str], architecture: int) -> dict[str, Usage]:
    """Compile a source to machine code of one architecture; return what each kernel uses.

    Raises
    ------
    CompilationError
        With the compiler's words.
    """
    library = load()
    assert library is not None
    program = ctypes.c_void_p()
    library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), b"source.cu", 0, None, None)
    # What CuPy adds to its users' options, and a report of ptxas.
    cupys = ["-ftz=true", "--device-as-default-execution-space", f"-arch=sm_{architecture}"]
    flags = ["-std=c++17", *options, *cupys, "--ptxas-options=-v"]
    words = (ctypes.c_char_p * len(flags))(*(flag.encode() for flag in flags))
    status = library.nvrtcCompileProgram(program, len(flags), words)
    size = ctypes.c_size_t()
    library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    library.nvrtcGetProgramLog(program, log)
    library.nvrtcDestroyProgram(ctypes.byref(program))
    told = log.value.decode()
    if status or "warning" in told:
        raise CompilationError(told)
    return _usages(told)


def _usages(log: str) -> dict[str, Usage]:
    """Read ptxas' report."""
    found = {}
    for part in re.split(r"Compiling entry function '", log)[1:]:
        name = part.partition("'")[0]
        stack, stores, loads = re.search(
            r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", part
        ).groups()
        registers = re.search(r"Used (\d+) registers", part)[1]
        shared = re.search(r"(\d+) bytes smem", part)
        found[name] = Usage(
            int(registers), int(stack), int(stores) + int(loads), int(shared[1]) if shared else 0
        )
    return found
