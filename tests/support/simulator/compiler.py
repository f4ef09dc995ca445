"""Sources of kernels made into libraries that the simulator calls."""

from __future__ import annotations

import ctypes
import getpass
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from spem.fields.solvers.cuda.programs import Kernel, kernels, options

SHIM = Path(__file__).with_name("simulator.h")
HEADERS = (SHIM, SHIM.with_name("words.h"))
SANITIZE = ("-fsanitize=address,undefined", "-fno-sanitize-recover=undefined", "-g")


@dataclass(frozen=True)
class Library:
    """Kernels of a compiled source, and the functions that run them."""

    kernels: dict[str, Kernel]
    handle: ctypes.CDLL

    def run(self, kernel: str, n_blocks: int, places: list[int], order: int, seed: int) -> str | None:
        """Run a kernel on the values at these places; return what went wrong."""
        function = self.handle[f"simulate_{kernel}"]
        function.restype = ctypes.c_char_p
        values = (ctypes.c_void_p * max(len(places), 1))(*places)
        fault = function(values, ctypes.c_int(n_blocks), ctypes.c_int(order), ctypes.c_uint(seed))
        return fault.decode() if fault else None


def find_compiler() -> str | None:
    """Return the C++ compiler, if there is one; sections of shared memory are Linux's."""
    return (shutil.which("g++") or shutil.which("clang++")) if sys.platform == "linux" else None


def find_sanitizer() -> str | None:
    """Return the library of g++'s address sanitizer, if there is one."""
    compiler = shutil.which("g++")
    if compiler is None or sys.platform != "linux" or platform.machine() != "x86_64":
        return None
    library = _call([compiler, "-print-file-name=libasan.so"], "").strip()
    return library if Path(library).is_file() else None


def spawn_sanitized(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python with the sanitizers loaded, so that a runtime can be made with ``sanitize=True``."""
    paths = os.pathsep.join((str(SHIM.parents[1]), os.environ.get("PYTHONPATH", "")))
    # Python does not free all it takes, and fibers jump between stacks that the sanitizer does not know.
    settings = "detect_leaks=0:detect_stack_use_after_return=0"
    loaded = {"LD_PRELOAD": str(find_sanitizer()), "ASAN_OPTIONS": settings, "PYTHONPATH": paths}
    command = [sys.executable, *arguments]
    return subprocess.run(command, env=os.environ | loaded, capture_output=True, text=True)


def build(text: str, macros: Mapping[str, int], sanitize: bool = False) -> Library:
    """Compile a source, or find it compiled."""
    return _build(text, tuple(sorted(macros.items())), sanitize)


@cache
def _build(text: str, macros: tuple[tuple[str, int], ...], sanitize: bool) -> Library:
    """Compile a source: first its macros, for the kernels' true parameters, then kernels and launchers."""
    compiler = find_compiler()
    if compiler is None:
        msg = "the simulator needs g++ or clang++ on Linux"
        raise RuntimeError(msg)
    plain = _call([compiler, "-E", "-x", "c++", *options(dict(macros)), "-"], text)
    found = kernels("\n".join(line for line in plain.splitlines() if not line.startswith("#")))
    signature = "(void** arguments, int n_blocks, int order, unsigned seed)"
    launchers = "".join(
        f'extern "C" const char* simulate_{name}{signature} {{ return simulator::run('
        f'"{name}", simulator::call<{name}>, arguments, n_blocks, order, seed); }}\n'
        for name in found
    )
    body = f'#include "{SHIM}"\nnamespace {{\n{plain}\n}}\n{launchers}'
    flags = ["-std=c++17", "-O2", "-shared", "-fPIC", "-U_FORTIFY_SOURCE", "-ffp-contract=off", "-w"]
    command = [compiler, *flags, *(SANITIZE if sanitize else ()), "-x", "c++", "-"]
    key = hashlib.sha256(
        "\0".join((*command, *(path.read_text() for path in HEADERS), body)).encode()
    ).hexdigest()[:32]
    target = _folder() / f"{key}.so"
    if not target.exists():
        part = target.with_suffix(f".{os.getpid()}")
        _call([*command, "-o", str(part)], body)
        part.replace(target)
    return Library(found, ctypes.CDLL(str(target)))


def _folder() -> Path:
    """Where compiled sources are kept."""
    folder = Path(tempfile.gettempdir()) / f"spem-simulator-{getpass.getuser()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def _call(command: list[str], text: str) -> str:
    """Run the compiler on a text."""
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode:
        msg = f"the simulator's compiler refuses a source:\n{done.stderr[:4000]}"
        raise RuntimeError(msg)
    return done.stdout
