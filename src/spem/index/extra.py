"""Packages that only the index needs, imported when they are used."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

from spem.errors import MissingExtraError

# The database writes warnings of its own to stderr; what matters is raised.
_QUIET = {"LANCEDB_LOG": "error", "LANCE_LOG": "error"}


def require(module: str, extra: str = "index") -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    module
        Name of the module.
    extra
        The extra that brings it.

    Raises
    ------
    MissingExtraError
        When it is not installed.

    Examples
    --------
    >>> require("math").pi > 3
    True
    """
    for name, value in _QUIET.items() if module == "lancedb" else ():
        os.environ.setdefault(name, value)
    try:
        return import_module(module)
    except ImportError as error:
        msg = f"{module} is not installed; it comes with pip install 'spem[{extra}]'"
        raise MissingExtraError(msg) from error
