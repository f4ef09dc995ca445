"""CUDA sources of the package as text, and what their kernels take.

A source is named by its file, ``"cycle.cu"``, when it lies in this folder, and by package and file,
``"spem.codes.cuda/vlad.cu"``, when it lies in another. ``#include "file.cuh"`` is done here, by text, from
the package of the source or from this one, so that a source compiles wherever the package is.

Kernels are written out, not made by macros, as ``extern "C" __global__ void name(...)``. Their parameters
are scalars (``int``, ``long long``, ``float``, ``double``), pointers to numbers (also ``float4`` and its
like), or pointers to pointers, for which an int64 array of addresses stands. A type may be an alias, ``using
Real = double;``, even one that macros choose.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

PACKAGE = "spem.fields.solvers.cuda"

_KERNEL = re.compile(
    r'extern\s+"C"\s+__global__\s+void\s+(?:__launch_bounds__\s*\([^)]*\)\s*)?(\w+)\s*\(([^)]*)\)'
)
_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"[^\n]*$', re.MULTILINE)
_ALIAS = re.compile(r"\busing\s+(\w+)\s*=\s*([\w\s]+?)\s*;|\btypedef\s+([\w\s]+?)\s+(\w+)\s*;")
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_ON_HOST = np.ndarray, np.generic
_NUMBERS = {
    "float": "float32",
    "double": "float64",
    "int": "int32",
    "unsigned": "uint32",
    "unsigned int": "uint32",
    "long long": "int64",
    "unsigned long long": "uint64",
    "signed char": "int8",
    "unsigned char": "uint8",
    "bool": "bool",
}


@dataclass(frozen=True)
class Parameter:
    """A parameter of a kernel.

    Parameters
    ----------
    name
        As in the source.
    pointer
        Whether it takes an array.
    dtypes
        The types that fit: one, or as many as an alias may stand for.
    """

    name: str
    pointer: bool
    dtypes: frozenset[np.dtype[Any]]

    def fits(self, argument: Any) -> bool:
        """Whether an argument is a contiguous device array, or a NumPy scalar, of the right type."""
        if not self.pointer:
            return isinstance(argument, np.generic) and argument.dtype in self.dtypes
        if isinstance(argument, _ON_HOST) or not hasattr(argument, "flags"):
            return argument is None
        return argument.dtype in self.dtypes and bool(argument.flags.c_contiguous)


@dataclass(frozen=True)
class Kernel:
    """A kernel's name and parameters."""

    name: str
    parameters: tuple[Parameter, ...]

    def check(self, arguments: Sequence[Any]) -> None:
        """Raise a TypeError unless the arguments are what the kernel takes.

        Examples
        --------
        >>> kernel = kernels('extern "C" __global__ void fill(float* v, int n) {}')["fill"]
        >>> kernel.check([None, 3])
        Traceback (most recent call last):
            ...
        TypeError: kernel fill, argument n: expected a scalar int32, got int
        """
        if len(arguments) != len(self.parameters):
            msg = f"kernel {self.name}: expected {len(self.parameters)} arguments, got {len(arguments)}"
            raise TypeError(msg)
        for parameter, argument in zip(self.parameters, arguments, strict=True):
            if not parameter.fits(argument):
                kind = "a contiguous device array of" if parameter.pointer else "a scalar"
                wanted = f"{kind} {' or '.join(sorted(one.name for one in parameter.dtypes))}"
                msg = (
                    f"kernel {self.name}, argument {parameter.name}: expected {wanted}, got {_told(argument)}"
                )
                raise TypeError(msg)


def read_source(source: str) -> str:
    """Return the text of a source with its includes in place.

    Examples
    --------
    >>> "TILE" in read_source("common.cuh")
    True
    """
    package, _, name = source.rpartition("/")
    return _include(package or PACKAGE, name, set())


def kernels(text: str) -> dict[str, Kernel]:
    """Return the kernels of a source, by name.

    Examples
    --------
    >>> kernels('extern "C" __global__ void fill(float* v, int n) {}')["fill"].parameters[0].dtypes
    frozenset({dtype('float32')})
    """
    text = _COMMENT.sub(" ", text)
    aliases: dict[str, set[str]] = {}
    for name, kind, old_kind, old_name in _ALIAS.findall(text):
        aliases.setdefault(name or old_name, set()).add(kind or old_kind)
    found = {}
    for name, listing in _KERNEL.findall(text):
        parts = [part for part in listing.split(",") if part.strip() not in ("", "void")]
        found[name] = Kernel(name, tuple(_parameter(name, part, aliases) for part in parts))
    return found


def options(macros: Mapping[str, int]) -> tuple[str, ...]:
    """Return the compiler's options for macros, in one order."""
    return tuple(f"-D{name}={int(value)}" for name, value in sorted(macros.items()))


@cache
def _read(package: str, name: str) -> str:
    """Text of a file of a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def _include(package: str, name: str, seen: set[str]) -> str:
    """Text of a file with its includes, each of them once."""

    def replace(match: re.Match[str]) -> str:
        header = match[1]
        if header in seen:
            return ""
        seen.add(header)
        home = package if resources.files(package).joinpath(header).is_file() else PACKAGE
        line = body.count("\n", 0, match.start()) + 2
        return f'{_include(home, header, seen)}\n#line {line} "{name}"'

    body = _read(package, name)
    return f'#line 1 "{name}"\n' + _INCLUDE.sub(replace, body)


def _parameter(kernel: str, listing: str, aliases: Mapping[str, set[str]]) -> Parameter:
    """Read one parameter of a list."""
    words = (
        re.sub(r"\b(?:const|__restrict__|__restrict|restrict)\b", " ", listing).replace("*", " * ").split()
    )
    stars, name = words.count("*"), words[-1]
    kind = " ".join(word for word in words[:-1] if word != "*")
    if stars == 2:
        return Parameter(name, True, frozenset({np.dtype(np.int64)}))
    dtypes = frozenset(_number(kernel, alias, stars == 1) for alias in aliases.get(kind, {kind}))
    return Parameter(name, stars == 1, dtypes)


def _number(kernel: str, kind: str, pointer: bool) -> np.dtype[Any]:
    """Type of NumPy of a type of C, or of the parts of a vector that a pointer points to."""
    kind = " ".join(kind.split())
    element = re.sub(r"^(float|double|int)[234]$", r"\1", kind) if pointer else kind
    if element not in _NUMBERS:
        msg = f"kernel {kernel}: a parameter of type {kind!r}, expected one of {', '.join(_NUMBERS)}"
        raise TypeError(msg)
    return np.dtype(_NUMBERS[element])


def _told(argument: Any) -> str:
    """Tell what an argument is, in a few words."""
    kind = type(argument)
    if not hasattr(argument, "dtype"):
        return kind.__name__
    loose = "" if isinstance(argument, np.generic) or argument.flags.c_contiguous else "non-contiguous "
    return f"{loose}{kind.__module__.partition('.')[0]}.{kind.__name__} of {argument.dtype.name}"
