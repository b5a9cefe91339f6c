"""Velocity from the clock stamps of the encoder's edges: a sliding-mode differentiator of events, in fixed point.

At an edge the position is known to a clock; between edges it is unknown. So nothing is corrected between edges. At an
edge, the error is the difference of its predicted place, over the interval T, and its true place. D is the clocks of a
sample; v is in counts a sample, a in counts a sample per clock, T and s in clocks. L is the bits of T (2**(L-1) <= T <
2**L). n is the edges passed, 0 if the same edge is crossed back. At every edge in use:

    E = (v + a T/2) T - (n D + place[this edge] - place[last edge])
    v <- v + a T - min(|E| / T, lambda sqrt(|E| 2**L)) sign(E)            |E| >= D: without the limit by lambda
    a <- a - min(change of v / 2**L, alpha 2**L) sign(E)                  |a| <= 2**ACCELERATION_BITS C, or next above

and at every sample, s clocks after that edge (the anchor), u = v + a s; this line is the output, `u`.
`levant_edge_anchor` defines which edges are in use.

The two minima are the sliding mode. One is the square root and the sign of the error. The other is the step that ends
on the surface E = 0; it is used where the first would pass the surface. This is the implicit discretisation: no chatter
at any rate. The change of a is at most 2**-L of the change of v. Otherwise, with lambda^2 below alpha, down to a lambda
of 0, a would swing from edge to edge.

|E| / T alone gives v = n D / T + a T/2: the mean velocity of the interval, extrapolated by half of it. In a, division
by 2**L instead of T needs no second division, and it stabilises the loop: for constant T and g = T / 2**L in (1/2, 1],
z^2 - (1 - g/2) z + g/2 = 0, |z| <= 0.71.

Lost. lambda limits the correction of errors of less than a count, |E| < D. Edges that are half a count out of place
cause no larger error. At a larger error the estimate has lost the motion: the acceleration is beyond the gains, or
beyond the format of a. Then v starts again on the surface, from the mean velocity between these two edges, and no place
is learnt from E. With the limit, the estimate would be left behind: v adds a T at every edge, and would run to the end
of its format, where lambda is too low to hold it. In an interval of more than `mantissa` bits neither limit applies: no
error that an axis makes reaches them.

The places of edges. A real scale has four kinds of edges, by pin and polarity in the upward sense. They are out of
place by up to half a count. `place` holds the displacements, times D. After a full cycle in one direction, an edge
moves two places apart by E 2**-LEARN_SHIFT: the places of its own kind and of the last edge's kind. For this, |E| is
limited to D/4 to D/2. One of the four unknowns is the origin, which the symmetric step does not move. Steady speed
excites two patterns of a cycle. For these, the loop from places over v and a to E is 2 and (1 + j) / (1 - g/2). Its
real part is positive, so learning is stable with any step less than 1/4. It takes some ten cycles. (With g = 1, and v
corrected by a as well, it is not stable: see the table.) The residual of an interval cut by k bits is weighted by
2**-k: slow motion learns slowly.

The bound without a further edge. Let v be the velocity at the anchor, and no edge come for s clocks. A constant
deceleration that stops within the cell leaves at most 2 D/s - |v|. A motion that turns within the cell returns no
faster than v. The line is held within -v and bound - v, where bound = (5/2) D 2**-l and 2**l <= s < 2**(l+1): never
tighter than for a cell a quarter too wide. While an edge is too close to the anchor, the bound is twice that, and there
is none at first. An axis is at rest, v = a = 0, once the line is at twice the bound: no parabola through the cell comes
there. It is at rest too after half the range of the stamp, since slower edges cannot be distinguished from rest. A stop
from constant speed reads exactly 0 after 2.5 to 5 times the time of a count; if a count takes less than the shortest
interval, two of these come on top. Until then it reads the old speed.

The second output, the acceleration, is a: the slope of the line since the anchor, and 0 at rest. Where the bound holds
the line in a silence, the output is still a.

Bursts. Some encoders emit several edges at once, after a silence that does not mean a slower axis. `refuted` finds them
by an edge at which the axis is faster than the last bound allows. For `bursts.doubt_samples` from then on the line is
not held, and there is no rest by silence. A stop within that time reads the old speed until its end.

Guarantee. For any gains, any |f''| <= A and errors of the learnt places up to p counts, s clocks after a correction
over T: |u - f'| <= (1 + 2 p) D / T + (A + |a|) (T/2 + s). |a| is the larger of its values before and after the
correction. In a silence shorter than T the bound is D / s + A s/2 where that is larger. The first term is for |E| < D.
On the surface it is 2 p D / T; any motion that the gains allow reaches the surface within a few edges. (The bound is
far from tight for an a near the true one. But it holds for every a within the format, so it holds beyond C, too.)

Measured RMS error in mm/s. Paper: 50 exp(-t) sin(2 pi t) mm, t in [1, 5] s, 1 um, 1 MHz; gains for C = 12 m/s^2, 50 MHz
stamps; hit: 0.35 kg at 0.3 m/s on 10 kN/m and 20 N s/m (up to 68 m/s^2); late: the same with B late by 0.25 count.

    design, float                                                 paper    late     hit     late
    levant on the count, u / u1                                   1.75 / 0.58       177 / 258
    first order at edges, explicit, no extrapolation              0.082    0.79     226     226
    second order at edges, explicit                               diverges
    mean velocity and its slope, no limit, every edge             0.046    10.6
      the same, intervals of 40 us or more                        0.013    5.5
    implicit super-twisting on the mean velocity, 20 us           0.019    2.2      0.069   0.90
      the same, places learnt                                     1.9      2.0      0.073   0.080
      g = T / 2**L in (1/2, 1]                                    0.022    0.022    0.071   0.083
      that without the root                                       0.023    0.023    0.083   0.082
      v corrected by 3/2 |E| / T                                  0.34     0.50     0.072   0.073
    full cycles only, no places, no limits                        0.005    0.027    0.149   0.142
    this one, float and fixed                                     0.0065   0.0063   0.060   0.059
      20 MHz stamps                                               0.013    0.013    0.095   0.43

This estimator is worse than `levant` u1 in four cases. At a constant speed of a metre a second, by the stamp's error
over the shortest interval: 0.22 (`levant`: 0.013). For vibration of about a count at hundreds of hertz (12 m/s^2 up to
1 kHz): 1.7 to 2.2 with peaks of 17 (`levant`: 1.2). In the intervals after a stop from a millimetre a second or less.
And on recorded counts, whose edges have no stamps: stamps interpolated between two samples are no better than the
samples.

Source: Levant 1998 for the law; implicit discretisation of sliding modes after Acary and Brogliato; its use on
stamped edges with learnt places is this project's.

Saturation. v and u saturate at the velocity format (flag `velocity_saturated`); the distance saturates at its format
and |E| / T at the velocity format (flag `error_saturated`). The next edges then recover a motion within the format.
Acceleration, places and the learning step saturate silently: as limits they are part of the law, in float64 too.

Limits. The count and the stamp may wrap: differences are modulo their widths. The first sample, and a sample with
`restart`, forget everything, the places included; u = 0 until the second edge in use after it, so a reset in motion
causes no transient. An interval of half the stamp's range or more only sets a new anchor.
"""

