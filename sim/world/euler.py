"""A linear device in fixed steps of semi-implicit Euler, the usual method, for comparison with `taylor`.

It uses the same tables in steps of `step_s`; the last step before the command changes is the rest of the interval:

- velocities, the motor's force, and what its shunt adds, change by their rates at the beginning of the step;
- positions change linearly by the new velocities, and edges are passed on that line; otherwise a handle that passes two
  edges in a step would make an illegal transition of the pins;
- Coulomb friction is clamped: where a step would turn the handle, and friction could hold it, the handle rests; it
  breaks loose in the first step whose force exceeds friction;
- the voltage is within its limits, or at one of them, for a whole step.

The error is of the order of a step. A scene may not have steps in which the device itself diverges (`longest_s`). In
shorter steps a limited force moves the device by a bounded amount. So a run stays finite until it ends, and an unstable
wall gets its verdict, as with the other solvers.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled
from .advance import Moment, advance, advance_quietly
from .converter import Pulse
from .device import Device, equations
from .encoder import level, next_cell, stamp
from .linear import (
    GRIP,
    QUANTITIES,
    SEEN,
    STUCK,
    State,
    advance_in_stretches,
    along_of,
    limited_of,
    never_quietly,
    phase_number,
    quantity,
    stretch,
)
from .taylor import Train

ROUNDING = 1e-6
"""The excess that rounding may add to an eigenvalue of 1: the root of a unit in the last place if it is double, and a
little more."""
BISECTIONS = 50


class Stepped(NamedTuple):
    """A device in the form that `stepped` makes; its fields have the same meaning as in `taylor.Train`."""

    tables: np.ndarray
    coulomb_n: float
    voltage_limit_n: float
    command_limit_n: float
    pulse: Pulse
    cable: bool  # whether the state has a cable's stretch and its rate
    shunted: bool  # whether it has those of a shunt
    step_s: float


advance_quietly.register(Stepped)(never_quietly)
advance.register(Stepped)(advance_in_stretches)


def stepped(train: Train, device: Device, step_s: float) -> Stepped:
    """Return a device in the form that this solver advances.

    Args:
        train: the result of `device.train`.
        device: the device itself.
        step_s: length of a step.
    """
    limits = train.voltage_limit_n, train.command_limit_n
    cable, shunted = device.transmission is not None, device.shunt is not None
    return Stepped(train.tables, train.coulomb_n, *limits, train.pulse, cable, shunted, step_s)


def growth(device: Device, step_s: float) -> float:
    """Return the factor by which a step may grow the state without a command: its largest eigenvalue in any phase."""
    places, largest = ([0, 2] if device.transmission else [0]), 0.0
    for along, limited in product((0, 1), (0, 1)):
        rates = equations(device, along, limited).rates
        n = len(rates)
        with_velocity = np.zeros((n, n))
        with_velocity[places] = rates[places, :n]
        rest = rates[:, :n] - with_velocity
        step = (np.eye(n) + step_s * with_velocity) @ (np.eye(n) + step_s * rest)
        largest = max(largest, float(np.abs(np.linalg.eigvals(step)).max()))
    return largest


def longest_s(device: Device, most_s: float) -> float:
    """Return the longest step (s), up to `most_s`, in which the device itself does not diverge."""
    if growth(device, most_s) <= 1 + ROUNDING:
        return most_s
    low, high = 0.0, most_s
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(device, middle) <= 1 + ROUNDING else (low, middle)
    return low


@compiled
def _more_stepped(plant, phase, state, more, command_n, seconds):
    """Return `more` of the state after one step; None if there is none."""
    if more is None:
        return more
    first = more[0] + seconds * quantity(plant.tables, phase, QUANTITIES, state, command_n)
    return first, more[1] + seconds * quantity(plant.tables, phase, QUANTITIES + 1, state, command_n)


@compiled
def step(plant, state, command_n, seconds):
    """Return the `State` after one step."""
    tables = plant.tables
    along, limited = along_of(plant, state, command_n), limited_of(plant, state, command_n)
    phase = phase_number(along, limited)
    velocity = state.velocity_m_per_s + seconds * quantity(tables, phase, 1, state, command_n)
    # Without friction the level is negative, and nothing is held.
    held = velocity * along <= 0.0 and abs(quantity(tables, STUCK, GRIP, state, command_n)) <= plant.coulomb_n
    stopped = velocity if held else 0.0
    velocity -= stopped
    first, second, third = state.others
    more = _more_stepped(plant, phase, state, state.more, command_n, seconds)
    if plant.cable:
        # The motor's side is not stopped with the handle.
        second += seconds * quantity(tables, phase, 3, state, command_n) + stopped
        first += seconds * second
        third += seconds * quantity(tables, phase, 4, state, command_n)
    else:
        first += seconds * quantity(tables, phase, 2, state, command_n)
        if plant.shunted:
            second += seconds * quantity(tables, phase, 3, state, command_n)
            third += seconds * quantity(tables, phase, 4, state, command_n)
    return State(state.position_m + seconds * velocity, velocity, (first, second, third), state.width, more)


@compiled
def _seen(plant, state):
    """Return the encoder's position: the handle's, or with the stretch added the position of the motor's side."""
    return state.position_m + plant.tables[STUCK, SEEN, 2] * state.others[0]


@stretch.register(Stepped)
@compiled
def _stretch(plant, encoder, moment, command_n, since_s, until_s, interval, edges):
    state, cell, n_edges = moment
    room = min(len(edges.clocks), len(edges.levels))
    # The margin keeps rounding from adding a step to a whole number of steps.
    steps = math.ceil((until_s - since_s) / plant.step_s * (1 - 1e-9))
    for number in range(steps):
        begin_s = since_s + number * plant.step_s
        seconds = (until_s if number == steps - 1 else begin_s + plant.step_s) - begin_s
        before_m = _seen(plant, state)
        state = step(plant, state, command_n, seconds)
        after_m = _seen(plant, state)
        while not cell.lower_m <= after_m < cell.upper_m and 0 <= n_edges < room:
            upwards = after_m >= cell.upper_m
            edge_m = cell.upper_m if upwards else cell.lower_m
            at_s = begin_s + seconds * (edge_m - before_m) / (after_m - before_m)
            edges.clocks[n_edges] = stamp(encoder, cell, upwards, at_s, interval)
            cell = next_cell(encoder, cell, upwards)
            edges.levels[n_edges] = level(cell.number)
            n_edges += 1
        if not cell.lower_m <= after_m < cell.upper_m:
            n_edges = -1
            break
    return Moment(state, cell, n_edges)
