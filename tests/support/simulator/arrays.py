"""A stand-in of CuPy over NumPy that is stricter than either.

`DeviceArray` never mixes with arrays of the host, gives no number to Python, and has only what CuPy's has;
``arrays.name`` is a function of CuPy's, or an error.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from simulator.memory import Guarded, guard, poison

_FUNCTIONS = """
abs absolute add all allclose amax amin any arange argmax argmin argpartition argsort array_equal asarray
ascontiguousarray atleast_1d atleast_2d average bincount bitwise_and bitwise_or broadcast_to ceil clip
column_stack concatenate copy cos count_nonzero cumprod cumsum diag diagonal diff digitize divide dot
einsum empty empty_like equal exp expand_dims expm1 eye flatnonzero flip floor floor_divide full full_like
greater greater_equal hstack identity inner invert isfinite isinf isnan kron less less_equal lexsort
linspace log log1p logical_and logical_not logical_or matmul max maximum mean median min minimum mod
moveaxis multiply nan_to_num negative nonzero not_equal ones ones_like outer pad partition power prod
ravel repeat reshape roll round searchsorted sign sin sort sqrt square squeeze stack std subtract sum
swapaxes take take_along_axis tensordot tile trace transpose tril triu unique var vdot vstack where zeros
zeros_like
"""
_LINALG = "cholesky eigh eigvalsh inv lstsq norm pinv qr slogdet solve svd"
_NAMES = "bool_ e float32 float64 inf int8 int32 int64 nan newaxis pi uint8 uint32 uint64"
_METHODS = """
all any argmax argmin argsort astype clip copy cumsum diagonal dot fill max mean min nonzero prod ravel
repeat reshape round sort squeeze std sum swapaxes take trace transpose var view
"""

FUNCTIONS = frozenset(_FUNCTIONS.split())
LINALG = frozenset(_LINALG.split())
NAMES = frozenset(_NAMES.split())
METHODS = frozenset(_METHODS.split())
#: Options of NumPy's functions that CuPy's have not.
ABSENT = frozenset({"where", "initial", "like", "subok", "casting"})


class DeviceArray(NDArrayOperatorsMixin):
    """An array of the simulated device.

    Parameters
    ----------
    values
        Its numbers, in guarded memory.
    owner
        That memory, also that of the array that this is a view of.
    """

    __array_priority__ = 100

    def __init__(self, values: NDArray[Any], owner: Guarded) -> None:
        self.values = values
        self.owner = owner

    shape = property(lambda self: self.values.shape)
    dtype = property(lambda self: self.values.dtype)
    size = property(lambda self: self.values.size)
    ndim = property(lambda self: self.values.ndim)
    nbytes = property(lambda self: self.values.nbytes)
    itemsize = property(lambda self: self.values.itemsize)
    strides = property(lambda self: self.values.strides)
    flags = property(lambda self: self.values.flags)
    T = property(lambda self: self._wrap(self.values.T))

    def __repr__(self) -> str:
        return f"DeviceArray({self.shape}, {self.dtype})"

    def __len__(self) -> int:
        return len(self.values)

    def _refuse(self, *_: Any, **__: Any) -> Any:
        msg = f"{self!r} does not leave the device by itself; download it"
        raise TypeError(msg)

    __array__ = __float__ = __int__ = __bool__ = __index__ = __iter__ = __complex__ = _refuse

    def __array_function__(self, function: Callable[..., Any], *_: Any) -> Any:
        msg = f"numpy.{function.__name__} of a device array; use the runtime's xp"
        raise TypeError(msg)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__":
            msg = f"numpy.{ufunc.__name__}.{method} of a device array; use the runtime's xp"
            raise TypeError(msg)
        out = options.pop("out", None)
        if out is not None:
            options["out"] = tuple(_open(one) for one in out)
        with np.errstate(all="ignore"):
            result = ufunc(*(_open(one) for one in inputs), **options)
        return out[0] if out is not None else _close(result, self)

    def __getitem__(self, key: Any) -> DeviceArray:
        return self._wrap(self.values[_open_key(key)])

    def __setitem__(self, key: Any, value: Any) -> None:
        opened = _open_key(key)
        new = _open(value)
        listed = isinstance(opened, np.ndarray) and opened.dtype.kind in "iu"
        if listed and np.ndim(new) and len(np.unique(opened)) != opened.size:
            msg = "an index is written to twice, which a device does in any order"
            raise TypeError(msg)
        self.values[opened] = new

    def _wrap(self, result: Any) -> DeviceArray:
        """Result of this array: a view of it, or an array of its own."""
        return _close(result, self)


def _method(name: str) -> Callable[..., Any]:
    """Make a method of device arrays that CuPy has too."""

    def call(self: DeviceArray, *arguments: Any, **options: Any) -> Any:
        opened = [_open(one) for one in arguments]
        result = getattr(self.values, name)(*opened, **{key: _open(one) for key, one in options.items()})
        return None if result is None else _close(result, self)

    call.__name__ = name
    return call


for _name in METHODS:
    setattr(DeviceArray, _name, _method(_name))


class _Linalg:
    """Functions of cupy.linalg."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in LINALG:
            msg = f"the simulator has no linalg.{name}"
            raise AttributeError(msg)
        return _function(getattr(np.linalg, name))