import math

from ..arithmetic.divide import divide
from ..arithmetic.fixed import length_of, saturate, shift_floor, shift_round_half_up
from ..arithmetic.sqrt import isqrt
from ..encoder.quadrature import RUN_MAX
from ..runtime.compiled import compiled
from .acceleration import acceleration_of
from .bursts import watch
from .estimate import estimate
from .levant import sign_of
from .levant_edge_anchor import (
    FIRST,
    LOOSE,
    TIMED,
    anchored,
    kind_of,
    meet,
    started,
)
from .levant_edge_design import LEARN_SHIFT, Design, FloatParams, Gains, Params, State

__all__ = ["Design", "Gains"]
LEFT_MAX = 46
"""Largest left shift of a gain word, beyond which every result saturates anyway: 16 + 46 bits fit int64."""


@compiled
def _shifted(places, to, since, by, low, high):
    """Return the places, kind `to` raised and kind `since` lowered by `by`, held within `low` to `high`."""
    return (
        saturate(places[0] + by * (int(to == 0) - int(since == 0)), low, high),
        saturate(places[1] + by * (int(to == 1) - int(since == 1)), low, high),
        saturate(places[2] + by * (int(to == 2) - int(since == 2)), low, high),
        saturate(places[3] + by * (int(to == 3) - int(since == 3)), low, high),
    )


