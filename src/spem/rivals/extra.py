"""Packages that rivals need and spem does not: imported when they are used, named where they are missing."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from spem.errors import MissingExtraError

EXTRA = "spem[rivals]"


def require(module: str, distribution: str) -> Any:
    """Import a module of a package that only rivals need.

    Parameters
    ----------
    module
        Name that it is imported by.
    distribution
        Name that it is installed by.

    Raises
    ------
    MissingExtraError
        When it is not installed.

    Examples
    --------
    >>> require("json", "json").dumps([1])
    '[1]'
    >>> require("no_such_module", "no-such-package")
    Traceback (most recent call last):
        ...
    spem.errors.MissingExtraError: needs no-such-package; install spem[rivals]
    """
    if not has(module):
        msg = f"needs {distribution}; install {EXTRA}"
        raise MissingExtraError(msg)
    return import_module(module)


def has(module: str) -> bool:
    """Tell whether the package of a module is installed, without importing it.

    Examples
    --------
    >>> has("json"), has("no_such_package.module")
    (True, False)
    """
    return find_spec(module.partition(".")[0]) is not None
