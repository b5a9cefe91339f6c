"""The handle: a rigid mass with one degree of freedom, viscous friction, and Coulomb friction that really sticks.

    m dv/dt = F - b v - Fc sign(v),   dx/dt = v,   and v = 0 for as long as the handle rests and |F| <= Fc

The applied force F is constant over an interval (zero-order hold), so the motion is known in closed form. Let z = -b t
/ m, phi1(z) = (e^z - 1) / z and phi2(z) = (phi1(z) - 1) / z, the first columns of the matrix exponential. With `net`
the force left after Coulomb friction,

    v(t) = v0 + v0 (e^z - 1) + net t phi1(z) / m
    x(t) = x0 + v0 t phi1(z) + net t^2 phi2(z) / m

All terms of a row are computed to a few units in the last place for every z, b = 0 included. The velocity is monotone
while `net` is constant. So an interval holds at most one turn (an instant of zero velocity), and its time is known,
too.

Intervals of equal length share their coefficients: a `Span` is computed once, and only an interval that is cut by an
event (a turn, an encoder edge) evaluates exponentials and logarithms. Stick and slip are events at their exact time,
and a handle that sticks keeps its `Motion` bit for bit.
"""

import math
from typing import NamedTuple

from ...model.runtime.compiled import compiled, inlined
from .advance import Moment, advance, advance_quietly
from .encoder import level, next_cell, stamp


class Handle(NamedTuple):
    """The moving mass."""

    mass_kg: float  # > 0
    viscous_n_s_per_m: float  # >= 0


class Coulomb(NamedTuple):
    """Dry friction of one level, at rest and in motion. Where a handle has none, pass None and it is not compiled."""

    level_n: float  # >= 0


class Rigid(NamedTuple):
    """A handle that the force drives directly: the simplest device."""

    handle: Handle
    coulomb: Coulomb | None


class Motion(NamedTuple):
    """Position and velocity at one instant; a velocity of exactly zero is rest."""

    position_m: float
    velocity_m_per_s: float


class Leg(NamedTuple):
    """A part of an interval, s, with a motion in one direction under one net force."""

    start: Motion
    net_n: float
    since_s: float
    until_s: float


class Span(NamedTuple):
    """A length of time and its coefficients in the two equations of this file."""

    seconds: float
    decay: float  # e^z - 1: the part of the velocity that viscous friction takes, from 0 to -1
    coast_s: float  # t phi1(z): travel per unit of initial velocity
    velocity_per_newton: float  # t phi1(z) / m
    position_per_newton: float  # t^2 phi2(z) / m


@compiled
def span(handle, seconds):
    """Return the `Span` of `seconds` >= 0 of this handle.

    Below |z| = 1/4 the difference in phi2 would cancel. So its Taylor series 2 phi2 = 1 + z/3 (1 + z/4 (1 + ...)) is
    summed until the next term is under 2**-53. A short series serves the microseconds between events.
    """
    z = -handle.viscous_n_s_per_m * seconds / handle.mass_kg
    if z > -0.25:
        series = 1.0
        for n in range(6 if z > -1e-3 else 12, 2, -1):
            series = 1.0 + z * series / n
        phi2 = 0.5 * series
        phi1 = 1.0 + z * phi2
        decay = z * phi1
    else:
        decay = math.expm1(z)
        phi1 = decay / z
        phi2 = (phi1 - 1.0) / z
    coast = seconds * phi1
    return Span(seconds, decay, coast, coast / handle.mass_kg, seconds * seconds * phi2 / handle.mass_kg)


@compiled
def glide(motion, net_n, interval):
    """Return the `Motion` after the span `interval` under a constant net force, also if the velocity passes zero.

    The change of velocity is added to the old velocity. Multiplying by e^z instead would repeat that factor's rounding
    in every interval. This would bias the friction by up to 2**-53 / |z| of itself.
    """
    change = motion.velocity_m_per_s * interval.decay + net_n * interval.velocity_per_newton
    travel = motion.velocity_m_per_s * interval.coast_s + net_n * interval.position_per_newton
    return Motion(motion.position_m + travel, motion.velocity_m_per_s + change)


@compiled
def sticks(coulomb, motion, force_n):
    """Return whether the handle rests and the applied force cannot move it."""
    if coulomb is None:
        return False
    return motion.velocity_m_per_s == 0.0 and abs(force_n) <= coulomb.level_n


@compiled
def net_force(coulomb, motion, force_n):
    """Return the applied force (N) less Coulomb friction, for a handle that does not stick.

    Friction opposes the velocity, or at rest the motion about to begin, which is along the force.
    """
    if coulomb is None:
        return force_n
    along = motion.velocity_m_per_s if motion.velocity_m_per_s != 0.0 else force_n
    return force_n - coulomb.level_n if along > 0.0 else force_n + coulomb.level_n


@compiled
def turned(before, after):
    """Return whether a motion under one net force came to rest or turned back between `before` and `after`."""
    if before.velocity_m_per_s > 0.0:
        return after.velocity_m_per_s <= 0.0
    return before.velocity_m_per_s < 0.0 and after.velocity_m_per_s >= 0.0


