"""Velocity from the clock stamps of the encoder's edges: a Kalman filter of edges whose places are uncertain.

An edge gives the position of the axis, with the edge's own error, at a time that its stamp gives to a clock. Position,
velocity and acceleration are tracked from edge to edge, with gains for the time T between them. Nothing is corrected
between edges. v is in counts a sample, a in counts a sample per clock, D is the clocks of a sample. n is the edges
passed, 0 if the same edge is crossed back. x is the distance of the axis from its last edge, times D. At every edge:

    r = n D - (v + a T/2) T - x                               the innovation
    z <- z + blend (r - z)                                    its mean over an agile memory
    x <- -r + K_x r,  v <- v + a T + K_v r,  a <- a + K_a r         |a| <= 2**ACCELERATION_BITS C, or next above

and at every sample, s clocks after the last edge, u = v + a s; this line is the output, `u`. A sample takes its last
edge alone: where edges come faster than samples, T is the time between edges in use.

The gains are the steady-state Kalman filter's for a white jerk and for edges displaced at random. M is its memory: the
time in which the past fades by e. For T far below M, K_x = 2 T / M, K_v = 2 T / M**2 and K_a = T / M**3. At T = 2 M,
the largest, they are about the gains of a fit to the last three edges. So the filter is a mean over many edges where
they are dense, and a second difference of edges where they are rare. Gains come from a table, by T / M to half an
octave. They need no precision, only an error of the same sign everywhere.

The memory. Two bounds on the motion give a quiet and an agile memory: the jerk between impacts, and the acceleration at
an impact (`edge_kalman_tables` has the rule). The quiet memory is used until |z| passes a bound: ALARM standard
deviations of the mean of that many innovations. Then the memory becomes agile at once. It grows again by GROWTH, an
eighth, of the time that passes. An impact is noticed after some tenths of a count, and the motion before it is
forgotten within an agile memory. A single displaced edge raises no alarm.

What is learned. Both memories and the bound follow from the error of an edge. The bound on it, which the axis states,
is for the worst edge of the worst encoder. The filter begins with it, and counts the edges whose |r| is above the mean
that this error makes usual. Of independent normal errors these are 0.42. The share of the last 2**LEARN_BITS edges or
so is what tells. Below BETTER the errors are 0.56 of those in use or less, and the error in use is halved, up to
HALVINGS times. Above WORSE they are 1.6 times those or more, and it is doubled, up to what the axis states. Every edge
counts for one, however large its innovation: a start, an impact or a single displaced edge teaches next to nothing. An
edge that is crossed back has its own error twice, and teaches nothing. An
encoder that is better than stated gets shorter memories and finer alarms. What was learned is kept over a rest, and
forgotten with `restart`.

Silence. Without an edge the axis is within its cell, which is as long as two edges may be apart, 1 + m counts. The line
is held as in `levant_edge`: within -v and bound - v, where bound = (2 + 2 m) D 2**-l and 2**l <= s < 2**(l+1). A motion
with even acceleration that stays in the cell never has a line of twice the bound. So at twice the bound the axis is at
rest, v = a = 0. It is at rest too once s is half the range of the stamp, since slower edges cannot be distinguished
from rest. The memory is then agile, and the next edge begins a motion. At standstill the velocity is exactly 0.

Bursts. Some encoders emit several edges at once, after a silence that does not mean a slower axis. An edge shows such
an encoder if the axis is then faster than the last bound allows, and faster than half of its speed before: see
`levant_edge.refuted`. So does a jolt, see `bursts`: without it an axis at rest would start again with every burst. For
`bursts.doubt_samples` from then on the line is not held, and there is no rest by silence.

A turn needs no care: an edge has one place, whichever way it is crossed.

The second output, the acceleration, is a: the slope of the line since the last edge, and 0 at rest. Where the bound
holds the line in a silence, the output is still a.

The scale. Where edges really stand may be known, by a map (`scale_map`): n is then the difference of the places of two
edges. Without a map every edge is where its number says. The filter itself learns no places. It averages errors that
repeat every four edges like any others, over the edges of a memory. A map is changed with `restart` only, because the
anchor's place comes from the map, too.

Start. The first sample, and a sample with `restart`, forget everything; u = 0 until the second edge. A start in motion
is caught up in some agile memories.

Saturation. v and u saturate at the velocity format (flag `velocity_saturated`); the distance and r saturate at the
error's format (flag `error_saturated`). The place is then the last edge's, and the next edges recover a motion within
the format. The acceleration saturates silently: as a limit it is part of the law, in float64 too. z is a mean of
innovations and within their range. A correction of the velocity beyond twice the format's range is held there, and
counts as a velocity that saturates.

Limits. The count and the stamp may wrap: differences are modulo their widths. An interval of half the stamp's range or
more only sets a new anchor.

Source: Kalman 1960 for the filter. Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and
Navigation (2001), section 11.2, for a memory that an alarm shortens. Its use on stamped edges, with gains in a table by
the time between them, is this project's.
"""

