"""Fixed-point formats as Amaranth shapes, and the named ways a value may narrow; twin of `hardwall.model.fixed`."""

from amaranth.hdl import Const, Mux, Shape, Value

from hardwall.model.fixed import Format


def shape(fmt: Format) -> Shape:
    """Return the shape that holds a word of `fmt`."""
    return Shape(fmt.width, signed=fmt.signed)


def saturate(value: Value, low: int, high: int) -> Value:
    """Return `value` held within the constants `low` to `high`; as wide as the wider of the three."""
    return Mux(value < low, Const(low), Mux(value > high, Const(high), value))


def shift_floor(value: Value, shift: int) -> Value:
    """Return floor(value * 2**-shift); a negative shift is exact."""
    return value >> shift if shift >= 0 else value << -shift


def shift_round_half_up(value: Value, shift: int) -> Value:
    """Return floor(value * 2**-shift + 1/2); a negative shift is exact."""
    return (value + (1 << (shift - 1))) >> shift if shift > 0 else value << -shift
