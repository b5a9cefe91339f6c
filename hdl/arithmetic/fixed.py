"""Fixed-point formats as Amaranth shapes, and the named ways a value may narrow."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Const, Mux, Shape, Value

from hardwall.model.arithmetic.fixed import Format


def shape(fmt: Format) -> Shape:
    """Return the shape that holds a word of `fmt`."""
    return Shape(fmt.width, signed=fmt.signed)


def saturate(value: Value, low: int, high: int) -> Value:
    """Return `value` held within the constants `low` to `high`, as wide as the widest of the three."""
    return Mux(value < low, Const(low), Mux(value > high, Const(high), value))


def shift_floor(value: Value, shift: int) -> Value:
    """Return floor(value * 2**-shift); a negative shift is exact."""
    return value >> shift if shift >= 0 else value << -shift


def shift_round_half_up(value: Value, shift: int) -> Value:
    """Return floor(value * 2**-shift + 1/2); a negative shift is exact."""
    return (value + (1 << (shift - 1))) >> shift if shift > 0 else value << -shift


def length_of(value: Value) -> Value:
    """Return the number of bits of an unsigned `value`: the least n with value < 2**n."""
    if len(value) == 1:
        return value
    half = len(value) // 2
    return Mux(value[half:].any(), half + length_of(value[half:]), length_of(value[:half]))


def at_most(value: Value, bits: int) -> Value:
    """Return an unsigned `value`, or the largest word of `bits` bits if `value` is larger."""
    return Mux(value[bits:].any(), (1 << bits) - 1, value[:bits])


def fitted(value: Value, bits: int) -> Value:
    """Return a signed `value` held within `bits` of two's complement: its top bits decide, no comparison is needed."""
    if len(value) <= bits:
        return value
    held = Mux(value[-1], -1 << (bits - 1), (1 << (bits - 1)) - 1)
    return Mux(fits(value, bits), value[:bits].as_signed(), held)


def fits(value: Value, bits: int) -> Value:
    """Return whether a signed `value` is within `bits` of two's complement."""
    top = value[bits - 1 :]
    return ~top.any() | top.all()


def held(value: Value, down: int, width: int) -> Value:
    """Return a signed value without its `down` lowest bits, held within the words of `width` bits but the least."""
    floor, most = value[down:], (1 << width - 1) - 1
    least = floor[width - 1] & ~floor[: width - 1].any()
    return Mux(fits(floor, width) & ~least, floor[:width].as_signed(), Mux(value[-1], -most, most))


def less(value: Value, bound: int) -> Value:
    """Return whether an unsigned value is less than a constant, without a chain of carries."""
    if bound >> len(value):
        return Const(1)
    below = Const(0, 1)
    for bit, each in enumerate(value):
        below = ~each | below if bound >> bit & 1 else ~each & below
    return below


def negated(value: Value, negative: Value) -> Value:
    """Return the value, or -value where `negative` is high, a bit wider: the complement of one less is one sum."""
    lowered = value - negative
    return lowered ^ negative.replicate(len(lowered)).as_signed()


def not_above(complement: Value, limit: Value) -> Value:
    """Return whether a number is at most the limit, both unsigned, from the number's complement.

    A comparison subtracts, which adds a complement and one: given the complement, it needs no inverters.
    """
    width = max(len(complement), len(limit))
    number = Cat(complement, Const(1, 1).replicate(width - len(complement)))
    return (Cat(Const(1, 1), number) + Cat(Const(1, 1), limit))[width + 1]


def below(complement: Value, limit: Value) -> Value:
    """Return whether a number is less than the limit, as `not_above` does; the difference of equals is one too few."""
    width = max(len(complement), len(limit))
    return (Cat(complement, Const(1, 1).replicate(width - len(complement))) + limit)[width]


def choice(reached: Value, values: Sequence[Value]) -> Value:
    """Return the value of four whose number has been reached: bit n - 1 says whether it is at least n."""
    return Mux(reached[1], Mux(reached[2], values[3], values[2]), Mux(reached[0], values[1], values[0]))
