"""Known motions of the handle: position, velocity and acceleration at any time, and the edges that an encoder makes.

An estimate from the edges can then be compared with the exact derivative. A motion is a tuple of numbers or arrays
whose class has a `position`, a `velocity` and an `acceleration`; all compile into the loops that use them.
"""

import math
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import by_type, compiled
from ...model.stamped import Edges
from ..world.encoder import Encoder, level, locate, next_cell
from ..world.lines import carried, jittered_s

BISECTIONS = 200
"""The largest number of halvings in the search for a turn or a passage, which ends earlier at float64's resolution."""


class DecayingSine(NamedTuple):
    """The motion of the founding paper's figures: amplitude exp(-decay t) sin(2 pi f t)."""

    amplitude_m: float
    decay_per_s: float
    frequency_hz: float


class Steady(NamedTuple):
    """Constant speed, starting at an arbitrary position within a count."""

    speed_m_per_s: float
    start_m: float


class Sine(NamedTuple):
    """A sine of constant amplitude and frequency about a place, whose phase at time 0 is `since_s` of motion."""

    centre_m: float
    amplitude_m: float
    frequency_hz: float
    since_s: float


class Sweep(NamedTuple):
    """A sine of constant amplitude whose frequency grows exponentially with time."""

    amplitude_m: float
    first_hz: float
    growth_per_s: float  # of the frequency's logarithm


class Stop(NamedTuple):
    """Constant speed, then constant deceleration, then rest."""

    speed_m_per_s: float
    brake_s: float
    deceleration_m_per_s2: float


class Track(NamedTuple):
    """A recorded path: cubic between samples of position and velocity, constant speed before and after."""

    start_s: float
    step_s: float
    position_m: np.ndarray
    velocity_m_per_s: np.ndarray


@by_type
def position(motion, time_s):
    """Return the position (m) at a time (s)."""


@by_type
def velocity(motion, time_s):
    """Return the exact velocity (m/s) at a time (s)."""


@by_type
def acceleration(motion, time_s):
    """Return the exact acceleration (m/s^2) at a time (s)."""


@position.register(DecayingSine)
@compiled
def _decaying_position(motion, time_s):
    return (
        motion.amplitude_m * math.exp(-motion.decay_per_s * time_s) * math.sin(math.tau * motion.frequency_hz * time_s)
    )


@velocity.register(DecayingSine)
@compiled
def _decaying_velocity(motion, time_s):
    omega = math.tau * motion.frequency_hz
    turning = omega * math.cos(omega * time_s) - motion.decay_per_s * math.sin(omega * time_s)
    return motion.amplitude_m * math.exp(-motion.decay_per_s * time_s) * turning


@acceleration.register(DecayingSine)
@compiled
def _decaying_acceleration(motion, time_s):
    omega, decay = math.tau * motion.frequency_hz, motion.decay_per_s
    turning = (decay**2 - omega**2) * math.sin(omega * time_s) - 2 * decay * omega * math.cos(omega * time_s)
    return motion.amplitude_m * math.exp(-decay * time_s) * turning


@position.register(Steady)
@compiled
def _steady_position(motion, time_s):
    return motion.start_m + motion.speed_m_per_s * time_s


@velocity.register(Steady)
@compiled
def _steady_velocity(motion, time_s):
    return motion.speed_m_per_s


@acceleration.register(Steady)
@compiled
def _steady_acceleration(motion, time_s):
    return 0.0


@position.register(Sine)
@compiled
def _sine_position(motion, time_s):
    return motion.centre_m + motion.amplitude_m * math.sin(math.tau * motion.frequency_hz * (time_s + motion.since_s))


@velocity.register(Sine)
@compiled
def _sine_velocity(motion, time_s):
    omega = math.tau * motion.frequency_hz
    return motion.amplitude_m * omega * math.cos(omega * (time_s + motion.since_s))


@acceleration.register(Sine)
@compiled
def _sine_acceleration(motion, time_s):
    omega = math.tau * motion.frequency_hz
    return -motion.amplitude_m * omega**2 * math.sin(omega * (time_s + motion.since_s))


