"""Checks of single arguments: whole numbers, finite numbers and truth values, plain or of NumPy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spem.errors import ParameterError


def whole_number(name: str, value: Any, least: int = 1, largest: float = math.inf) -> int:
    """Return a whole number in its range as an `int`.

    Parameters
    ----------
    name
        What to call the argument in messages.
    value
        The argument; neither a float nor a truth value is a whole number.
    least, largest
        Ends of the range, both in it.

    Raises
    ------
    ParameterError
        When it is anything else.

    Examples
    --------
    >>> whole_number("k", np.int64(3))
    3
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= largest:
        bounds = f"of at least {least}" if largest == math.inf else f"from {least} to {largest}"
        msg = f"{name}={value!r} must be a whole number {bounds}"
        raise ParameterError(msg)
    return int(value)


def finite_number(name: str, value: Any) -> float:
    """Return a finite number as a `float`.

    Raises
    ------
    ParameterError
        When it is NaN, infinite or no number.

    Examples
    --------
    >>> finite_number("threshold", np.float32(0.5))
    0.5
    """
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not number or not math.isfinite(value):
        msg = f"{name}={value!r} must be a finite number"
        raise ParameterError(msg)
    return float(value)


def truth_value(name: str, value: Any) -> bool:
    """Return a truth value as a `bool`.

    Raises
    ------
    ParameterError
        When it is anything else, 0 and 1 included.

    Examples
    --------
    >>> truth_value("dark", np.bool_(True))
    True
    """
    if not isinstance(value, (bool, np.bool_)):
        msg = f"{name}={value!r} must be True or False"
        raise ParameterError(msg)
    return bool(value)
