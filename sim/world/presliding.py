"""A handle on bristles and its encoder: from leg to leg, in series or in closed form, with its events at their time.

A leg has one direction of motion, and is one of two kinds.

- *Full*: the bristles are bent as far as they can be at Coulomb's level. Then they do not change, friction is constant,
  and `rigid` has the motion in closed form. It ends at the time at which the handle turns or, by LuGre's model, slips
  so slowly that its level rises. At speed most of a run is of this kind, and passes without a series.
- *Bending*: the series of `bristles`, up to the time at which the handle turns, or passes the speed at which the level
  begins to be Coulomb's. The speed at which this ends is twice as large, so that no leg begins where it must end:
  between the two speeds both motions are equal to rounding.

Bristles never quite fill: the gap closes by 1 / e for each `full_m` that the handle slips. A gap within `FULL` of it is
closed. This changes the friction by at most this fraction of Coulomb's level.

A handle rests, and keeps its state bit for bit, only if its bristles bear the force exactly; else it swings on them.
"""

import math

import numpy as np

from ...model.runtime.compiled import compiled, inlined
from .advance import Moment, advance, advance_quietly
from .bristles import MOST, POSITION, ROWS, SIGN, UNIT, VELOCITY, WATCHED, Bent, Bristled, Stribeck, expand
from .polynomials import END, FIRST, NEVER, UNSURE, leaves, shorten
from .rigid import Handle, Leg, Motion, glide, glide_past, span, turn, turned
from .taylor import HALVINGS, emit

FULL = 2.0**-48
"""The gap of full bristles, as a part of their bend: 32 halves of a unit, so that rounding does not keep it open."""
REACH = 1.0
"""The length of a leg that is tried first, times the rates at its beginning."""


def bristled(
    handle: Handle, coulomb_n: float, stiffness_n_per_m: float, damping_n_s_per_m: float, static_n: float, vs: float
) -> Bristled:
    """Return a handle on bristles in the form that `presliding` advances.

    Args:
        handle: mass and viscous friction.
        coulomb_n: Coulomb level, > 0.
        stiffness_n_per_m, damping_n_s_per_m: of the bristles; without damping, and with Coulomb's static level, the
            model is Dahl's.
        static_n: static level, >= `coulomb_n`.
        vs: Stribeck speed, m/s, which is not looked at if both levels are equal.
    """
    stribeck, excess = None, (static_n - coulomb_n) / coulomb_n
    if excess > 0.0:
        # There the exponential raises Coulomb's level by less than half of a unit in its last place.
        stribeck = Stribeck(static_n, vs, vs * math.sqrt(max(math.log(excess / UNIT), 1.0)))
    mass, viscous = handle
    calm = math.sqrt(stiffness_n_per_m / mass) + (viscous + damping_n_s_per_m * static_n / coulomb_n) / mass
    return Bristled(
        handle,
        stiffness_n_per_m,
        damping_n_s_per_m,
        coulomb_n,
        stribeck,
        coulomb_n / stiffness_n_per_m,
        calm,
        np.zeros((FIRST + MOST + 2, WATCHED)),
        np.zeros((ROWS, MOST + 2)),
    )


def fastest_per_s(plant: Bristled) -> float:
    """Return a bound on the rates that can last: of a handle that sticks, or slips below `free_m_per_s`.

    Above, the bristles are full after a few dozen legs, and from then on the motion is known in closed form.
    """
    slip = plant.stribeck.free_m_per_s / plant.full_m if plant.stribeck else 0.0
    return plant.calm_per_s + slip


@inlined
def _free(stribeck):
    """Return the speed from which on the level is Coulomb's."""
    if stribeck is None:
        return 0.0
    return stribeck.free_m_per_s


@compiled
def along_of(plant, state, force_n):
    """Return the direction in which the handle moves or is about to, -1 or 1; 0 if it rests."""
    toward = state.velocity_m_per_s
    if toward == 0.0:
        toward = force_n - plant.stiffness_n_per_m * state.bend_m
    return 0 if toward == 0.0 else (1 if toward > 0.0 else -1)


@advance_quietly.register(Bristled)
@inlined
def _advance_quietly(plant, moment, force_n, interval):
    state, cell, n_edges = moment
    free = _free(plant.stribeck)
    along = 1.0 if state.velocity_m_per_s > 0.0 else -1.0
    if state.velocity_m_per_s * along <= free or state.bend_m != along * plant.full_m:
        return moment, False
    motion = Motion(state.position_m, state.velocity_m_per_s)
    end = glide(motion, force_n - along * plant.coulomb_n, interval.length)
    after = Moment(Bent(end.position_m, end.velocity_m_per_s, state.bend_m), cell, n_edges)
    return after, end.velocity_m_per_s * along > free and cell.lower_m <= end.position_m < cell.upper_m