import math

from ..arithmetic.fixed import length_of, saturate, shift_floor, shift_round_half_up, wrap
from ..encoder.quadrature import stamp_of
from ..encoder.scale_map import FRACTION_BITS, place_of
from ..runtime.compiled import compiled
from .acceleration import acceleration_of
from .bursts import NOTHING, watch
from .edge_kalman_design import Design, FloatParams, Gains, Params, State
from .edge_kalman_tables import (
    AGILE_AT,
    ALARM_AT,
    BETTER,
    BLEND,
    GAIN_BITS,
    GAIN_FORMATS,
    GROW,
    INDEX_MAX,
    KA,
    KV,
    KX,
    LEARN_BITS,
    LENGTH,
    LIMIT_WIDTHS,
    MEMORY_BITS,
    QUIET_AT,
    SHARE_BITS,
    USUAL,
    USUAL_SHARE,
    WORSE,
)
from .estimate import estimate
from .levant_edge import refuted, within
from .levant_edge_anchor import number_of

__all__ = ["Design", "Gains"]
HALF = 1 << (MEMORY_BITS - 1)
BLEND_BITS, KX_BITS = LIMIT_WIDTHS[BLEND], GAIN_FORMATS[KX].width
LENGTH_SHIFT = MEMORY_BITS - LENGTH.f
"""The bits by which a memory of the table is shifted to one of the state."""
LONGEST = round(2 * math.log2(INDEX_MAX))
"""The longest T in half octaves of M."""
RATE_SHIFT = GAIN_BITS - GAIN_FORMATS[KV].width
"""The bits by which a word of `kv` or `ka` is shifted to the rate of the shortest memory."""
ANCHOR, FIRST, TIMED = range(3)
"""The kind of the last edge: the anchor itself, the first known edge, or an edge to correct by."""


@compiled
def _time_of(params, stamp):
    """Return a stamp in units of 2**`unit` clocks."""
    return stamp >> params.unit


@compiled
def _started(params, seen, zero, share):
    """Return the state at a first sample: its last edge is the anchor, whose arrival was not seen."""
    at = _time_of(params, stamp_of(seen, seen.edge))
    return State(1, 0, number_of(params, seen), at, zero, 0, zero, zero, zero, share, zero, zero, 0, NOTHING)


@compiled
def _met(params, state, seen):
    """Return (what the last edge is, ANCHOR to TIMED; units from the anchor to it; edges from the anchor to it)."""
    mask = (1 << params.time_bits) - 1
    interval = (_time_of(params, stamp_of(seen, seen.edge)) - state.stamp) & mask
    passed = wrap(number_of(params, seen) - state.number, params.count_width)
    if interval == 0 and passed == 0:
        return ANCHOR, interval, passed
    if not state.known or interval >> (params.time_bits - 1):
        return FIRST, interval, passed
    return TIMED, interval, passed


@compiled
def _size(value):
    """Return the magnitude of a value, less an LSB if it is negative: what no carry is needed for."""
    return value if value >= 0 else ~value


@compiled
def _half_octaves(interval):
    """Return the row of times that an interval is in: its top two bits choose it."""
    length = length_of(interval)
    next_bit = interval >> max(length - 2, 0) & 1 if length > 1 else 0
    return length << 1 | next_bit


@compiled
def _nearest(memory):
    """Return a memory to the nearest half octave."""
    return (memory + HALF) >> MEMORY_BITS


@compiled
def _gains_row(memory, time):
    """Return the row of `gains` for a memory and a row of times, both in whole half octaves."""
    return (memory - time + LONGEST) << 1 | memory & 1


@compiled
def _turn(params, acceleration, time):
    """Return the change of velocity over `time` units, with one bit more of range than a velocity."""
    return saturate(shift_floor(acceleration * time, params.turn_shift), ~params.turn_max, params.turn_max)


@compiled
def _displaced(params, state, number):
    """Return how much further an edge is displaced than the anchor, by the map of the scale."""
    return place_of(params.scale, number).error - place_of(params.scale, state.number).error


