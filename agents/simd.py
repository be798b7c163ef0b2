"""Neurons side by side: a value type for compiled code that holds one number for each of W neurons.

A formula that is written for plain numbers, such as ``V + I - leak * V``, works on these values
unchanged and is then computed for all W neurons at once, in the processor's vector registers. So
each formula stands once and serves one neuron (W = 1: plain float64 and bool) and many. Each lane
sees the same IEEE operations in the same order as a plain number would: the same bits.

Compiled code obtains values from arrays whose rows hold W numbers, one for each lane:

    full(0.0, W)             the same number in every lane; W must be a constant of the code
    like(0.0, x)             the same number in as many lanes as x has
    load(block, row, x)      row `row` of `block`, shape (rows, W), in as many lanes as x has
    store(block, row, x)     the reverse
    unpack(Type, block, x)   a NamedTuple whose fields are the rows of `block`
    pack(block, t)           the reverse
    repeated(Type, x)        a NamedTuple whose fields are all x
    fitted(t, kinds)         the fields of `t`, each in the lanes and of the kind of that of `kinds`
    where(mask, x, y)        x where the mask holds, y elsewhere; both are evaluated
    seldom(mask, x, y)       as where, for a mask that seldom holds
    any_lane(mask)           whether the mask holds anywhere
    lanes_of(mask)           the lanes in which it holds, as bits of a number
    next_lane(lanes)         the lowest of them
    negated(mask)            where it does not hold
    multiply_add(x, y, z)    x·y + z, rounded once
    times_two_to_the(x, n)   x·2**n, n a whole number plus WHOLE
    whole_power(x, n)        x**n by repeated squaring, n a whole number
    power(x, y)              x**y; one call of the C library per lane

Comparisons give masks, to be joined by ``&`` and ``|``; in arithmetic a mask counts 1 where it
holds and 0 elsewhere, and as a condition a number holds where it is not 0. Also ``-x``, ``x**2``,
``abs``, ``min``, ``max`` and ``exp``, ``log``, ``sqrt`` of math and NumPy work; `exp` and `log`
call the C library once per lane.

Rows are read and written by their addresses. With GNM_CHECKED=1 in the environment (see
`gnm_env.compiled`) a row or a lane outside the array raises IndexError.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit
from numba.core import cgutils, types
from numba.core.errors import TypingError
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, overload, register_model

from gnm_env.compiled import CHECKED

_intrinsic: Any = intrinsic  # called from compiled code, without the typing context
_DOUBLE = ir.DoubleType()
_BIT = ir.IntType(1)
_INT32 = ir.IntType(32)
_INTP = types.intp


class Lanes(types.Type):
    """One float64 for each of `width` neurons."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes({width})")


class Mask(types.Type):
    """One truth value for each of `width` neurons."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, ir.VectorType(_DOUBLE, lanes.width))


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, mask: Mask) -> None:
        super().__init__(manager, mask, ir.VectorType(_BIT, mask.width))


def _width(type_: types.Type) -> int:
    return type_.width if isinstance(type_, (Lanes, Mask)) else 1


def _lanes(width: int) -> types.Type:
    return Lanes(width) if width > 1 else types.float64


def _vector(width: int) -> ir.Type:
    return ir.VectorType(_DOUBLE, width) if width > 1 else _DOUBLE


def _splat(builder: Any, number: Any, width: int) -> Any:
    """LLVM's way to put one number into every lane."""
    if width == 1:
        return number
    vector = ir.VectorType(number.type, width)
    undefined = ir.Constant(vector, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(_INT32, 0))
    zeros = ir.Constant(ir.VectorType(_INT32, width), [0] * width)
    return builder.shuffle_vector(one, undefined, zeros)


def _spread(context: Any, builder: Any, value: Any, type_: Any, width: int) -> Any:
    if isinstance(type_, Lanes):
        return value
    if isinstance(type_, Mask):
        return builder.uitofp(value, _vector(width))
    number = context.cast(builder, value, types.unliteral(type_), types.float64)
    return _splat(builder, number, width)


