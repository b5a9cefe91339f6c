"""Friction of bristles, by Dahl's and by LuGre's model: its equations as power series, and a bound of their rest.

Two surfaces touch with bristles, which bend by z (m) before they slip. The bristles' stiffness is S, their damping D,
the Coulomb level Fc, the static level Fs, the Stribeck speed vs, and with s = sign(v)

    dx/dt = v,   m dv/dt = F - b v - S z - D dz/dt,   dz/dt = v - s S v z / g(v),
    g(v) = Fc + (Fs - Fc) exp(-(v / vs)^2)

Dahl's model has g = Fc and D = 0. While v keeps its sign and the applied force F is constant, all of it is analytic. So
a leg of h seconds is a power series in the time t / h. Its terms up to an order N are computed by recurrence. LuGre's
exponential f = exp(-(v / vs)^2) is one more state, df/dt = -(2 / vs^2) v (dv/dt) f. The rest are products and the
quotient 1 / g.

**What the series leave out.** The size |A| of a series is the sum of the magnitudes of its terms. No value of it on the
leg is larger, and |A B| <= |A| |B|. Let the terms beyond order N of v, z and f have sizes rv, rz and rf, and carry them
through the right sides. The rest of a product A B beyond N is at most

    sum of |A_i B_j| over i + j > N,  + |A| rB + rA |B| + rA rB,

Let Q be the first terms of 1 / g, and e the rest of g Q beyond N. Then the rest of 1 / g is at most |Q| e / (1 - e). An
integral divides a term of order N or more by N + 1 at least. Hence, where a right side has a last term p_N, and rp is
the rest that follows for it from rv, rz and rf,

    h (|p_N| + rp) / (N + 1) <= the rest that was assumed of the state                                        (1)

shows, for all states at once, that no rest is larger than assumed. Each term follows from the terms before it. So if
the rests up to any order are within the assumed bounds, (1) gives the same for one order more. `fits` checks (1) for
what double precision rounds off anyway: `UNIT` of the sizes of z, of f, and of v and the velocity that the forces give
in the leg. If (1) fails for a leg, the leg is tried again with more terms, or with half its length.
"""

import math
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled
from .polynomials import FIRST, measure
from .rigid import Handle

MOST = 16
"""The largest order of a series."""
UNIT = 2.0**-53
POSITION, VELOCITY, BEND, SIGN, WATCHED = 0, 1, 2, 3, 4
"""The columns of `Bristled.series`: x, v, z, and v or, if the leg begins at rest, v / t, which has its sign; and their
number."""
FADE, LEVEL, INVERSE, TURNS, RUB, RATE, ACCELERATION, POWER, FADING, ROWS = 3, 4, 5, 6, 7, 8, 9, 10, 11, 12
"""The rows of `Bristled.terms`, after the first three columns of the above: f, g, 1 / g, v / g, v z / g, dz/dt, dv/dt,
v dv/dt and v (dv/dt) f; and their number."""


class Stribeck(NamedTuple):
    """How LuGre's friction falls from its static level as the handle slips faster."""

    static_n: float  # > coulomb_n
    speed_m_per_s: float
    free_m_per_s: float  # the speed from which on it is Coulomb's, to rounding


class Bristled(NamedTuple):
    """A handle on bristles, which the force drives directly."""

    handle: Handle
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    coulomb_n: float
    stribeck: Stribeck | None  # None: the level is Coulomb's at every speed, and no exponential is compiled
    full_m: float  # how far the bristles bend as the handle slips at Coulomb's level
    calm_per_s: float  # a rate of the handle on bristles that do not slip
    series: np.ndarray  # scratch, (FIRST + MOST + 2, WATCHED): the polynomials of the leg
    terms: np.ndarray  # scratch, (ROWS, MOST + 2)


class Bent(NamedTuple):
    """The handle at one instant."""

    position_m: float
    velocity_m_per_s: float
    bend_m: float  # of the bristles; the force of the bent bristles is stiffness times this


@compiled
def times(first, second, j):
    """Return term j of the product of two series."""
    total = 0.0
    for i in range(j + 1):
        total += first[i] * second[j - i]
    return total


@compiled
def size(series, order):
    """Return the size of a series of an order."""
    total = 0.0
    for j in range(order, -1, -1):
        total += abs(series[j])
    return total


@compiled
def rest_of(first, first_rest, second, second_rest, order):
    """Return a bound on the rest beyond an order of the product of two series with rests."""
    beyond = tail = first_size = 0.0
    for i in range(1, order + 1):
        tail += abs(second[order + 1 - i])
        beyond += abs(first[i]) * tail
        first_size += abs(first[i])
    first_size += abs(first[0])
    return beyond + first_size * second_rest + first_rest * (tail + abs(second[0]) + second_rest)


@compiled
def _assumed(plant, terms, force_n, seconds, order):
    """Return the rests of v and z that are assumed."""
    v, z = size(terms[VELOCITY], order), size(terms[BEND], order)
    given = seconds * (abs(force_n) + plant.stiffness_n_per_m * z) / plant.handle.mass_kg
    return UNIT * (v + given), UNIT * z