@compiled
def _slip(plant, state, along, force_n, seconds):
    """Return (leg, state, slows): a full leg of at most `seconds`, its end, and whether it ends before."""
    handle, free = plant.handle, along * _free(plant.stribeck)
    net_n = force_n - along * plant.coulomb_n
    start = Motion(state.position_m, state.velocity_m_per_s)
    end = glide(start, net_n, span(handle, seconds))
    # The speed beyond the free one obeys the handle's own equation, with the friction of the free one as a force.
    beyond = Motion(start.position_m, start.velocity_m_per_s - free)
    slows = turned(beyond, Motion(end.position_m, end.velocity_m_per_s - free))
    if slows:
        seconds = turn(handle, beyond, net_n - handle.viscous_n_s_per_m * free, seconds)[0]
        end = Motion(glide(start, net_n, span(handle, seconds)).position_m, free)
    return Leg(start, net_n, 0.0, seconds), Bent(end.position_m, end.velocity_m_per_s, state.bend_m), slows


@compiled
def _rate(plant, stribeck, state, slow, force_n):
    """Return about how fast a leg changes at its beginning, 1/s."""
    speed = abs(state.velocity_m_per_s)
    acceleration = abs(force_n - plant.stiffness_n_per_m * state.bend_m) / plant.handle.mass_kg
    rate = plant.calm_per_s + speed / plant.full_m + math.sqrt(acceleration / plant.full_m)
    if stribeck is not None and slow:
        vs = stribeck.speed_m_per_s
        rate += (1.0 + speed / vs) * acceleration / vs
    return rate


@compiled
def _order(reach):
    """Return the order that an exponential over a reach needs."""
    order, rest = 2, reach * reach * reach / 6.0
    while rest > UNIT / 8 and order < MOST:
        order += 1
        rest *= reach / (order + 1)
    return order


@compiled
def _turns(series, along, surely):
    """Return the time at which the handle turns: see `leaves`."""
    return leaves(series, SIGN, 0.0 if along > 0 else -np.inf, np.inf if along > 0 else 5e-324, surely)


@compiled
def _switches(series, free, along, slow, surely):
    """Return the time at which the level begins or ends to be Coulomb's: see `leaves`."""
    if slow:
        return leaves(series, VELOCITY, -np.inf if along > 0 else -2 * free, 2 * free if along > 0 else np.inf, surely)
    most = np.nextafter(-free, np.inf)
    return leaves(series, VELOCITY, free if along > 0 else -np.inf, np.inf if along > 0 else most, surely)


@compiled
def _bend(plant, state, along, slow, force_n, seconds):
    """Lay out a leg of at most `seconds`; return its series, its length (s), and whether it turns or switches then."""
    free, rate = _free(plant.stribeck), _rate(plant, plant.stribeck, state, slow, force_n)
    seconds = min(seconds, REACH / rate)
    order = _order(seconds * rate)
    while not expand(plant, plant.stribeck, state, along, slow, force_n, seconds, order):
        seconds, order = (seconds if order < MOST else 0.5 * seconds), MOST
    series = plant.series[: FIRST + order + 2]
    for halving in range(HALVINGS + 1):
        surely = halving == HALVINGS
        turns = _turns(series, along, surely) if slow or free == 0.0 else NEVER
        switches = _switches(series, free, along, slow, surely) if free > 0.0 else NEVER
        if UNSURE not in (turns, switches):
            break
        shorten(series, 0.5)
        seconds *= 0.5
    end = min(turns, switches, 1.0)
    if end < 1.0:
        shorten(series, end)
    return series, seconds * end, turns == end, turns != end and switches == end


@advance.register(Bristled)
@compiled
def _advance(plant, encoder, moment, force_n, interval, edges):
    state, cell, n_edges = moment
    free, until_s, now_s = _free(plant.stribeck), interval.length.seconds, 0.0
    along, slow = along_of(plant, state, force_n), abs(state.velocity_m_per_s) < free
    while now_s < until_s and along != 0 and n_edges >= 0:
        left_s = until_s - now_s
        if not slow and state.bend_m == along * plant.full_m:
            leg, end, turns = _slip(plant, state, along, force_n, left_s)
            leg = Leg(leg.start, leg.net_n, now_s, now_s + leg.until_s)
            cell, n_edges = glide_past(plant.handle, encoder, leg, end.position_m, cell, n_edges, interval, edges)
            now_s = leg.until_s if turns else until_s
            state, switches = end, turns and free > 0.0
            turns = turns and not switches
        else:
            series, seconds, turns, switches = _bend(plant, state, along, slow, force_n, left_s)
            if not cell.lower_m <= series[END, POSITION] < cell.upper_m:
                cell, n_edges = emit(series, POSITION, encoder, cell, n_edges, (now_s, seconds, 1.0), interval, edges)
            now_s = until_s if seconds == left_s else now_s + seconds
            state = Bent(series[END, 0], series[END, 1], series[END, 2])
            if not slow and abs(plant.full_m - along * state.bend_m) <= FULL * plant.full_m:
                state = Bent(state.position_m, state.velocity_m_per_s, along * plant.full_m)
        if switches:
            slow = not slow
        elif turns:
            state = Bent(state.position_m, 0.0, state.bend_m)
            along = along_of(plant, state, force_n)
    return Moment(state, cell, n_edges)