def _spread_mask(context: Any, builder: Any, value: Any, type_: Any, width: int) -> Any:
    """A mask, or where a number is not 0, as Python has it."""
    if isinstance(type_, Mask):
        return value
    if isinstance(type_, types.Boolean):
        return _splat(builder, value, width)
    number = _spread(context, builder, value, type_, width)
    return builder.fcmp_unordered("!=", number, _splat(builder, ir.Constant(_DOUBLE, 0.0), width))


def _condition(context: Any, builder: Any, value: Any, type_: Any) -> Any:
    """What `where` chooses by: one truth value, or one for each lane."""
    return _spread_mask(context, builder, value, type_, _width(type_))


_PLAIN = (types.Float, types.Integer, types.Boolean)
_SIDE_BY_SIDE = (Lanes, Mask)
_PAIRS = [
    *((left, right) for left in _SIDE_BY_SIDE for right in _SIDE_BY_SIDE),
    *(pair for x in _SIDE_BY_SIDE for n in _PLAIN for pair in ((x, n), (n, x))),
]


def _binary(op: Any, result: Callable[[int], types.Type], emit: Callable[..., Any]) -> None:
    """Teach numba the operator `op` between lanes, or between lanes and a plain number."""

    @infer_global(op)
    class _Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            lanes = [a for a in args if isinstance(a, _SIDE_BY_SIDE)]
            known = (*_SIDE_BY_SIDE, *_PLAIN)
            if len(args) == 2 and lanes and all(isinstance(a, known) for a in args):
                return signature(result(lanes[0].width), *args)
            return None

    def implement(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        pair = zip(args, sig.args, strict=True)
        return emit(builder, *(_spread(context, builder, v, t, width) for v, t in pair))

    for left, right in _PAIRS:
        lower_builtin(op, left, right)(implement)


for _name, _emit in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    for _op in (getattr(operator, _name), getattr(operator, f"i{_name}")):
        _binary(_op, Lanes, lambda b, x, y, _emit=_emit: getattr(b, _emit)(x, y))

for _name, _symbol in (
    ("ge", ">="),
    ("gt", ">"),
    ("le", "<="),
    ("lt", "<"),
    ("eq", "=="),
):
    _binary(
        getattr(operator, _name),
        Mask,
        lambda b, x, y, _symbol=_symbol: b.fcmp_ordered(_symbol, x, y),
    )
# NaN differs from every number, itself included, as for plain numbers.
_binary(operator.ne, Mask, lambda b, x, y: b.fcmp_unordered("!=", x, y))


def _logical(op: Any, emit: Callable[..., Any]) -> None:
    @infer_global(op)
    class _Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            masks = [a for a in args if isinstance(a, Mask)]
            if len(args) == 2 and masks and all(isinstance(a, (Mask, types.Boolean)) for a in args):
                return signature(masks[0], *args)
            return None

    def implement(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        pair = zip(args, sig.args, strict=True)
        return emit(builder, *(_spread_mask(context, builder, v, t, width) for v, t in pair))

    for left, right in ((Mask, Mask), (Mask, types.Boolean), (types.Boolean, Mask)):
        lower_builtin(op, left, right)(implement)


for _name in ("and_", "or_", "xor"):
    for _op in (getattr(operator, _name), getattr(operator, f"i{_name.rstrip('_')}")):
        _logical(_op, lambda b, x, y, _emit=_name: getattr(b, _emit)(x, y))


@_intrinsic
def where(typing_context: Any, mask: Any, x: Any, y: Any) -> Any:
    """`x` in the lanes where `mask` holds, `y` in the others."""
    # One condition for all lanes chooses between whole values.
    width = max(map(_width, (mask, x, y)))
    if all(isinstance(value, (Mask, types.Boolean)) for value in (x, y)):
        return (Mask(width) if width > 1 else types.boolean)(mask, x, y), _select_masks

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        values = zip(args[1:], sig.args[1:], strict=True)
        mask = _condition(context, builder, args[0], sig.args[0])
        return builder.select(mask, *(_spread(context, builder, v, t, width) for v, t in values))

    return _lanes(width)(mask, x, y), generate


def _select_masks(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    width = _width(sig.return_type)
    pair = zip(args[1:], sig.args[1:], strict=True)
    masks = (_spread_mask(context, builder, v, t, width) for v, t in pair)
    return builder.select(_condition(context, builder, args[0], sig.args[0]), *masks)


@_intrinsic
def seldom(typing_context: Any, mask: Any, x: Any, y: Any) -> Any:
    """As `where`, for masks that seldom hold and what the next bin waits for.

    Alone it is a branch that the processor foretells, so that nothing has to wait for the mask.
    """
    width = max(map(_width, (mask, x, y)))

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pair = zip(args[1:], sig.args[1:], strict=True)
        chosen, usual = (_spread(context, builder, v, t, width) for v, t in pair)
        if width > 1:
            return builder.select(args[0], chosen, usual)
        before = builder.block
        taken, after = builder.append_basic_block(), builder.append_basic_block()
        builder.cbranch(args[0], taken, after).set_weights([1, 2000])
        builder.position_at_end(taken)
        builder.branch(after)
        builder.position_at_end(after)
        result = builder.phi(_DOUBLE)
        result.add_incoming(chosen, taken)
        result.add_incoming(usual, before)
        return result

    return _lanes(width)(mask, x, y), generate


@_intrinsic
def any_lane(typing_context: Any, mask: Any) -> Any:
    """Whether `mask` holds in any lane."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if not isinstance(mask, Mask):
            return args[0]
        bits = ir.IntType(mask.width)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), ir.Constant(bits, 0))

    return types.boolean(mask), generate


@_intrinsic
def lanes_of(typing_context: Any, mask: Any) -> Any:
    """A whole number whose bit k says whether `mask` holds in lane k; see `next_lane`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(_width(mask)))
        return builder.zext(bits, ir.IntType(64))

    return types.int64(mask), generate


@_intrinsic
def next_lane(typing_context: Any, lanes: Any) -> Any:
    """The lowest lane of `lanes_of`, which must not be 0; `lanes & (lanes - 1)` leaves it out."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.cttz(args[0], ir.Constant(_BIT, 1))

    return types.int64(types.int64), generate


@_intrinsic
def negated(typing_context: Any, mask: Any) -> Any:
    """Where `mask` does not hold (``~`` of a plain bool is a number, hence this function)."""
    width = _width(mask)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.not_(_condition(context, builder, args[0], sig.args[0]))

    return (Mask(width) if width > 1 else types.boolean)(mask), generate


def _row_address(
    context: Any, builder: Any, array_type: Any, array: Any, row: Any, width: int
) -> Any:
    structure = context.make_array(array_type)(context, builder, array)
    if CHECKED:
        sizes = [*cgutils.unpack_tuple(builder, structure.shape), context.get_constant(_INTP, 1)]
        cgutils.do_boundscheck(context, builder, row, sizes[0])
        cgutils.do_boundscheck(context, builder, context.get_constant(_INTP, width - 1), sizes[1])
    if array_type.layout == "C" and array_type.ndim == 2:
        # Rows of a block that is no part of a wider one hold `width` numbers: known beforehand.
        return builder.gep(structure.data, [builder.mul(row, context.get_constant(_INTP, width))])
    stride = cgutils.unpack_tuple(builder, structure.strides)[0]
    data = builder.bitcast(structure.data, ir.IntType(8).as_pointer())
    return builder.gep(data, [builder.mul(stride, row)])


def _load_row(context: Any, builder: Any, array_type: Any, array: Any, row: Any, width: int) -> Any:
    address = _row_address(context, builder, array_type, array, row, width)
    value = builder.load(builder.bitcast(address, _vector(width).as_pointer()))
    value.align = 8  # rows are aligned as their numbers are, not as whole vectors
    return value


def _store_row(context: Any, builder: Any, array: Any, value: Any, row: Any, x: Any) -> None:
    width = x.type.count if isinstance(x.type, ir.VectorType) else 1
    address = _row_address(context, builder, array, value, row, width)
    builder.store(x, builder.bitcast(address, x.type.as_pointer())).align = 8


@_intrinsic
def load(typing_context: Any, block: Any, row: Any, x: Any) -> Any:
    """Row `row` of the float64 array `block` of shape (rows, W), W the lanes of `x`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _load_row(context, builder, sig.args[0], args[0], args[1], _width(x))

    return _lanes(_width(x))(block, types.intp, x), generate


@_intrinsic
def store(typing_context: Any, block: Any, row: Any, x: Any) -> Any:
    """Write the lanes of `x` into row `row` of `block`."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        _store_row(context, builder, sig.args[0], args[0], args[1], args[2])
        return context.get_dummy_value()

    return types.void(block, types.intp, x), generate


@_intrinsic(prefer_literal=True)
def full(typing_context: Any, number: Any, width: Any) -> Any:
    """`number` in every lane."""
    lanes = width.literal_value

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _splat(builder, args[0], lanes)

    # The literal itself is part of the signature: widths must not share one implementation.
    return _lanes(lanes)(types.float64, width), generate


@_intrinsic
def like(typing_context: Any, number: Any, x: Any) -> Any:
    """`number` in as many lanes as `x` has."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _splat(builder, args[0], _width(x))

    return _lanes(_width(x))(types.float64, x), generate


def _named_tuple(type_: Any, x: Any) -> Any:
    cls = type_.instance_class
    return types.BaseTuple.from_types([_lanes(_width(x))] * len(cls._fields), cls)


@_intrinsic
def unpack(typing_context: Any, type_: Any, block: Any, x: Any) -> Any:
    """A `type_` (a NamedTuple class) whose fields are the rows of `block`, in order."""
    result = _named_tuple(type_, x)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = [context.get_constant(types.intp, k) for k in range(len(result))]
        fields = [_load_row(context, builder, sig.args[1], args[1], row, _width(x)) for row in rows]
        return context.make_tuple(builder, result, fields)

    return result(type_, block, x), generate


@_intrinsic
def pack(typing_context: Any, block: Any, x: Any) -> Any:
    """Write the fields of the NamedTuple `x` into the rows of `block`, in order."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        for k, field in enumerate(cgutils.unpack_tuple(builder, args[1])):
            row = context.get_constant(types.intp, k)
            _store_row(context, builder, sig.args[0], args[0], row, field)
        return context.get_dummy_value()

    return types.void(block, x), generate


@_intrinsic
def repeated(typing_context: Any, type_: Any, x: Any) -> Any:
    """A `type_` (a NamedTuple class) whose fields are all `x`."""
    result = _named_tuple(type_, x)

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return context.make_tuple(builder, result, [args[1]] * len(result))

    return result(type_, x), generate


@_intrinsic
def fitted(typing_context: Any, t: Any, kinds: Any) -> Any:
    """The fields of `t` as a tuple of the type of `kinds`: numbers and masks, in all its lanes.

    So a step may return a constant, or a mask where a number belongs; what fits costs nothing.
    """
    given: Any = t
    if not isinstance(t, types.BaseTuple) or len(given) != len(kinds):
        raise TypingError(f"{t} has not the fields of {kinds}")

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if t == kinds:
            return args[0]
        fields = []
        for k, value in enumerate(cgutils.unpack_tuple(builder, args[0])):
            kind = kinds[k]
            spread = _spread_mask if isinstance(kind, (Mask, types.Boolean)) else _spread
            fields.append(spread(context, builder, value, given[k], _width(kind)))
        return context.make_tuple(builder, kinds, fields)

    return kinds(t, kinds), generate


@_intrinsic
def multiply_add(typing_context: Any, x: Any, y: Any, z: Any) -> Any:
    """x·y + z, rounded once: the same bits on every processor, in one step on most."""
    width = max(map(_width, (x, y, z)))

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        name = f"llvm.fma.v{width}f64" if width > 1 else "llvm.fma.f64"
        type_ = ir.FunctionType(_vector(width), [_vector(width)] * 3)
        function = cgutils.get_or_insert_function(builder.module, type_, name)
        values = zip(args, sig.args, strict=True)
        return builder.call(function, [_spread(context, builder, v, t, width) for v, t in values])

    return _lanes(width)(x, y, z), generate


WHOLE = 1.5 * 2.0**52
"""x + WHOLE is x rounded to a whole number, in the last bits of the sum; less WHOLE it is a number
again. For |x| < 2**51."""


@_intrinsic
def times_two_to_the(typing_context: Any, x: Any, shifted: Any) -> Any:
    """x·2**n for `shifted` = n + WHOLE; x and the product must be normal numbers, not 0."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = _width(x)
        number = ir.IntType(64)
        bits = ir.VectorType(number, width) if width > 1 else number
        places = ir.Constant(bits, [52] * width if width > 1 else 52)
        value, n = (builder.bitcast(arg, bits) for arg in args)
        return builder.bitcast(builder.add(value, builder.shl(n, places)), _vector(width))

    return x(x, x), generate


@_intrinsic
def power(typing_context: Any, x: Any, y: Any) -> Any:
    """x**y, lane by lane: the C library's `pow`, whatever the number of lanes."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _called(builder, "llvm.pow", args, _width(x))

    return x(x, y), generate


def _called(builder: Any, name: str, args: Any, width: int) -> Any:
    """What LLVM's function `name` gives for each lane: one call of the C library each."""
    function = builder.module.declare_intrinsic(name, [_DOUBLE])
    if width == 1:
        return builder.call(function, args)
    result = ir.Constant(ir.VectorType(_DOUBLE, width), ir.Undefined)
    for k in range(width):
        lane = ir.Constant(_INT32, k)
        number = builder.call(function, [builder.extract_element(a, lane) for a in args])
        result = builder.insert_element(result, number, lane)
    return result


def _of_each(name: str) -> Any:
    @_intrinsic
    def function(typing_context: Any, x: Any) -> Any:
        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return _called(builder, name, args, _width(x))

        return x(x), generate

    return function


def _teach_function(function: Any, name: str) -> None:
    """Teach numba `function` of lanes, LLVM's `name` of each."""
    each = _of_each(name)

    @overload(function, strict=False)
    def of_lanes(x: Any) -> Any:
        return (lambda x: each(x)) if isinstance(x, Lanes) else None


for _name, _functions in (
    ("llvm.exp", (math.exp, np.exp)),
    ("llvm.log", (math.log, np.log)),
    ("llvm.sqrt", (math.sqrt, np.sqrt)),
):
    for _function in _functions:
        _teach_function(_function, _name)


def _absolute(x: Any) -> Any:
    return (lambda x: where(x < 0.0, -x, x + 0.0)) if isinstance(x, Lanes) else None


_absolutes: tuple[Any, ...] = (abs, np.abs, np.fabs, math.fabs)
for _function in _absolutes:
    overload(_function, strict=False)(_absolute)


@overload(min, strict=False)
def _smallest(x: Any, y: Any, *others: Any) -> Any:
    if not any(isinstance(value, Lanes) for value in (x, y, *others)):
        return None
    if others:
        return lambda x, y, *others: min(min(x, y), *others)
    return lambda x, y: where(y < x, y, x)


@overload(max, strict=False)
def _largest(x: Any, y: Any, *others: Any) -> Any:
    if not any(isinstance(value, Lanes) for value in (x, y, *others)):
        return None
    if others:
        return lambda x, y, *others: max(max(x, y), *others)
    return lambda x, y: where(y > x, y, x)


@overload(operator.neg, strict=False)
def _negative(x: Any) -> Any:
    return (lambda x: x * -1.0) if isinstance(x, Lanes) else None


@overload(operator.pos, strict=False)
def _itself(x: Any) -> Any:
    return (lambda x: x) if isinstance(x, Lanes) else None


def _to_the_power(x: Any, y: Any) -> Any:
    if isinstance(x, Lanes) and isinstance(y, types.Integer):
        return lambda x, y: whole_power(x, y)
    if isinstance(x, Lanes):
        return lambda x, y: power(x, where(x == x, y, y))
    if isinstance(y, Lanes):
        return lambda x, y: power(like(x, y), y)
    return None


for _op in (operator.pow, operator.ipow):
    overload(_op, strict=False)(_to_the_power)


@njit
def whole_power(x: Any, exponent: int) -> Any:
    """x**exponent by repeated squaring, as plain numbers are raised to a constant."""
    result = like(1.0, x)
    rest = abs(exponent)
    while rest > 0:
        if rest & 1:
            result = result * x
        x = x * x
        rest >>= 1
    return 1.0 / result if exponent < 0 else result
