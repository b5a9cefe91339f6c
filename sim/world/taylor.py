"""A linear device under a stepped command, with friction that sticks and a voltage that has a limit, and its encoder.

In each phase (sliding up, sliding down, stuck; voltage within its limits, or at one) the state y has a rate of change
that is linear in y and the command, and a Taylor polynomial gives y over a leg to rounding: a leg is so short that its
series ends. What may happen in a leg is watched as polynomials too: the encoder passes an edge, the handle comes to
rest or breaks loose, the voltage meets or leaves its limit. For each, either the size of its coefficients excludes it,
or its slope keeps one sign and the ends tell; else the leg is halved. Then the earliest event is found by Newton's
method, and the next leg begins there.
"""

from typing import NamedTuple

import numpy as np

from ...model.compiled import by_type, compiled
from .advance import advance, advance_quietly
from .converter import Pulse, width_of
from .encoder import level, next_cell, stamp
from .polynomials import FIRST, NEVER, UNSURE, at, halve, leaves, measure, root, stays

PHASES = 9
STATES = 5
"""Room for the state; known when compiling, so that its loops are unrolled."""
SEEN, GRIP, VOLTAGE, QUANTITIES = 5, 6, 7, 8
"""After the state: the encoder's position; what decides on sticking; the voltage; and how many quantities there are."""
HALVINGS = 40
"""Of a leg, before it is taken as decided: by then it is as short as rounding."""
STALLED = 8
"""Events one after another, each as good as at the time of the last, before a moment passes without any."""
MOMENT = 1e-6
"""Of a leg."""


class Train(NamedTuple):
    """A device as `device.train` makes it."""

    tables: np.ndarray  # (PHASES, QUANTITIES, STATES + 2): dy/dt, and what is watched, of y, of 1, of the command
    series: np.ndarray  # scratch, (FIRST + order + 1, QUANTITIES): the polynomials of the leg
    coulomb_n: float  # negative for none
    voltage_limit_n: float
    command_limit_n: float
    pulse: Pulse
    leg_s: float


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


STUCK, SLIDING = phase_number(0, 0), phase_number(1, 0)


@compiled
def quantity(tables, phase, number, state, command_n):
    """Return the value in a phase of a quantity: of a state, its rate of change."""
    result = tables[phase, number, STATES] + tables[phase, number, STATES + 1] * command_n
    result += tables[phase, number, 0] * state.position_m + tables[phase, number, 1] * state.velocity_m_per_s
    for i in range(STATES - 2):
        result += tables[phase, number, 2 + i] * state.others[i]
    return result


@compiled
def expand(tables, series, phase, state, command_n, seconds):
    """Fill `series` with the polynomials of a leg in the time t / seconds, 0 to 1."""
    last = len(series) - 1
    series[FIRST, 0] = state.position_m
    series[FIRST, 1] = state.velocity_m_per_s
    for i in range(STATES - 2):
        series[FIRST, 2 + i] = state.others[i]
    for j in range(FIRST, last + 1):
        y = series[j, 0], series[j, 1], series[j, 2], series[j, 3], series[j, 4]
        share = seconds / (j - FIRST + 1)
        for number in range(QUANTITIES):
            change = tables[phase, number, STATES] + tables[phase, number, STATES + 1] * command_n
            change = change if j == FIRST else 0.0
            for k in range(STATES):
                change += tables[phase, number, k] * y[k]
            if number >= STATES:
                series[j, number] = change
            elif j < last:
                series[j + 1, number] = share * change
    if state.velocity_m_per_s == 0.0 and phase // 3 != STUCK // 3:
        # v / t has the sign of v, which begins at zero and has none yet: else a leg is halved and halved after a break.
        for j in range(FIRST, last):
            series[j, GRIP] = series[j + 1, 1]
        series[last, GRIP] = 0.0
    measure(series)


@compiled
def along_of(train, state, command_n):
    """Return which way the handle moves or is about to, -1 or 1, or 0 for stuck; 1 without Coulomb friction."""
    if train.coulomb_n < 0.0:
        return 1
    if state.velocity_m_per_s != 0.0:
        return 1 if state.velocity_m_per_s > 0.0 else -1
    force_n = quantity(train.tables, STUCK, GRIP, state, command_n)
    if abs(force_n) <= train.coulomb_n:
        return 0
    return 1 if force_n > 0.0 else -1


@compiled
def limited_of(train, state, command_n):
    """Return at which limit the voltage is, -1 or 1, or 0."""
    if train.voltage_limit_n == np.inf:
        return 0
    voltage_n = quantity(train.tables, SLIDING, VOLTAGE, state, command_n)
    return 1 if voltage_n > train.voltage_limit_n else (-1 if voltage_n < -train.voltage_limit_n else 0)


@compiled
def _breaks(series, coulomb_n, along, surely):
    """Return when the handle comes to rest, or breaks loose: see `leaves`."""
    if coulomb_n < 0.0:
        return NEVER
    if along == 0:
        return leaves(series, GRIP, -coulomb_n, np.nextafter(coulomb_n, np.inf), surely)
    return leaves(series, GRIP, 0.0 if along > 0 else -np.inf, np.inf if along > 0 else 5e-324, surely)


