"""Devices with linear dynamics in the state and the command, in each of nine phases.

A phase combines the handle (sliding up, sliding down or stuck) with the voltage (within its limits, or at one of them).
`taylor` and `euler` both solve such a device from the same tables, and share the code of this file. An interval is one
stretch of constant command, or with pulses several, and a solver registers its function that advances a stretch.
"""

from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import by_type, compiled
from .advance import Moment
from .converter import width_of

PHASES = 9
STATES = 5
"""Number of states in the tables; known when compiling, so that loops over them are unrolled."""
SEEN, GRIP, VOLTAGE, QUANTITIES = 5, 6, 7, 8
"""The quantities after the state: the encoder's position, the one that decides on sticking, and the voltage; then the
number of quantities."""
ONE, COMMAND = 5, 6
"""The columns after the state's: of 1, and of the command."""
EXTRA = 2
"""Number of states that a device may have beyond `STATES`; their rows are behind the quantities, and their columns
behind the command's."""
COLUMNS = STATES + 2


class State(NamedTuple):
    """The device at one instant; a velocity of exactly zero is rest."""

    position_m: float
    velocity_m_per_s: float
    others: tuple[float, float, float]  # the rest of the state as in `device`, then zeros
    width: int  # length of the pulse, clocks
    more: tuple[float, float] | None = None  # the states beyond `STATES`; None for a device without any


def at_rest(tables: np.ndarray, position_m: float, width: int) -> State:
    """Return the `State` at rest at a place of a device with these tables, which has passed no command on yet."""
    more = (0.0,) * EXTRA if tables.shape[1] > QUANTITIES else None
    return State(position_m, 0.0, (0.0,) * (STATES - 2), width, more)


@compiled
def phase_number(along, limited):
    """Return the number of a phase: `along` is -1, 0 for stuck, or 1; `limited` -1, 0 or 1."""
    return 3 * (along + 1) + limited + 1


STUCK, SLIDING = 4, 7  # phase_number(0, 0) and phase_number(1, 0), written out rather than compiled


@compiled
def with_more(total, tables, phase, number, more):
    """Return the sum of a quantity's terms, including the terms of the states in `more`, if there are any."""
    if more is None:
        return total
    return total + tables[phase, number, COLUMNS] * more[0] + tables[phase, number, COLUMNS + 1] * more[1]


@compiled
def quantity(tables, phase, number, state, command_n):
    """Return the value of a quantity in a phase; for a state this is its rate of change."""
    result = tables[phase, number, ONE] + tables[phase, number, COMMAND] * command_n
    result += tables[phase, number, 0] * state.position_m + tables[phase, number, 1] * state.velocity_m_per_s
    for i in range(STATES - 2):
        result += tables[phase, number, 2 + i] * state.others[i]
    return with_more(result, tables, phase, number, state.more)


@compiled
def along_of(plant, state, command_n):
    """Return the direction in which the handle moves or is about to, -1 or 1, or 0 if stuck; 1 without Coulomb
    friction."""
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
    """Return the limit at which the voltage is, -1 or 1, or 0 within the limits."""
    if plant.voltage_limit_n == np.inf:
        return 0
    voltage_n = quantity(plant.tables, SLIDING, VOLTAGE, state, command_n)
    return 1 if voltage_n > plant.voltage_limit_n else (-1 if voltage_n < -plant.voltage_limit_n else 0)


@by_type
def stretch(plant, encoder, moment, command_n, since_s, until_s, interval, edges):
    """Return the `Moment` after the part of an interval from `since_s` to `until_s`, under a constant command.

    `moment` is the state at `since_s`; the other arguments are as in `advance`.
    """


@compiled
def never_quietly(plant, moment, force_n, interval):
    """Leave every interval to `advance`."""
    return moment, False


@compiled
def advance_in_stretches(plant, encoder, moment, force_n, interval, edges):
    """Advance device and encoder by one stretch for every command in the interval; with pulses, one for each level."""
    pulse, limit_n = plant.pulse, plant.command_limit_n
    if pulse.period == 0:
        command_n = min(max(force_n, -limit_n), limit_n)
        return stretch(plant, encoder, moment, command_n, 0.0, interval.length, interval, edges)
    now, end = interval.clock, interval.clock + interval.clocks
    while now < end:
        within = now % pulse.period
        if within == 0:
            x, v, others, _, more = moment.motion
            moment = Moment(State(x, v, others, width_of(pulse, force_n), more), moment.cell, moment.n_edges)
        high = within < moment.motion.width
        until = min(end, now - within + (moment.motion.width if high else pulse.period))
        since_s, until_s = (now - interval.clock) / encoder.clock_hz, (until - interval.clock) / encoder.clock_hz
        command_n = pulse.level_n if high else -pulse.level_n
        moment = stretch(plant, encoder, moment, command_n, since_s, until_s, interval, edges)
        now = until
    return moment
