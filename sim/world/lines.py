"""The two lines from an encoder to the pins, and what happens to edges on them in time.

An edge that the handle passes at time t is shown at t + late + jitter. The jitter is normally distributed and cut at 4
sigma. `late` is these 4 sigma, because no edge is shown before it is passed. Each line has its own order of edges. A
glitch is a pulse that turns one line over for its length; glitches come at random times, independently of each other. A
line that dies keeps its level from then on.

An interpolator that samples its scale emits edges on a clock of its own: an edge waits for the next emission, and two
edges are shown at least a separation apart. So several edges that are passed between two emissions come as a burst.

Every change is a *toggle*: a clock and the line, 1 for A and 2 for B, whose level it turns over. So edges and glitches
that overtake each other need no more than an order in time. `carry` gives a loop the toggles of one interval after the
other, `carried` gives them for a whole record.
"""

import math
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled, inlined
from ...model.stamped import Edges, room_for
from .chance import normal, uniform
from .scale import CUT_SIGMAS

JITTER, GAPS, CHANNELS = 2, 3, 4
"""The streams of random numbers: of the jitter, of the times between glitches, and of the lines that they are on."""
A, B = 1, 2
ROUNDING = 1e-6
"""The rounding error, in clocks, by which a product of a time and a clock may exceed its true whole number."""


class Lines(NamedTuple):
    """The effects on the lines; times in seconds, infinite for never."""

    jitter_s: float  # sigma
    late_s: float
    emission_s: float  # the period of the emissions; 0 for none, and an edge is shown at once
    emission_phase: float  # the first emission, in periods
    separation_s: float  # the least time between two edges that are emitted
    glitch_gap_s: float  # the mean time from a glitch to the next one, on both lines together
    glitch_s: float  # the length of a glitch
    dead_a_s: float  # when the line dies
    dead_b_s: float
    seed: int


class Waiting(NamedTuple):
    """A loop's state of its lines from interval to interval, in arrays that `carry` writes to."""

    edges: Edges  # those of the loop: in go the edges that the handle passes, out come those of the pins
    toggles: Edges  # the clocks and lines of the toggles to come, in order
    marks: np.ndarray  # int64: how many these are, the level of the handle's cell, that of the pins, glitches so far
    next_s: np.ndarray  # float64: the beginning of the next glitch, and the earliest time of the next emitted edge


PENDING, TRUE, SHOWN, GLITCHES = range(4)
"""The elements of `Waiting.marks`."""
GLITCH, FREE = range(2)
"""The elements of `Waiting.next_s`."""


@inlined
def shown_s(lines, clock, number, upwards, at_s):
    """Return when an edge is shown (s) that is passed at `at_s`, from the same zero of time.

    Args:
        lines: the `Lines`; None for none, and the edge is shown as it is passed.
        clock, number, upwards: the clock from which the time is counted, the edge, and the direction of its passing;
            the jitter is a function of all three.
        at_s: the time (s).
    """
    if lines is None:
        return at_s
    return _jittered_s(lines, clock, number, upwards, at_s)


@compiled
def _jittered_s(lines, clock, number, upwards, at_s):
    if lines.jitter_s == 0.0:
        return at_s
    drawn = normal(lines.seed, JITTER, clock, 2 * number + int(upwards))
    return at_s + lines.late_s + lines.jitter_s * min(max(drawn, -CUT_SIGMAS), CUT_SIGMAS)


@compiled
def emitted_s(lines, passed_s, free_s):
    """Return when an edge is emitted (s) that would be shown at `passed_s`, and no earlier than `free_s`."""
    if lines.emission_s == 0.0:
        return passed_s
    number = math.ceil(passed_s / lines.emission_s - lines.emission_phase)
    return max((number + lines.emission_phase) * lines.emission_s, free_s)


@compiled
def gap_s(lines, number):
    """Return the time (s) from the glitch before to the beginning of glitch `number`, counted from 0."""
    return -lines.glitch_gap_s * math.log(uniform(lines.seed, GAPS, number, 0))


@compiled
def line_of(lines, number):
    """Return the line of glitch `number`, `A` or `B`."""
    return A if uniform(lines.seed, CHANNELS, number, 0) < 0.5 else B


@compiled
def _lives(lines, line, clock, clock_hz):
    """Return whether a line still follows its level at a clock."""
    dead_s = lines.dead_a_s if line == A else lines.dead_b_s
    return clock < dead_s * clock_hz


def waiting(lines: Lines | None, level: int, edges: Edges) -> Waiting | None:
    """Return what a loop keeps of lines at the start; None without lines.

    Args:
        lines: the lines.
        level: the level of the pins, a | b << 1.
        edges: the arrays of the loop's edges; as many toggles may be under way.
    """
    if lines is None:
        return None
    return Waiting(edges, room_for(len(edges.clocks)), np.array([0, level, level, 0]), np.array([gap_s(lines, 0), 0.0]))


@compiled
def _insert(kept, clock, line):
    """Add a toggle to the coming ones, after the toggles of the same clock; return whether there was room."""
    clocks, lines, count = kept.toggles.clocks, kept.toggles.levels, kept.marks[PENDING]
    if count == len(clocks):
        return False
    place = count
    while place > 0 and clocks[place - 1] > clock:
        clocks[place], lines[place] = clocks[place - 1], lines[place - 1]
        place -= 1
    clocks[place], lines[place] = clock, line
    kept.marks[PENDING] = count + 1
    return True


