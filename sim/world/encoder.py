"""An incremental encoder in quadrature, from exact motion to clock-stamped edges.

Edge n stands at (n + offset[n mod 4]) counts, and cell n is the half-open stretch from edge n to edge n + 1. Moving
up, edge n raises A, raises B, lowers A, lowers B for n mod 4 = 0, 1, 2, 3, so the levels (A, B) go
00 -> 10 -> 11 -> 01 -> 00 and each edge is one count of +1; a count's number is the number of its cell. The offsets
are the errors of a real scale: B out of its quarter period (phase), and high longer than low (duty).

An edge carries the number of the clock at which a register at the pin first holds the new level. At clock n the
register sees the position at time n / clock_hz, so an edge passed at time t upwards is stamped ceil(t clock_hz), and
downwards floor(t clock_hz) + 1: at the very edge the position belongs to the upper cell.
"""

import math
from typing import NamedTuple

import numpy as np

from ...model.compiled import compiled

# The least distance (counts) from one edge to the next: a closer pair is a glitch rather than quadrature.
MARGIN = 0.05


class Encoder(NamedTuple):
    """The scale and the clock that samples its outputs."""

    count_m: float  # distance from one edge to the next on an ideal scale, > 0
    clock_hz: float  # > 0
    offsets: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # counts: A rise, B rise, A fall, B fall


class Cell(NamedTuple):
    """The cell of the scale that holds the position: `lower_m` <= position < `upper_m`."""

    number: int
    lower_m: float
    upper_m: float


def offsets(phase_error_counts=0.0, duty_error_counts: float = 0.0) -> tuple[float, float, float, float]:
    """Return the `Encoder.offsets` (counts) of a scale with these errors.

    Args:
        phase_error_counts: the number of counts by which channel B is late against A in upward motion; or four
            numbers, one for each edge kind A rise, B rise, A fall, B fall.
        duty_error_counts: the excess of the high part of both channels over 2 counts; the rises come half of it
            earlier and the falls half later.

    Raises:
        ValueError: if any edge would not follow the edge before it by at least 0.05 counts.
    """
    phase = phase_error_counts
    late = (0.0, phase, 0.0, phase) if isinstance(phase, int | float) else tuple(phase)
    if len(late) != 4:
        raise ValueError(f"phase_error_counts must be one number or four, not {phase!r}")
    half = duty_error_counts / 2
    result = tuple(float(kind + error) for kind, error in zip(late, (-half, -half, half, half), strict=True))
    gaps = [1 + result[(kind + 1) % 4] - result[kind] for kind in range(4)]
    if not all(gap >= MARGIN for gap in gaps):  # `not all`, so that a NaN is refused
        raise ValueError(
            f"phase_error_counts and duty_error_counts must leave each edge at least {MARGIN} counts after the one "
            f"before (a single phase error: {MARGIN - 1} to {1 - MARGIN} - |duty error|), "
            f"not {(phase, duty_error_counts)!r}"
        )
    return result


@compiled
def edge(encoder, number):
    """Return the position (m) of edge `number`."""
    return (number + encoder.offsets[number & 3]) * encoder.count_m


@compiled
def locate(encoder, position_m):
    """Return the `Cell` that holds a position."""
    number = math.floor(position_m / encoder.count_m - encoder.offsets[0])
    while position_m < edge(encoder, number):
        number -= 1
    while position_m >= edge(encoder, number + 1):
        number += 1
    return Cell(number, edge(encoder, number), edge(encoder, number + 1))


@compiled
def number_at(encoder, positions):
    """Return the numbers of the cells that hold an array of positions (m): the counts that an encoder has there."""
    numbers = np.zeros(len(positions), np.int64)
    for k in range(len(positions)):
        numbers[k] = locate(encoder, positions[k]).number
    return numbers


@compiled
def level(number):
    """Return the pins in cell `number` as the word a | b << 1: the Gray code of number + 1."""
    quarter = (number + 1) & 3
    return quarter ^ (quarter >> 1)


@compiled
def next_cell(encoder, cell, upwards):
    """Return the cell above if `upwards`, else the cell below."""
    if upwards:
        return Cell(cell.number + 1, cell.upper_m, edge(encoder, cell.number + 2))
    return Cell(cell.number - 1, edge(encoder, cell.number - 1), cell.lower_m)


@compiled
def stamp(encoder, upwards, at_s, clocks):
    """Return the clock of an edge passed `at_s` into an interval, counted from the interval's first: 1 to `clocks`.

    The result is clamped to that range, because rounding may put it outside.
    """
    at = at_s * encoder.clock_hz
    return min(max(math.ceil(at) if upwards else math.floor(at) + 1, 1), clocks)
