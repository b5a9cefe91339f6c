"""An incremental encoder in quadrature, from exact motion to clock-stamped edges.

Edge n stands at (n + offset[n mod 4]) counts, and cell n is the half-open stretch from edge n to edge n + 1. Moving up,
edge n raises A, raises B, lowers A, lowers B for n mod 4 = 0, 1, 2, 3. So the levels (A, B) go 00 -> 10 -> 11 -> 01 ->
00, and each edge is one count of +1. A count's number is the number of its cell. The offsets are the errors of a real
scale: B out of its quarter period (phase), and high longer than low (duty). A `Scale` has the errors that do not repeat
every four edges. `Lines` has the effects on the way to the pins. None means neither; then nothing of them is compiled.

An edge carries the number of the clock at which a register at the pin first holds the new level. At clock n the
register sees the position at time n / clock_hz. So an edge passed at time t upwards is stamped ceil(t clock_hz), and
downwards floor(t clock_hz) + 1: exactly at the edge the position belongs to the upper cell.

With hysteresis h, cell n begins h/2 below its lower edge and ends h/2 above its upper one. So cells overlap, and the
handle leaves its present cell at an end of that cell.
"""

import math
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled, inlined
from .lines import Lines, shown_s
from .scale import Scale, displacement, near

# The least distance (counts) from one edge to the next: a closer pair is a glitch rather than quadrature.
MARGIN = 0.05


class Encoder(NamedTuple):
    """The scale and the clock that samples its outputs."""

    count_m: float  # distance from one edge to the next on an ideal scale, > 0
    clock_hz: float  # > 0
    offsets: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # counts: A rise, B rise, A fall, B fall
    scale: Scale | None = None
    lines: Lines | None = None


class Errors(NamedTuple):
    """The errors of an encoder: fields of `Encoder`, in its order."""

    offsets: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    scale: Scale | None = None
    lines: Lines | None = None


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


@inlined
def _displaced(scale, number, place):
    """Return the place (counts) of an edge that would be at `place` without the errors of the scale."""
    if scale is None:
        return place
    return place + displacement(scale, number)


@compiled
def edge(encoder, number):
    """Return the position (m) of edge `number`."""
    return _displaced(encoder.scale, number, number + encoder.offsets[number & 3]) * encoder.count_m


@inlined
def _guess(scale, counts):
    """Return the number of a cell near a place (counts)."""
    if scale is None:
        return math.floor(counts)
    return near(scale, counts)


@inlined
def _slack_m(scale, count_m):
    """Return how far a cell goes on beyond each of its edges (m)."""
    if scale is None:
        return 0.0
    return 0.5 * scale.hysteresis * count_m


@compiled
def _number(encoder, position_m):
    """Return the number of the cell that holds a position, without hysteresis."""
    number = _guess(encoder.scale, position_m / encoder.count_m - encoder.offsets[0])
    while position_m < edge(encoder, number):
        number -= 1
    while position_m >= edge(encoder, number + 1):
        number += 1
    return number


@compiled
def _cell(encoder, number):
    """Return the `Cell` of a number."""
    slack_m = _slack_m(encoder.scale, encoder.count_m)
    return Cell(number, edge(encoder, number) - slack_m, edge(encoder, number + 1) + slack_m)


@compiled
def locate(encoder, position_m):
    """Return the `Cell` that holds a position, without regard to hysteresis."""
    return _cell(encoder, _number(encoder, position_m))


@compiled
def numbers_from(encoder, cell, positions):
    """Return the numbers of the cells of an array of positions (m) that a handle meets in this order, from a cell on.

    With hysteresis a cell depends on the way; a turn between two of the positions is not seen.
    """
    numbers = np.zeros(len(positions), np.int64)
    slack_m = _slack_m(encoder.scale, encoder.count_m)
    for k in range(len(positions)):
        position_m = positions[k]
        if position_m >= cell.upper_m:
            cell = _cell(encoder, _number(encoder, position_m - slack_m))
        elif position_m < cell.lower_m:
            cell = _cell(encoder, _number(encoder, position_m + slack_m))
        numbers[k] = cell.number
    return numbers


@compiled
def number_at(encoder, positions):
    """Return the numbers of the cells at an array of positions (m): an encoder's counts there.

    With hysteresis the positions are met in this order; the first cell is found without hysteresis.
    """
    return numbers_from(encoder, locate(encoder, positions[0] if len(positions) else 0.0), positions)


@compiled
def level(number):
    """Return the pins in cell `number` as the word a | b << 1: the Gray code of number + 1."""
    quarter = (number + 1) & 3
    return quarter ^ (quarter >> 1)


@inlined
def _stepped(encoder, scale, cell, upwards):
    """Return the cell above if `upwards`, else the cell below; without a scale one of its edges is known."""
    if scale is not None:
        return _cell(encoder, cell.number + 1 if upwards else cell.number - 1)
    if upwards:
        return Cell(cell.number + 1, cell.upper_m, edge(encoder, cell.number + 2))
    return Cell(cell.number - 1, edge(encoder, cell.number - 1), cell.lower_m)


@compiled
def next_cell(encoder, cell, upwards):
    """Return the cell above if `upwards`, else the cell below."""
    return _stepped(encoder, encoder.scale, cell, upwards)


@inlined
def _clamped(lines, clock, clocks):
    """Return a clock of an interval within 1 to `clocks`, against rounding; lines may show an edge later than that."""
    if lines is None:
        return min(max(clock, 1), clocks)
    return max(clock, 1)


@compiled
def stamp(encoder, cell, upwards, at_s, interval):
    """Return the clock at which the pins change as a cell is left upwards or downwards, `at_s` into an interval.

    It is within the interval, unless the encoder has lines, which show edges later: `lines.carry` puts them in order.
    """
    passed = cell.number + 1 if upwards else cell.number
    at = shown_s(encoder.lines, interval.clock, passed, upwards, at_s) * encoder.clock_hz
    return interval.clock + _clamped(encoder.lines, math.ceil(at) if upwards else math.floor(at) + 1, interval.clocks)