@compiled
def _innovation(params, state, interval, passed, number, turn):
    """Return (r, whether it or the edges passed were beyond their formats)."""
    travelled = shift_round_half_up((state.velocity + (turn >> 1)) * interval, params.travel_shift)
    distance = saturate(passed, -params.distance_max, params.distance_max)
    exact = (distance << FRACTION_BITS) + _displaced(params, state, number)
    far = shift_floor(exact * params.clocks, params.place_shift) - travelled - state.place
    r = saturate(far, -params.error_max, params.error_max)
    return r, distance != passed or r != far


@compiled
def _remembered(params, state, r, time, passed):
    """Return (memory, the length that the gains are for, mean, share, halvings) after an innovation."""
    limits = params.limits[state.halvings << params.row_bits | time]
    agile, quiet = limits[AGILE_AT] << LENGTH_SHIFT, limits[QUIET_AT] << LENGTH_SHIFT
    memory = max(state.memory, agile)
    length = _nearest(memory)
    memory = min(memory + params.gains[_gains_row(length, time), GROW], quiet)
    mean = state.mean + shift_round_half_up(limits[BLEND] * (r - state.mean), BLEND_BITS)
    if shift_floor(_size(mean), params.alarm_shift) > limits[ALARM_AT]:
        memory, length = agile, _nearest(agile)
    if passed == 0:
        return memory, length, mean, state.share, state.halvings
    large = int(shift_floor(_size(r), params.usual_shift) > limits[USUAL]) << SHARE_BITS
    share, halvings = state.share + shift_round_half_up(large - state.share, LEARN_BITS), state.halvings
    if share > WORSE and halvings > 0:
        share, halvings = USUAL_SHARE, halvings - 1
    elif share < BETTER and halvings < params.halvings_max:
        share, halvings = USUAL_SHARE, halvings + 1
    return memory, length, mean, share, halvings


@compiled
def _rate(params, word, memory):
    """Return a word of `kv` or `ka` as a rate for a memory in whole half octaves."""
    return word << RATE_SHIFT >> ((memory >> 1) - params.shortest)


@compiled
def _correct(params, state, interval, passed, number):
    """Return (memory, place, mean, share, velocity, acceleration, halvings, flags) at the new edge."""
    time = _half_octaves(interval)
    turn = _turn(params, state.acceleration, interval)
    r, beyond = _innovation(params, state, interval, passed, number, turn)
    memory, length, mean, share, halvings = _remembered(params, state, r, time, passed)
    gains = params.gains[_gains_row(length, time)]

    nearer = shift_round_half_up(gains[KX] * r, KX_BITS)
    far_faster = shift_round_half_up(_rate(params, gains[KV], length) * nearer, params.velocity_shift)
    faster = saturate(far_faster, ~params.turn_max, params.turn_max)
    far_velocity = state.velocity + turn + faster
    velocity = saturate(far_velocity, -params.velocity_max, params.velocity_max)
    bend = shift_round_half_up(_rate(params, gains[KA], length) * faster, params.bend_shift)
    acceleration = saturate(state.acceleration + bend, -params.acceleration_max, params.acceleration_max)
    flags = int(beyond) | int(velocity != far_velocity or faster != far_faster) << 1
    return memory, nearer - r, mean, share, velocity, acceleration, halvings, flags


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    if restart or not state.running:
        state = _started(params, seen, 0, USUAL_SHARE)
    met, interval, passed = _met(params, state, seen)
    here = number_of(params, seen)
    known, memory, place, mean = state.known, state.memory, state.place, state.mean
    share, halvings = state.share, state.halvings
    velocity, acceleration, flags = state.velocity, state.acceleration, 0
    doubt = max(state.doubt - 1, 0)
    if met == FIRST:
        known, doubt, memory, place, mean, velocity, acceleration = 1, 0, 0, 0, 0, 0, 0
    elif met == TIMED:
        corrected = _correct(params, state, interval, passed, here)
        memory, place, mean, share, velocity, acceleration, halvings, flags = corrected
        if refuted(state.bound, state.velocity, velocity):
            doubt = params.doubt
    if watched.jolt:
        doubt = params.doubt
    number, stamp = state.number, state.stamp
    if met != ANCHOR:
        number, stamp = here, _time_of(params, stamp_of(seen, seen.edge))

    age = (_time_of(params, seen.stamp) - stamp) & ((1 << params.time_bits) - 1)
    gone = age >> (params.time_bits - 1)
    bound = min(params.bound >> max(length_of(age) - 1, 0), params.bound_max)
    straight = velocity + _turn(params, acceleration, age)
    line = saturate(straight, -params.velocity_max, params.velocity_max)
    rests = gone or (not doubt and abs(line) >= 2 * bound)
    flags |= int(line != straight and not rests) << 1
    if not doubt:
        line = within(line, velocity, bound)
    if rests:
        memory, mean, velocity, acceleration, line = 0, 0, 0, 0, 0
        known = int(known and not gone)
    motion = memory, place, mean, share, velocity, acceleration
    after = State(1, known, number, stamp, bound, doubt, *motion, halvings, watched)
    return after, shift_round_half_up(line, params.output_shift), flags | clumped << 2