@compiled
def _switches(series, most, limited, surely):
    """Return when the voltage meets its limit, or leaves it."""
    if most == np.inf:
        return NEVER
    if limited == 0:
        return leaves(series, VOLTAGE, -most, np.nextafter(most, np.inf), surely)
    return leaves(series, VOLTAGE, most if limited > 0 else -np.inf, np.inf if limited > 0 else -most, surely)


@compiled
def _emit(series, encoder, cell, now_s, seconds, end, clock, clocks, edge_clocks, edge_levels, n_edges):
    """Append the edges that the encoder passes in a leg until the time `end`, 0 to 1; return (cell, n_edges).

    Where the arrays are full n_edges is -1.
    """
    room = min(len(edge_clocks), len(edge_levels))
    seen_m, passed = at(series, SEEN, end), 0.0
    while not cell.lower_m <= seen_m < cell.upper_m and 0 <= n_edges < room:
        upwards = seen_m >= cell.upper_m
        passed = root(series, SEEN, cell.upper_m if upwards else cell.lower_m, passed)
        edge_clocks[n_edges] = clock + stamp(encoder, upwards, now_s + min(passed, end) * seconds, clocks)
        cell = next_cell(encoder, cell, upwards)
        edge_levels[n_edges] = level(cell.number)
        n_edges += 1
    return cell, n_edges if cell.lower_m <= seen_m < cell.upper_m else -1


@by_type
def stretch(plant, encoder, state, cell, command_n, since_s, until_s, clock, clocks, edge_clocks, edge_levels, n_edges):
    """Advance device and encoder from `since_s` to `until_s` of an interval, the command constant: see `advance`."""


@stretch.register(Train)
@compiled
def _stretch(
    train, encoder, state, cell, command_n, since_s, until_s, clock, clocks, edge_clocks, edge_levels, n_edges
):
    series, now_s, stalled = train.series, since_s, 0
    along, limited = along_of(train, state, command_n), limited_of(train, state, command_n)
    while now_s < until_s:
        seconds = min(until_s - now_s, train.leg_s)
        blind = stalled >= STALLED
        if blind:
            seconds *= MOMENT
        expand(train.tables, series, phase_number(along, limited), state, command_n, seconds)
        for halving in range(HALVINGS + 1):
            surely = halving == HALVINGS
            inside, one_way = stays(series, SEEN, cell.lower_m, cell.upper_m)
            breaks = NEVER if blind else _breaks(series, train.coulomb_n, along, surely)
            switches = NEVER if blind else _switches(series, train.voltage_limit_n, limited, surely)
            if surely or ((inside or one_way) and UNSURE not in (breaks, switches)):
                break
            halve(series)
            seconds *= 0.5
        end = min(breaks, switches, 1.0)
        if not inside:
            cell, n_edges = _emit(
                series, encoder, cell, now_s, seconds, end, clock, clocks, edge_clocks, edge_levels, n_edges
            )
            if n_edges < 0:
                break
        others = at(series, 2, end), at(series, 3, end), at(series, 4, end)
        stalled = stalled + 1 if end * seconds < MOMENT * train.leg_s and not blind else 0
        now_s = until_s if end == 1.0 and seconds == until_s - now_s else now_s + end * seconds
        state = State(at(series, 0, end), at(series, 1, end), others, state.width)
        if end == 1.0:
            continue
        if switches < breaks:
            limited = 0 if limited != 0 else (1 if at(series, VOLTAGE, end) > 0.0 else -1)
        elif along == 0:
            along = 1 if at(series, GRIP, end) > 0.0 else -1
        else:
            state = State(state.position_m, 0.0, others, state.width)
            along = along_of(train, state, command_n)
    return state, cell, n_edges


@advance_quietly.register(Train)
@compiled
def never_quietly(plant, state, cell, force_n, interval):
    """Leave every interval to `advance`."""
    return state, False


@advance.register(Train)
@compiled
def advance_in_stretches(
    plant, encoder, state, cell, force_n, interval, clock, clocks, edge_clocks, edge_levels, n_edges
):
    """Advance device and encoder by as many stretches as the interval has commands: of pulses, one for each level."""
    pulse, limit_n = plant.pulse, plant.command_limit_n
    if pulse.period == 0:
        command_n = min(max(force_n, -limit_n), limit_n)
        return stretch(
            plant, encoder, state, cell, command_n, 0.0, interval, clock, clocks, edge_clocks, edge_levels, n_edges
        )
    now, end = clock, clock + clocks
    while now < end:
        within = now % pulse.period
        if within == 0:
            width = width_of(pulse, force_n)
            state = State(state.position_m, state.velocity_m_per_s, state.others, width)
        high = within < state.width
        until = min(end, now - within + (state.width if high else pulse.period))
        since_s, until_s = (now - clock) / encoder.clock_hz, (until - clock) / encoder.clock_hz
        state, cell, n_edges = stretch(
            plant, encoder, state, cell, pulse.level_n if high else -pulse.level_n, since_s, until_s,
            clock, clocks, edge_clocks, edge_levels, n_edges,
        )  # fmt: skip
        now = until
    return state, cell, n_edges