@compiled
def turn(handle, motion, net_n, seconds):
    """Return the time (s) and the `Motion` at which the velocity reaches zero, for a motion that has `turned`.

    v = 0 at t = (m / b) log(1 + b w) with w = -v0 / net. The time is held within 0 to `seconds`, the interval in which
    the turn was found, against rounding.
    """
    velocity = motion.velocity_m_per_s
    at = seconds
    if net_n < 0.0 < velocity or velocity < 0.0 < net_n:  # otherwise the velocity faded to zero at the end
        slowness = -velocity / net_n
        growth = handle.viscous_n_s_per_m * slowness
        if growth < 1e-17:
            at = handle.mass_kg * slowness
        else:
            at = handle.mass_kg * math.log1p(growth) / handle.viscous_n_s_per_m
        at = min(at, seconds)
    return at, Motion(glide(motion, net_n, span(handle, at)).position_m, 0.0)


@compiled
def reach(handle, motion, net_n, seconds, travel_m):
    """Return the time (s, 0 to `seconds`) at which a motion in one direction has travelled `travel_m` (signed).

    Newton's method on the exact travel, from the root of its second-order expansion (which is the answer for b = 0).
    The velocity is monotone, so from its second step on Newton's method approaches from one side and needs no bracket.
    It ends when the travel is met to its own rounding.
    """
    velocity = motion.velocity_m_per_s
    acceleration = (net_n - handle.viscous_n_s_per_m * velocity) / handle.mass_kg
    final = math.sqrt(max(velocity * velocity + 2.0 * acceleration * travel_m, 0.0))
    speed = abs(velocity) + final
    at = 2.0 * abs(travel_m) / speed if speed > 0.0 else seconds
    for _ in range(64):
        now = glide(Motion(0.0, velocity), net_n, span(handle, at))
        short = travel_m - now.position_m
        if abs(short) <= 1e-14 * abs(travel_m):
            break
        if now.velocity_m_per_s * travel_m > 0.0:
            at += short / now.velocity_m_per_s
        else:
            at = 0.0  # at a turn the slope is lost: approach it from the start, where there is one
    return min(max(at, 0.0), seconds)


@compiled
def resume(handle, coulomb, rest, force_n, seconds):
    """Return the `Motion` `seconds` after the turn at `rest`: stuck there, or slipping along the force."""
    if sticks(coulomb, rest, force_n):
        return rest
    return glide(rest, net_force(coulomb, rest, force_n), span(handle, seconds))


@inlined
def glide_past(handle, encoder, leg, end_m, cell, n_edges, interval, edges):
    """Append the edges that a `Leg` passes on its way to `end_m`; return (cell, n_edges), or -1 if they are full."""
    room = min(len(edges.clocks), len(edges.levels))
    while not cell.lower_m <= end_m < cell.upper_m and 0 <= n_edges < room:
        upwards = end_m >= cell.upper_m
        travel_m = (cell.upper_m if upwards else cell.lower_m) - leg.start.position_m
        at_s = leg.since_s + reach(handle, leg.start, leg.net_n, leg.until_s - leg.since_s, travel_m)
        edges.clocks[n_edges] = stamp(encoder, cell, upwards, at_s, interval)
        cell = next_cell(encoder, cell, upwards)
        edges.levels[n_edges] = level(cell.number)
        n_edges += 1
    return cell, n_edges if cell.lower_m <= end_m < cell.upper_m else -1


@advance_quietly.register(Rigid)
@inlined
def _advance_quietly(plant, moment, force_n, interval):
    coulomb, (motion, cell, n_edges) = plant.coulomb, moment
    if sticks(coulomb, motion, force_n):
        return moment, True
    end = glide(motion, net_force(coulomb, motion, force_n), interval.length)
    after, quiet = Moment(end, cell, n_edges), cell.lower_m <= end.position_m < cell.upper_m
    if motion.velocity_m_per_s * end.velocity_m_per_s > 0.0:
        return after, quiet
    if coulomb is None:
        # A turn reaches no farther than the initial velocity would: most turns need not be looked for.
        farthest_m = motion.position_m + motion.velocity_m_per_s * interval.length.seconds
        return after, quiet and cell.lower_m <= farthest_m < cell.upper_m
    return after, False


@advance.register(Rigid)
@compiled
def _advance(plant, encoder, moment, force_n, interval, edges):
    (handle, coulomb), (motion, cell, n_edges) = plant, moment
    if sticks(coulomb, motion, force_n):
        return moment
    seconds = interval.length.seconds
    net_n = net_force(coulomb, motion, force_n)
    whole = glide(motion, net_n, interval.length)
    # A turn divides the interval into two legs.
    start, since_s = motion, 0.0
    end, until_s = whole, seconds
    turning = turned(motion, whole)
    if turning:
        until_s, end = turn(handle, motion, net_n, seconds)
    while True:
        leg = Leg(start, net_n, since_s, until_s)
        cell, n_edges = glide_past(handle, encoder, leg, end.position_m, cell, n_edges, interval, edges)
        if not turning:
            return Moment(end, cell, n_edges)
        turning = False
        start, since_s = end, until_s
        end, until_s = whole, seconds
        if coulomb is not None:
            net_n = net_force(coulomb, start, force_n)
            end = resume(handle, coulomb, start, force_n, until_s - since_s)
