"""A linear device with sticking friction and a limited voltage, and its encoder, solved to rounding.

In each phase a Taylor polynomial gives the state over a leg to rounding: a leg is short enough for a series of fixed
length. The quantities that decide on events are polynomials too: the encoder passes an edge, the handle comes to rest
or breaks loose, the voltage meets or leaves its limit. For every event, either the size of the coefficients excludes
it, or the slope keeps one sign and the values at the ends decide; otherwise the leg is halved. Then Newton's method
finds the earliest event, and the next leg begins there.
"""

from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled
from .advance import Moment, advance, advance_quietly
from .converter import Pulse
from .encoder import level, next_cell, stamp
from .linear import (
    COMMAND,
    EXTRA,
    GRIP,
    ONE,
    QUANTITIES,
    SEEN,
    STATES,
    STUCK,
    VOLTAGE,
    State,
    advance_in_stretches,
    along_of,
    limited_of,
    never_quietly,
    phase_number,
    stretch,
    with_more,
)
from .polynomials import FIRST, NEVER, UNSURE, at, leaves, measure, root, shorten, stays

HALVINGS = 40
"""Halvings of a leg after which the values at its ends alone decide: by then it is as short as rounding."""
STALLED = 8
"""After so many events in a row, each within `BRIEF` of the one before, a leg of that length passes without events."""
BRIEF = 1e-6
"""The length of such a brief leg, as a part of the longest leg."""


class Train(NamedTuple):
    """A linear device in the form that `device.train` makes."""

    tables: np.ndarray  # (PHASES, QUANTITIES, COLUMNS): dy/dt and watched quantities, by y, by 1, by the command
    series: np.ndarray  # scratch, (FIRST + order + 1, QUANTITIES): the polynomials of the leg
    # Of a device with `State.more` there are `EXTRA` more quantities, and in `tables` as many more columns.
    coulomb_n: float  # negative for none
    voltage_limit_n: float
    command_limit_n: float
    pulse: Pulse
    leg_s: float


advance_quietly.register(Train)(never_quietly)
advance.register(Train)(advance_in_stretches)


@compiled
def _more_of(series, row, more):
    """Return a row of the polynomials of the states in `more`; None if there are none."""
    if more is None:
        return more
    return series[row, QUANTITIES], series[row, QUANTITIES + 1]


@compiled
def _more_at(series, time, more):
    """Return the states in `more` at a time of the leg, 0 to 1; None if there are none."""
    if more is None:
        return more
    return at(series, QUANTITIES, time), at(series, QUANTITIES + 1, time)


@compiled
def expand(tables, series, phase, state, more, command_n, seconds):
    """Fill `series` with the polynomials of a leg in the time t / seconds, 0 to 1; `more` belongs to the state."""
    last, quantities = len(series) - 1, QUANTITIES
    if more is not None:
        quantities = QUANTITIES + EXTRA
        series[FIRST, QUANTITIES], series[FIRST, QUANTITIES + 1] = more
    series[FIRST, 0] = state.position_m
    series[FIRST, 1] = state.velocity_m_per_s
    for i in range(STATES - 2):
        series[FIRST, 2 + i] = state.others[i]
    for j in range(FIRST, last + 1):
        y = series[j, 0], series[j, 1], series[j, 2], series[j, 3], series[j, 4]
        more_y = _more_of(series, j, more)
        share = seconds / (j - FIRST + 1)
        for number in range(quantities):
            change = tables[phase, number, ONE] + tables[phase, number, COMMAND] * command_n
            change = change if j == FIRST else 0.0
            for k in range(STATES):
                change += tables[phase, number, k] * y[k]
            change = with_more(change, tables, phase, number, more_y)
            if STATES <= number < QUANTITIES:
                series[j, number] = change
            elif j < last:
                series[j + 1, number] = share * change
    if state.velocity_m_per_s == 0.0 and phase // 3 != STUCK // 3:
        # At a break v begins at zero, without a sign. v / t has the sign of v, and watching it avoids many halvings.
        for j in range(FIRST, last):
            series[j, GRIP] = series[j + 1, 1]
        series[last, GRIP] = 0.0
    measure(series)