@position.register(Sweep)
@compiled
def _sweep_position(motion, time_s):
    cycles = motion.first_hz * math.expm1(motion.growth_per_s * time_s) / motion.growth_per_s
    return motion.amplitude_m * math.sin(math.tau * cycles)


@velocity.register(Sweep)
@compiled
def _sweep_velocity(motion, time_s):
    cycles = motion.first_hz * math.expm1(motion.growth_per_s * time_s) / motion.growth_per_s
    omega = math.tau * motion.first_hz * math.exp(motion.growth_per_s * time_s)
    return motion.amplitude_m * omega * math.cos(math.tau * cycles)


@acceleration.register(Sweep)
@compiled
def _sweep_acceleration(motion, time_s):
    phase = math.tau * motion.first_hz * math.expm1(motion.growth_per_s * time_s) / motion.growth_per_s
    omega = math.tau * motion.first_hz * math.exp(motion.growth_per_s * time_s)
    return motion.amplitude_m * omega * (motion.growth_per_s * math.cos(phase) - omega * math.sin(phase))


@position.register(Stop)
@compiled
def _stop_position(motion, time_s):
    braked = min(max(time_s - motion.brake_s, 0.0), motion.speed_m_per_s / motion.deceleration_m_per_s2)
    free = min(time_s, motion.brake_s)
    return motion.speed_m_per_s * (free + braked) - motion.deceleration_m_per_s2 * braked**2 / 2


@velocity.register(Stop)
@compiled
def _stop_velocity(motion, time_s):
    braked = max(time_s - motion.brake_s, 0.0)
    return max(motion.speed_m_per_s - motion.deceleration_m_per_s2 * braked, 0.0)


@acceleration.register(Stop)
@compiled
def _stop_acceleration(motion, time_s):
    braked = time_s - motion.brake_s
    braking = 0 <= braked < motion.speed_m_per_s / motion.deceleration_m_per_s2
    return -motion.deceleration_m_per_s2 if braking else 0.0


@compiled
def _piece(motion, time_s):
    """Return the number of the piece of a track that contains a time, and the fraction of the piece before it."""
    at = (time_s - motion.start_s) / motion.step_s
    piece = min(max(int(at), 0), len(motion.position_m) - 2)
    return piece, at - piece


@position.register(Track)
@compiled
def _track_position(motion, time_s):
    i, s = _piece(motion, time_s)
    x, v, h = motion.position_m, motion.velocity_m_per_s, motion.step_s
    if s < 0:
        return x[0] + v[0] * s * h
    if s > 1:
        return x[-1] + v[-1] * (s - 1) * h
    rise = x[i + 1] - x[i]
    # The Hermite cubic, from its values and slopes at both ends.
    return x[i] + s * (h * v[i] + s * (3 * rise - h * (2 * v[i] + v[i + 1]) + s * (h * (v[i] + v[i + 1]) - 2 * rise)))


@velocity.register(Track)
@compiled
def _track_velocity(motion, time_s):
    i, s = _piece(motion, time_s)
    x, v, h = motion.position_m, motion.velocity_m_per_s, motion.step_s
    if s < 0:
        return v[0]
    if s > 1:
        return v[-1]
    rise = (x[i + 1] - x[i]) / h
    return v[i] + s * (2 * (3 * rise - 2 * v[i] - v[i + 1]) + s * 3 * (v[i] + v[i + 1] - 2 * rise))


@acceleration.register(Track)
@compiled
def _track_acceleration(motion, time_s):
    i, s = _piece(motion, time_s)
    x, v, h = motion.position_m, motion.velocity_m_per_s, motion.step_s
    if not 0 <= s <= 1:
        return 0.0
    rise = (x[i + 1] - x[i]) / h
    return (2 * (3 * rise - 2 * v[i] - v[i + 1]) + s * 6 * (v[i] + v[i + 1] - 2 * rise)) / h