@compiled
def fits(plant, terms, seconds, order, rub_rest, rests):
    """Return whether (1) holds for v and z, and the rest of dv/dt.

    Args:
        plant, seconds, order: as in `expand`.
        terms: the plant's.
        rub_rest: the rest of v z / g.
        rests: the assumed ones of v and z.
    """
    v, z = rests
    rate = v + plant.stiffness_n_per_m * rub_rest
    pull = plant.handle.viscous_n_s_per_m * v + plant.stiffness_n_per_m * z + plant.damping_n_s_per_m * rate
    acceleration = pull / plant.handle.mass_kg
    share = seconds / (order + 1)
    small = share * (abs(terms[ACCELERATION, order]) + acceleration) <= v
    return small and share * (abs(terms[RATE, order]) + rate) <= z, acceleration


@compiled
def _step(plant, terms, along, force_n, seconds, j):
    """Fill in term j of dz/dt and dv/dt, and from them the next terms of x, v and z."""
    mass, viscous = plant.handle
    rate = terms[VELOCITY, j] - along * plant.stiffness_n_per_m * terms[RUB, j]
    pull = viscous * terms[VELOCITY, j] + plant.stiffness_n_per_m * terms[BEND, j] + plant.damping_n_s_per_m * rate
    acceleration = ((force_n if j == 0 else 0.0) - pull) / mass
    terms[RATE, j], terms[ACCELERATION, j] = rate, acceleration
    share = seconds / (j + 1)
    terms[POSITION, j + 1] = share * terms[VELOCITY, j]
    terms[VELOCITY, j + 1] = share * acceleration
    terms[BEND, j + 1] = share * rate


@compiled
def _expand_level(plant, terms, along, force_n, seconds, order):
    """Fill `terms` for a level that is Coulomb's; return whether the series fit."""
    for j in range(order + 1):
        terms[RUB, j] = times(terms[VELOCITY], terms[BEND], j) / plant.coulomb_n
        _step(plant, terms, along, force_n, seconds, j)
    v, z = _assumed(plant, terms, force_n, seconds, order)
    rub = rest_of(terms[VELOCITY], v, terms[BEND], z, order) / plant.coulomb_n
    return fits(plant, terms, seconds, order, rub, (v, z))[0]


@compiled
def _expand_stribeck(plant, stribeck, terms, along, force_n, seconds, order):
    """Fill `terms` for a level that depends on the speed; return whether the series fit."""
    excess_n, vs = stribeck.static_n - plant.coulomb_n, stribeck.speed_m_per_s
    speed = terms[VELOCITY, 0] / vs
    terms[FADE, 0] = math.exp(-speed * speed)
    for j in range(order + 1):
        terms[LEVEL, j] = excess_n * terms[FADE, j] + (plant.coulomb_n if j == 0 else 0.0)
        terms[INVERSE, j] = 0.0 if j else 1.0 / terms[LEVEL, 0]
        if j:
            terms[INVERSE, j] = -times(terms[LEVEL], terms[INVERSE], j) / terms[LEVEL, 0]
        terms[TURNS, j] = times(terms[VELOCITY], terms[INVERSE], j)
        terms[RUB, j] = times(terms[TURNS], terms[BEND], j)
        _step(plant, terms, along, force_n, seconds, j)
        terms[POWER, j] = times(terms[VELOCITY], terms[ACCELERATION], j) / (vs * vs)
        terms[FADING, j] = -2.0 * times(terms[POWER], terms[FADE], j)
        terms[FADE, j + 1] = seconds / (j + 1) * terms[FADING, j]
    v, z = _assumed(plant, terms, force_n, seconds, order)
    fade = UNIT * size(terms[FADE], order)
    inverse = rest_of(terms[LEVEL], excess_n * fade, terms[INVERSE], 0.0, order)
    if inverse > 0.5:
        return False
    inverse *= size(terms[INVERSE], order) / (1.0 - inverse)
    turns = rest_of(terms[VELOCITY], v, terms[INVERSE], inverse, order)
    rub = rest_of(terms[TURNS], turns, terms[BEND], z, order)
    small, acceleration = fits(plant, terms, seconds, order, rub, (v, z))
    power = rest_of(terms[VELOCITY], v, terms[ACCELERATION], acceleration, order) / (vs * vs)
    fading = 2.0 * rest_of(terms[POWER], power, terms[FADE], fade, order)
    return small and seconds / (order + 1) * (abs(terms[FADING, order]) + fading) <= fade


@compiled
def expand(plant, stribeck, state, along, slow, force_n, seconds, order):
    """Fill the plant's `series` with the polynomials of a leg in the time t / seconds; return whether they fit.

    Args:
        plant, stribeck: a `Bristled` and its `stribeck`.
        state: a `Bent`.
        along: direction in which the handle moves in the leg, -1 or 1.
        slow: whether the level depends on the speed.
        force_n: applied force.
        seconds: length of the leg.
        order: order of the series, at most `MOST`; rows of `series` beyond it are not touched.
    """
    series, terms = plant.series[: FIRST + order + 2], plant.terms
    terms[POSITION, 0], terms[VELOCITY, 0], terms[BEND, 0] = state
    if stribeck is None or not slow:
        small = _expand_level(plant, terms, along, force_n, seconds, order)
    else:
        small = _expand_stribeck(plant, stribeck, terms, along, force_n, seconds, order)
    at_rest = 1 if state.velocity_m_per_s == 0.0 else 0
    for j in range(order + 2):
        for number in range(SIGN):
            series[FIRST + j, number] = terms[number, j]
        series[FIRST + j, SIGN] = terms[VELOCITY, j + at_rest] if j + at_rest < order + 2 else 0.0
    measure(series)
    return small