@compiled
def within(line, velocity, bound):
    """Return the extrapolated `line`, held within the module's bound for the time without a further edge."""
    if velocity < 0:
        return saturate(line, -max(bound + velocity, 0), -velocity)
    return saturate(line, -velocity, max(bound - velocity, 0))


@compiled
def refuted(bound, before, after):
    """Return whether a velocity at an edge exceeds the last bound: edges come in bursts.

    Without bursts an axis that slows down within its cell is no faster at the next edge than `bound` less its speed
    `before`. One that stops in it and starts again is slower than half of that speed.
    """
    onward = max(after if before >= 0 else 0, -after if before <= 0 else 0)
    return onward > bound - abs(before) and 2 * onward > abs(before)


@compiled
def _fitted(value, most):
    """Return `value` held within the two's complement format whose largest word is `most`."""
    return saturate(value, ~most, most)


@compiled
def _turn(params, acceleration, time):
    """Return the change of velocity over `time` clocks in velocity LSB, rounded down, with one bit more of range."""
    shift = max(length_of(time) - params.mantissa, 0)
    coarse = shift_floor(acceleration * (time >> shift), params.turn_shift)
    return _fitted(shift_floor(coarse, params.turn_span - shift), 2 * params.velocity_max + 1)


@compiled
def _correct(params, state, seen, interval, passed):
    """Return (velocity, acceleration, places, flags) at the new edge, `interval` clocks and `passed` edges later."""
    velocity, acceleration, places = state.velocity, state.acceleration, state.places
    kind = kind_of(seen)
    length = length_of(interval)
    shift = max(length - params.mantissa, 0)
    time = interval >> shift
    most, steepest = params.velocity_max, params.acceleration_max

    turn = _turn(params, acceleration, interval)
    mean = _fitted(velocity + (turn >> 1), most)
    distance = _fitted(passed, params.distance_max)
    place = shift_floor(distance * params.clocks, -params.place_fraction) + places[kind] - places[state.kind]
    error = shift_floor(mean * time, params.error_shift) - shift_floor(place, shift - params.place_shift)
    sign, size = sign_of(error), abs(error)

    slope = divide(size << params.error_shift, time, params.quotient_width)
    change = slope
    if shift == 0 and size < params.lost:
        radicand = shift_floor(size, params.radicand_shift) << (length & 1)
        change = min(change, shift_floor(params.lambda_ * isqrt(radicand), params.limit_shift - (length >> 1)))
    bend = min(shift_floor(change, params.slope_shift + length), steepest)
    if shift == 0:
        bend = min(bend, shift_floor(params.alpha, max(params.alpha_shift - length, -LEFT_MAX)))

    far_velocity = velocity + turn - sign * change
    velocity = _fitted(far_velocity, most)
    acceleration = _fitted(acceleration - sign * bend, steepest)
    if seen.run == RUN_MAX and size < params.lost:
        by = shift_round_half_up(_fitted(error, params.learn_max), params.learn_shift)
        places = _shifted(places, kind, state.kind, by, ~params.place_max, params.place_max)
    flags = int(distance != passed or size << params.error_shift >= time << params.quotient_width)
    flags |= int(velocity != far_velocity) << 1
    return velocity, acceleration, places, flags


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    if restart or not state.running:
        state = started(params, seen, 0)
    met, interval, passed = meet(params, state, seen)
    known, doubt = state.known, max(state.doubt - 1, 0)
    velocity, acceleration, places = state.velocity, state.acceleration, state.places
    most, flags = params.velocity_max, 0
    if met == FIRST:
        known, doubt, velocity, acceleration = 1, 0, 0, 0
    elif met == TIMED:
        velocity, acceleration, places, flags = _correct(params, state, seen, interval, passed)
        if refuted(state.bound, state.velocity, velocity):
            doubt = params.doubt
    number, stamp, kind, age = anchored(params, state, seen, met)

    young = met == LOOSE and not age >> (params.shortest + 1)
    gone = not young and age >> (params.stamp_width - 1)
    straight = velocity if gone else velocity + _turn(params, acceleration, age)
    line = _fitted(straight, most)
    bound, rests = state.bound, False
    if not young:
        bound = min(params.bound >> max(length_of(age) - 1 - int(met == LOOSE), 0), params.bound_max)
        rests = bool(gone) or (not doubt and abs(line) >= 2 * bound)
    flags |= int(line != straight and not rests) << 1
    if not young and not doubt:
        line = within(line, velocity, bound)
    if rests:
        velocity, acceleration, line = 0, 0, 0
        known = int(known and not gone)
    after = State(1, known, number, stamp, kind, bound, doubt, velocity, acceleration, places, watched)
    return after, line, flags | clumped << 2