@compiled
def _turn(motion, begin_s, end_s):
    """Return the time at which the motion turns, between two times with velocities of different signs."""
    upwards = velocity(motion, begin_s) > 0
    for _ in range(BISECTIONS):
        middle = (begin_s + end_s) / 2
        if not begin_s < middle < end_s:
            break
        if (velocity(motion, middle) > 0) == upwards:
            begin_s = middle
        else:
            end_s = middle
    return end_s


@compiled
def _passage(motion, begin_s, end_s, at_m, upwards):
    """Return the first float64 time past a position, for a motion in one direction from `begin_s` to `end_s`."""
    for _ in range(BISECTIONS):
        # The secant's guess, kept off the ends: few halvings on a smooth path, and never many.
        here, there = position(motion, begin_s), position(motion, end_s)
        guess = begin_s + (end_s - begin_s) * min(max((at_m - here) / (there - here), 0.02), 0.98)
        if not begin_s < guess < end_s:
            break
        beyond = position(motion, guess) >= at_m if upwards else position(motion, guess) < at_m
        if beyond:
            end_s = guess
        else:
            begin_s = guess
    return end_s


@compiled
def _edges(motion, encoder, step_s, steps, room):
    """Return the passages over `steps` steps: (times in s, cells entered, their number, or `room` + 1 for too many)."""
    times, cells = np.empty(room), np.empty(room, np.int64)
    cell, passages = locate(encoder, position(motion, 0.0)), 0
    for k in range(steps):
        begin_s, stop_s = k * step_s, (k + 1) * step_s
        while begin_s < stop_s:
            end_s = stop_s
            if velocity(motion, begin_s) * velocity(motion, end_s) < 0:
                end_s = _turn(motion, begin_s, end_s)
            target = position(motion, end_s)
            since_s = begin_s
            while not cell.lower_m <= target < cell.upper_m:
                upwards = target >= cell.upper_m
                if passages == room:
                    return times, cells, room + 1
                since_s = _passage(motion, since_s, end_s, cell.upper_m if upwards else cell.lower_m, upwards)
                cell = next_cell(encoder, cell, upwards)
                times[passages], cells[passages] = since_s, cell.number
                passages += 1
            begin_s = end_s
    return times, cells, passages


class Encoded(NamedTuple):
    """The output of an encoder for a motion.

    Attributes:
        edges: the clocks at which a register at the pins first holds a new level, and the levels.
        start_level: level of the pins before the first edge, a | b << 1.
        start_cell: the encoder's count at time 0, where a decoder's count is 0.
    """

    edges: Edges
    start_level: int
    start_cell: int


def encoded(motion, encoder: Encoder, seconds: float, step_s: float, offset_clocks: int) -> Encoded:
    """Return the edges of a motion from time 0 on, in order of time.

    An edge passed at time t is stamped ceil(t clock_hz) + offset_clocks moving up, floor(t clock_hz) + 1 +
    offset_clocks moving down, as in `sim.world.encoder`. With lines, t is the time at which the edge is shown.

    Args:
        motion: one of this module's motions.
        encoder: the scale and its clock.
        seconds: duration, rounded up to a whole number of steps.
        step_s: length of a step, so short that the motion turns at most once in it.
        offset_clocks: clocks added to every stamp.
    """
    room = 1 << 16
    while True:
        times, cells, passages = _edges(motion, encoder, step_s, math.ceil(seconds / step_s), room)
        if passages <= room:
            break
        room *= 4
    times, cells = times[:passages], cells[:passages]
    start = locate(encoder, position(motion, 0.0)).number
    upwards = np.diff(cells, prepend=start) > 0
    lines, clock_hz, start_level = encoder.lines, encoder.clock_hz, int(level(start))
    at = clock_hz * (times if lines is None else jittered_s(lines, cells + ~upwards, upwards, times, clock_hz))
    clocks = np.where(upwards, np.ceil(at), np.floor(at) + 1).astype(np.int64)
    quarter = (cells + 1) & 3
    edges = Edges(clocks, quarter ^ (quarter >> 1))
    if lines is not None:
        edges = carried(lines, edges, start_level, seconds, clock_hz)
    return Encoded(Edges(edges.clocks + offset_clocks, edges.levels), start_level, int(start))
