"""The virtual wall, an axis a clock."""

from collections.abc import Callable

from amaranth.hdl import C, Cat, Mux, Value

from hardwall.model.axis.wall import Design

from ..arithmetic.fixed import shift_floor
from .pipe import Pipe

PART_BITS = 17
"""Bits of an operand that one multiplier of 18 bits takes, without the sign."""


def force(
    pipe: Pipe, design: Design, stage: int, count: Value, velocity: Value, word: Callable[[str, int], Value]
) -> Value:
    """Return the force of `hardwall.hdl.axis.wall`, of a count and a velocity in that stage, 5 stages later.

    Args:
        word: returns a run-time word of the axis that is in a stage, by the name of the word and the stage.
    """
    left, position = word("wall_left", stage), word("wall_position", stage)
    offset = Mux(left, position - count, count - position)
    coarse = shift_floor(velocity, design.velocity.f - design.coarse.f)
    depth = pipe.taken(offset[: design.depth.width].as_signed(), "depth")
    inward = pipe.taken(Mux(left, -coarse, coarse), "inward")
    left, forbid_pull = pipe.later(left, 4), word("wall_forbid_pull", stage + 4)
    inside = pipe.later(depth > 0, 3)

    spring_shift = design.push - design.stiffness.f
    damper_shift = design.push - design.damping.f - design.coarse.f
    half = 1 << (design.push - 1) if design.push > 0 else 0
    # Half a force LSB is added, so that rounding the sum down rounds half up.
    spring = pipe.taken((_product(pipe, word("wall_stiffness", stage + 1), depth) << spring_shift) + half, "spring")
    damper = pipe.taken(_product(pipe, word("wall_damping", stage + 1), inward) << damper_shift, "damper")
    total = pipe.taken(spring + damper, "total")

    # The sign and the limits are computed in parallel: either alone is a carry chain.
    top, rounded = design.force.max, shift_floor(total, design.push)
    push = rounded[: design.force.width].as_signed()
    above, below = rounded > top, Mux(forbid_pull, rounded < 0, rounded < -top)
    limit = Mux(below & forbid_pull, 0, Mux(above == left, top, -top))
    rendered = Mux(inside, Mux(above | below, limit, Mux(left, push, -push)), 0)
    return pipe.taken(rendered[: design.force.width].as_signed(), "force")


def _product(pipe: Pipe, gain: Value, operand: Value) -> Value:
    """Return an unsigned gain times a signed operand, in the next stage: every part of the operand has a multiplier."""
    factor, parts = Cat(gain, C(0, 1)).as_signed(), []
    for low in range(0, len(operand) - 1, PART_BITS):
        last = low + PART_BITS >= len(operand) - 1
        part = operand[low:] if last else Cat(operand[low : low + PART_BITS], C(0, 1))
        parts.append(pipe.taken(factor * part.as_signed(), "product") << low)
    return sum(parts[1:], start=parts[0])