@compiled
def _take_glitches(lines, kept, until, clock_hz):
    """Take the glitches that begin up to clock `until`; return whether there was room for them."""
    while kept.next_s[GLITCH] * clock_hz <= until:
        number, begin_s = kept.marks[GLITCHES], kept.next_s[GLITCH]
        first, behind = math.ceil(begin_s * clock_hz), math.ceil((begin_s + lines.glitch_s) * clock_hz)
        line = line_of(lines, number)
        # A pulse that begins and ends between two clocks is seen by none.
        if first < behind and not (_insert(kept, first, line) and _insert(kept, behind, line)):
            return False
        kept.marks[GLITCHES] = number + 1
        kept.next_s[GLITCH] = begin_s + gap_s(lines, number + 1)
    return True


@compiled
def _show(lines, kept, n_edges, until, clock_hz):
    """Append the toggles up to clock `until` as edges of the pins; return their number, -1 if there is no room."""
    edges, toggles, marks = kept.edges, kept.toggles, kept.marks
    room, taken = min(len(edges.clocks), len(edges.levels)), 0
    while taken < marks[PENDING] and toggles.clocks[taken] <= until:
        clock, line = toggles.clocks[taken], toggles.levels[taken]
        taken += 1
        if not _lives(lines, line, clock, clock_hz):
            continue
        if n_edges == room:
            return -1
        marks[SHOWN] ^= line
        edges.clocks[n_edges], edges.levels[n_edges] = clock, marks[SHOWN]
        n_edges += 1
    remaining = marks[PENDING] - taken
    for i in range(remaining):
        toggles.clocks[i], toggles.levels[i] = toggles.clocks[taken + i], toggles.levels[taken + i]
    marks[PENDING] = remaining
    return n_edges


@compiled
def carry(lines, kept, before, n_edges, interval, clock_hz):
    """Turn the edges passed in an interval into the changes of the pins up to its end.

    Args:
        lines: the `Lines`.
        kept: the loop's `Waiting`.
        before, n_edges: the number of edges before the interval, and the number with the handle's edges, which are
            replaced.
        interval: the `Interval`.
        clock_hz: frequency of the clock.

    Returns:
        The new number of edges; -1 if edges were lost, or are lost now because there is no more room.
    """
    if n_edges < 0:
        return n_edges
    for i in range(before, n_edges):
        line = kept.edges.levels[i] ^ kept.marks[TRUE]
        kept.marks[TRUE] = kept.edges.levels[i]
        at_s = emitted_s(lines, kept.edges.clocks[i] / clock_hz, kept.next_s[FREE])
        kept.next_s[FREE] = at_s + lines.separation_s
        if not _insert(kept, math.ceil(at_s * clock_hz - ROUNDING), line):
            return -1
    until = interval.clock + interval.clocks
    if not _take_glitches(lines, kept, until, clock_hz):
        return -1
    return _show(lines, kept, before, until, clock_hz)


@compiled
def jittered_s(lines, numbers, upwards, times, clock_hz):
    """Return when edges are shown (s) that are passed at the given times (s), in the order of a record."""
    shown = np.empty(len(times))
    for i in range(len(times)):
        clock = math.floor(times[i] * clock_hz)
        shown[i] = _jittered_s(lines, clock, numbers[i], upwards[i], times[i])
    return shown


@compiled
def _emitted(lines, clocks, clock_hz):
    """Return the clocks at which edges are emitted, in the order of a record."""
    emitted, free_s = np.empty_like(clocks), 0.0
    for i in range(len(clocks)):
        at_s = emitted_s(lines, clocks[i] / clock_hz, free_s)
        free_s = at_s + lines.separation_s
        emitted[i] = math.ceil(at_s * clock_hz - ROUNDING)
    return emitted


def carried(lines: Lines, edges: Edges, level: int, seconds: float, clock_hz: float) -> Edges:
    """Return what the pins show of a whole record.

    Args:
        lines: the lines.
        edges: the edges of the handle in the order in which they are passed, stamped when they are shown.
        level: the level of the pins at the start, a | b << 1.
        seconds: length of the record.
        clock_hz: frequency of the clock.
    """
    before = np.concatenate([[level], edges.levels])[:-1]
    clocks, toggled = [_emitted(lines, edges.clocks, clock_hz)], [edges.levels ^ before]
    begin_s, number = gap_s(lines, 0), 0
    while begin_s < seconds:
        pulse = [math.ceil(begin_s * clock_hz), math.ceil((begin_s + lines.glitch_s) * clock_hz)]
        if pulse[0] < pulse[1]:
            clocks.append(np.array(pulse))
            toggled.append(np.full(2, line_of(lines, number)))
        number += 1
        begin_s += gap_s(lines, number)
    at, line = np.concatenate(clocks), np.concatenate(toggled)
    dead = np.where(line == A, lines.dead_a_s, lines.dead_b_s) * clock_hz
    order = np.argsort(at, kind="stable")
    order = order[at[order] < dead[order]]
    return Edges(at[order], level ^ np.bitwise_xor.accumulate(line[order]))