linalg = _Linalg()


def __getattr__(name: str) -> Any:
    if name == "ndarray":
        return DeviceArray
    if name in NAMES:
        return getattr(np, name)
    if name not in FUNCTIONS:
        msg = f"the simulator's xp has no {name}"
        raise AttributeError(msg)
    return _function(getattr(np, name))


@cache
def _function(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function of device arrays from one of NumPy's."""

    def call(*arguments: Any, **options: Any) -> Any:
        if function is np.repeat and not isinstance(arguments[1], int | np.integer | list | tuple):
            msg = "repeat takes counts of the host, a number or a list"
            raise TypeError(msg)
        if function is np.bincount and ("weights" in options or len(arguments) > 1):
            msg = "bincount adds weights up in any order on a device"
            raise TypeError(msg)
        if options.keys() & ABSENT:
            msg = f"{function.__name__} of CuPy has no {', '.join(options.keys() & ABSENT)}"
            raise TypeError(msg)
        opened = [_open(one) for one in arguments]
        with np.errstate(all="ignore"):
            result = function(*opened, **{key: _open(one) for key, one in options.items()})
        closed = _close(result, *(one for one in arguments if isinstance(one, DeviceArray)))
        if function in (np.empty, np.empty_like):
            poison(closed.values)
        return closed

    call.__name__ = function.__name__
    return call


def _open(value: Any) -> Any:
    """What NumPy is to see of an argument; arrays of the host are refused."""
    if isinstance(value, DeviceArray):
        return value.values
    if isinstance(value, np.ndarray):
        msg = f"an array {value.shape} of the host among device arrays; upload it"
        raise TypeError(msg)
    if isinstance(value, list | tuple):
        return type(value)(_open(one) for one in value)
    return value


def _open_key(key: Any) -> Any:
    """Opened index; lists are refused, as they are arrays of the host."""
    if isinstance(key, list) or (isinstance(key, tuple) and any(isinstance(part, list) for part in key)):
        msg = "a list as an index of a device array; upload it"
        raise TypeError(msg)
    return _open(key)


def _close(result: Any, *sources: DeviceArray) -> Any:
    """Results as device arrays: views of their sources, or in memory of their own."""
    if isinstance(result, tuple | list):
        return tuple(_close(one, *sources) for one in result)
    if not isinstance(result, np.ndarray | np.generic):
        return _close(np.asarray(result), *sources)
    values = np.asarray(result)
    for source in sources:
        if values.size and np.may_share_memory(values, source.values):
            return DeviceArray(values, source.owner)
    return DeviceArray(*guard(values))