@compiled
def _float_correct(params, state, seen, interval, passed):
    velocity, acceleration, places = state.velocity, state.acceleration, state.places
    kind = kind_of(seen)
    scale = 2.0 ** length_of(interval)
    turn = acceleration * interval
    place = passed * params.clocks + places[kind] - places[state.kind]
    error = (velocity + turn / 2) * interval - place
    sign, slope = sign_of(error), abs(error) / interval
    change = slope
    if interval >> params.mantissa == 0 and abs(error) < params.clocks:
        change = min(change, params.lambda_ * math.sqrt(abs(error) * scale))
    bend = change / scale
    if interval >> params.mantissa == 0:
        bend = min(bend, params.alpha * scale)
    velocity = velocity + turn - sign * change
    acceleration = saturate(acceleration - sign * bend, -params.steepest, params.steepest)
    coarse = error * 2.0 ** -max(length_of(interval) - params.mantissa, 0)
    if seen.run == RUN_MAX and abs(coarse) < params.clocks:
        by = saturate(coarse, -params.learn_max, params.learn_max) * 2.0**-LEARN_SHIFT
        places = _shifted(places, kind, state.kind, by, -params.place_max, params.place_max)
    return velocity, acceleration, places


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same algorithm, as a reference for the cost of fixed point."""
    watched, clumped = watch(params.bursts, state.watch, seen, restart)
    if restart or not state.running:
        state = started(params, seen, 0.0)
    met, interval, passed = meet(params, state, seen)
    known, doubt = state.known, max(state.doubt - 1, 0)
    velocity, acceleration, places = state.velocity, state.acceleration, state.places
    if met == FIRST:
        known, doubt, velocity, acceleration = 1, 0, 0.0, 0.0
    elif met == TIMED:
        velocity, acceleration, places = _float_correct(params, state, seen, interval, passed)
        if refuted(state.bound, state.velocity, velocity):
            doubt = params.doubt
    number, stamp, kind, age = anchored(params, state, seen, met)

    line, bound = velocity + acceleration * age, state.bound
    if met != LOOSE or age >> (params.shortest + 1):
        gone = age >> (params.stamp_width - 1)
        bound = 2.5 * params.clocks * 2.0 ** -max(length_of(age) - 1 - int(met == LOOSE), 0)
        rests = gone or (not doubt and abs(line) >= 2 * bound)
        if not doubt:
            line = within(line, velocity, bound)
        if rests:
            velocity, acceleration, line = 0.0, 0.0, 0.0
            known = int(known and not gone)
    after = State(1, known, number, stamp, kind, bound, doubt, velocity, acceleration, places, watched)
    return after, line, clumped << 2


@acceleration_of.register(Params)
@compiled
def acceleration(params, state):
    return shift_floor(state.acceleration * params.clocks, params.sample_shift)


@acceleration_of.register(FloatParams)
@compiled
def float_acceleration(params, state):
    return state.acceleration * params.clocks