@compiled
def _breaks(series, coulomb_n, along, surely):
    """Return the time at which the handle comes to rest, or breaks loose: see `leaves`."""
    if coulomb_n < 0.0:
        return NEVER
    if along == 0:
        return leaves(series, GRIP, -coulomb_n, np.nextafter(coulomb_n, np.inf), surely)
    return leaves(series, GRIP, 0.0 if along > 0 else -np.inf, np.inf if along > 0 else 5e-324, surely)


@compiled
def _switches(series, most, limited, surely):
    """Return the time at which the voltage meets its limit, or leaves it: see `leaves`."""
    if most == np.inf:
        return NEVER
    if limited == 0:
        return leaves(series, VOLTAGE, -most, np.nextafter(most, np.inf), surely)
    return leaves(series, VOLTAGE, most if limited > 0 else -np.inf, np.inf if limited > 0 else -most, surely)


@compiled
def emit(series, number, encoder, cell, n_edges, leg, interval, edges):
    """Append the edges that the encoder passes in a leg; return (cell, n_edges).

    Args:
        series: the polynomials of the leg.
        number: number of the encoder's position among them; it is monotone.
        leg: (its beginning in the interval, s; its length, s; its time of 0 to 1 at which the search ends).

    If the arrays are full, the returned n_edges is -1.
    """
    now_s, seconds, end = leg
    room = min(len(edges.clocks), len(edges.levels))
    seen_m, passed = at(series, number, end), 0.0
    while not cell.lower_m <= seen_m < cell.upper_m and 0 <= n_edges < room:
        upwards = seen_m >= cell.upper_m
        passed = root(series, number, cell.upper_m if upwards else cell.lower_m, passed)
        at_s = now_s + min(passed, end) * seconds
        edges.clocks[n_edges] = stamp(encoder, cell, upwards, at_s, interval)
        cell = next_cell(encoder, cell, upwards)
        edges.levels[n_edges] = level(cell.number)
        n_edges += 1
    return cell, n_edges if cell.lower_m <= seen_m < cell.upper_m else -1


@stretch.register(Train)
@compiled
def _stretch(train, encoder, moment, command_n, since_s, until_s, interval, edges):
    state, cell, n_edges = moment
    series, now_s, stalled = train.series, since_s, 0
    along, limited = along_of(train, state, command_n), limited_of(train, state, command_n)
    while now_s < until_s:
        seconds = min(until_s - now_s, train.leg_s)
        blind = stalled >= STALLED
        if blind:
            seconds *= BRIEF
        expand(train.tables, series, phase_number(along, limited), state, state.more, command_n, seconds)
        for halving in range(HALVINGS + 1):
            surely = halving == HALVINGS
            inside, one_way = stays(series, SEEN, cell.lower_m, cell.upper_m)
            breaks = NEVER if blind else _breaks(series, train.coulomb_n, along, surely)
            switches = NEVER if blind else _switches(series, train.voltage_limit_n, limited, surely)
            if surely or ((inside or one_way) and UNSURE not in (breaks, switches)):
                break
            shorten(series, 0.5)
            seconds *= 0.5
        end = min(breaks, switches, 1.0)
        if not inside:
            leg = now_s, seconds, end
            cell, n_edges = emit(series, SEEN, encoder, cell, n_edges, leg, interval, edges)
            if n_edges < 0:
                break
        others = at(series, 2, end), at(series, 3, end), at(series, 4, end)
        more = _more_at(series, end, state.more)
        stalled = stalled + 1 if end * seconds < BRIEF * train.leg_s and not blind else 0
        now_s = until_s if end == 1.0 and seconds == until_s - now_s else now_s + end * seconds
        state = State(at(series, 0, end), at(series, 1, end), others, state.width, more)
        if end == 1.0:
            continue
        if switches < breaks:
            limited = 0 if limited != 0 else (1 if at(series, VOLTAGE, end) > 0.0 else -1)
        elif along == 0:
            along = 1 if at(series, GRIP, end) > 0.0 else -1
        else:
            state = State(state.position_m, 0.0, others, state.width, more)
            along = along_of(train, state, command_n)
    return Moment(state, cell, n_edges)
