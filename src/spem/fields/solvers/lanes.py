"""Eight right-hand sides at a time: a row of an ``(n, 8)`` float32 array as one SIMD value in Numba kernels.

LLVM does not vectorise a loop over eight columns by itself, because it cannot prove that the arrays of a
kernel do not overlap. So the rows are loaded, combined and stored as LLVM vectors here, which every processor
runs with the widest instructions it has.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, models, register_model

from spem.fields.solvers.engine import LANES

_SINGLE = ir.VectorType(ir.FloatType(), LANES)
_DOUBLE = ir.VectorType(ir.DoubleType(), LANES)
# Multiplications and additions may be fused; nothing else about the arithmetic is relaxed.
_FLAGS = ("contract",)


class LanesType(types.Type):  # type: ignore[misc]
    """A vector of `LANES` numbers held in registers."""


single = LanesType(f"lanes_float32x{LANES}")
double = LanesType(f"lanes_float64x{LANES}")


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, numba_type: LanesType) -> None:
        super().__init__(manager, numba_type, _SINGLE if numba_type is single else _DOUBLE)


def _row_pointer(context: Any, builder: Any, array_type: Any, array: Any, row: Any) -> Any:
    """Pointer to the first lane of a row of a C-contiguous array of `LANES` columns."""
    data = context.make_array(array_type)(context, builder, array).data
    start = builder.gep(data, [builder.mul(row, ir.Constant(row.type, LANES))])
    vector = _SINGLE if array_type.dtype == types.float32 else _DOUBLE
    return builder.bitcast(start, vector.as_pointer())


@intrinsic
def load(typing_context: Any, array: Any, row: Any) -> Any:
    """Row `row` of a float32 or float64 array, at its own precision."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_row_pointer(context, builder, signature.args[0], *arguments))
        value.align = array.dtype.bitwidth // 8
        return value

    return (single if array.dtype == types.float32 else double)(array, types.intp), codegen


@intrinsic
def load_wide(typing_context: Any, array: Any, row: Any) -> Any:
    """Row `row` of a float32 or float64 array in double precision."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        value = builder.load(_row_pointer(context, builder, signature.args[0], *arguments))
        value.align = array.dtype.bitwidth // 8
        return value if array.dtype == types.float64 else builder.fpext(value, _DOUBLE)

    return double(array, types.intp), codegen


@intrinsic
def store(typing_context: Any, array: Any, row: Any, value: Any) -> Any:
    """Write a value to a row, rounded if the array is of single precision."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = _row_pointer(context, builder, signature.args[0], arguments[0], arguments[1])
        rounds = value is double and array.dtype == types.float32
        number = builder.fptrunc(arguments[2], _SINGLE) if rounds else arguments[2]
        builder.store(number, pointer).align = array.dtype.bitwidth // 8
        return context.get_dummy_value()

    return types.void(array, types.intp, value), codegen


def _binary(operation: str) -> Any:
    @intrinsic
    def apply(typing_context: Any, a: Any, b: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, operation)(*arguments, flags=_FLAGS)

        return a(a, a), codegen

    return apply


add = _binary("fadd")
sub = _binary("fsub")
mul = _binary("fmul")
div = _binary("fdiv")


@intrinsic
def splat(typing_context: Any, number: Any) -> Any:
    """Put the same number in all lanes, at its own precision."""
    vector = _SINGLE if number == types.float32 else _DOUBLE

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        undefined = ir.Constant(vector, ir.Undefined)
        index = ir.IntType(32)
        first = builder.insert_element(undefined, arguments[0], ir.Constant(index, 0))
        zeros = ir.Constant(ir.VectorType(index, LANES), [0] * LANES)
        return builder.shuffle_vector(first, undefined, zeros)

    return (single if number == types.float32 else double)(number), codegen


@intrinsic
def widen(typing_context: Any, value: Any) -> Any:
    """Single to double precision."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fpext(arguments[0], _DOUBLE)

    return double(single), codegen
