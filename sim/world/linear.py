"""Devices whose state has a rate of change that is linear in the state and the command, in each of nine phases.

The phases are sliding up, sliding down or stuck; and the voltage within its limits, or at one. `taylor` and `euler`
both solve such a device, from the same tables: here is what they share. An interval is a stretch of one command, or
with pulses several, and a solver registers how it advances one.
"""

from typing import NamedTuple

import numpy as np

from ...model.compiled import by_type, compiled
from .advance import Moment
from .converter import width_of

PHASES = 9
STATES = 5
"""Room for the state; known when compiling, so that its loops are unrolled."""
SEEN, GRIP, VOLTAGE, QUANTITIES = 5, 6, 7, 8
"""After the state: the encoder's position; what decides on sticking; the voltage; and how many quantities there are."""


class State(NamedTuple):
    """The device at one instant; a velocity of exactly zero is rest."""

    position_m: float
    velocity_m_per_s: float
    others: tuple[float, float, float]  # the rest of y: what `device` has, then zeros
    width: int  # clocks that the pulse lasts


@compiled
def phase_number(along, limited):
    """Return the number of a phase: `along` is -1, 0 for stuck, or 1; `limited` -1, 0 or 1."""
    return 3 * (along + 1) + limited + 1


STUCK, SLIDING = 4, 7  # phase_number(0, 0) and phase_number(1, 0), which are not worth compiling


@compiled
def quantity(tables, phase, number, state, command_n):
    """Return the value in a phase of a quantity: of a state, its rate of change."""
    result = tables[phase, number, STATES] + tables[phase, number, STATES + 1] * command_n
    result += tables[phase, number, 0] * state.position_m + tables[phase, number, 1] * state.velocity_m_per_s
    for i in range(STATES - 2):
        result += tables[phase, number, 2 + i] * state.others[i]
    return result


@compiled
def along_of(plant, state, command_n):
    """Return which way the handle moves or is about to, -1 or 1, or 0 for stuck; 1 without Coulomb friction."""
    if plant.coulomb_n < 0.0:
        return 1
    if state.velocity_m_per_s != 0.0:
        return 1 if state.velocity_m_per_s > 0.0 else -1
    force_n = quantity(plant.tables, STUCK, GRIP, state, command_n)
    if abs(force_n) <= plant.coulomb_n:
        return 0
    return 1 if force_n > 0.0 else -1


@compiled
def limited_of(plant, state, command_n):
    """Return at which limit the voltage is, -1 or 1, or 0."""
    if plant.voltage_limit_n == np.inf:
        return 0
    voltage_n = quantity(plant.tables, SLIDING, VOLTAGE, state, command_n)
    return 1 if voltage_n > plant.voltage_limit_n else (-1 if voltage_n < -plant.voltage_limit_n else 0)


@by_type
def stretch(plant, encoder, moment, command_n, since_s, until_s, interval, edges):
    """Return the `Moment` after the part of an interval from `since_s` to `until_s`, the command constant.

    The moment is that at `since_s`; the other arguments are those of `advance`.
    """


@compiled
def never_quietly(plant, moment, force_n, interval):
    """Leave every interval to `advance`."""
    return moment, False


@compiled
def advance_in_stretches(plant, encoder, moment, force_n, interval, edges):
    """Advance device and encoder by as many stretches as the interval has commands: of pulses, one for each level."""
    pulse, limit_n = plant.pulse, plant.command_limit_n
    if pulse.period == 0:
        command_n = min(max(force_n, -limit_n), limit_n)
        return stretch(plant, encoder, moment, command_n, 0.0, interval.length, interval, edges)
    now, end = interval.clock, interval.clock + interval.clocks
    while now < end:
        within = now % pulse.period
        if within == 0:
            x, v, others, _ = moment.motion
            moment = Moment(State(x, v, others, width_of(pulse, force_n)), moment.cell, moment.n_edges)
        high = within < moment.motion.width
        until = min(end, now - within + (moment.motion.width if high else pulse.period))
        since_s, until_s = (now - interval.clock) / encoder.clock_hz, (until - interval.clock) / encoder.clock_hz
        command_n = pulse.level_n if high else -pulse.level_n
        moment = stretch(plant, encoder, moment, command_n, since_s, until_s, interval, edges)
        now = until
    return moment