@compiled
def _float_nearest(memory):
    return int(memory + 0.5)


@compiled
def _float_remembered(params, state, r, time, passed):
    limits = params.limits[state.halvings << params.row_bits | time]
    memory = max(state.memory, limits[AGILE_AT])
    length = _float_nearest(memory)
    memory = min(memory + params.gains[_gains_row(length, time), GROW], limits[QUIET_AT])
    mean = state.mean + limits[BLEND] * (r - state.mean)
    if abs(mean) > limits[ALARM_AT]:
        memory, length = limits[AGILE_AT], _float_nearest(limits[AGILE_AT])
    if passed == 0:
        return memory, length, mean, state.share, state.halvings
    large = int(abs(r) > limits[USUAL]) << SHARE_BITS
    share, halvings = state.share + (large - state.share) * 2.0**-LEARN_BITS, state.halvings
    if share > WORSE and halvings > 0:
        share, halvings = float(USUAL_SHARE), halvings - 1
    elif share < BETTER and halvings < params.halvings_max:
        share, halvings = float(USUAL_SHARE), halvings + 1
    return memory, length, mean, share, halvings


@compiled
def _float_correct(params, state, interval, passed, number):
    time = _half_octaves(interval)
    turn = state.acceleration * interval
    exact = passed + _displaced(params, state, number)
    r = exact * params.per_sample - (state.velocity + turn / 2) * interval - state.place
    memory, length, mean, share, halvings = _float_remembered(params, state, r, time, passed)
    gains = params.gains[_gains_row(length, time)]

    nearer = gains[KX] * r
    faster = gains[KV] * 2.0 ** -(length >> 1) * nearer
    bend = gains[KA] * 2.0 ** -(length >> 1) * faster
    acceleration = saturate(state.acceleration + bend, -params.steepest, params.steepest)
    return memory, nearer - r, mean, share, state.velocity + turn + faster, acceleration, halvings


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm, as a reference for the cost of fixed point."""
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    if restart or not state.running:
        state = _started(params, seen, 0.0, float(USUAL_SHARE))
    met, interval, passed = _met(params, state, seen)
    here = number_of(params, seen)
    known, memory, place, mean = state.known, state.memory, state.place, state.mean
    share, halvings = state.share, state.halvings
    velocity, acceleration, doubt = state.velocity, state.acceleration, max(state.doubt - 1, 0)
    if met == FIRST:
        known, doubt, memory, place, mean, velocity, acceleration = 1, 0, 0.0, 0.0, 0.0, 0.0, 0.0
    elif met == TIMED:
        corrected = _float_correct(params, state, interval, passed, here)
        memory, place, mean, share, velocity, acceleration, halvings = corrected
        if refuted(state.bound, state.velocity, velocity):
            doubt = params.doubt
    if watched.jolt:
        doubt = params.doubt
    number, stamp = state.number, state.stamp
    if met != ANCHOR:
        number, stamp = here, _time_of(params, stamp_of(seen, seen.edge))

    age = (_time_of(params, seen.stamp) - stamp) & ((1 << params.time_bits) - 1)
    gone = age >> (params.time_bits - 1)
    bound = params.bound * 2.0 ** -max(length_of(age) - 1, 0)
    line = velocity + acceleration * age
    rests = gone or (not doubt and abs(line) >= 2 * bound)
    if not doubt:
        line = within(line, velocity, bound)
    if rests:
        memory, mean, velocity, acceleration, line = 0.0, 0.0, 0.0, 0.0, 0.0
        known = int(known and not gone)
    motion = memory, place, mean, share, velocity, acceleration
    after = State(1, known, number, stamp, bound, doubt, *motion, halvings, watched)
    return after, line, clumped << 2


@acceleration_of.register(Params)
@compiled
def acceleration(params, state):
    return shift_floor(state.acceleration * params.per_sample, params.sample_shift)


@acceleration_of.register(FloatParams)
@compiled
def float_acceleration(params, state):
    return state.acceleration * params.per_sample
