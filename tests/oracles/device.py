"""The devices again in laboratory coordinates, with integrators that are independent of the code under test.

The state is x, v of the handle, x, v of the motor's side, and the motor's force (N at the handle). Where there is no
cable the motor's side is the handle itself.
"""

import math
from decimal import Decimal, localcontext

import numpy as np
from scipy.integrate import solve_ivp

from hardwall.sim.world.device import Device, Motor, Transmission
from hardwall.sim.world.linear import State


def between(rng, low, high):
    """Return a random number from `low` to `high`, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_motor(rng):
    return Motor(between(rng, 0.5, 5), between(rng, 1e-3, 1e-2), between(rng, 0.01, 0.2), between(rng, 1, 10), 0.01)


def random_cable(rng, stiffness=(1.0, 1e8), mass=(1e-3, 100.0), damping=1e4):
    return Transmission(
        between(rng, *stiffness), float(rng.choice([0.0, between(rng, 1e-2, damping)])), between(rng, *mass),
        float(rng.choice([0.0, between(rng, 1e-2, damping)])),
    )  # fmt: skip


def rates(device: Device, limited: int = 0, stuck: bool = False) -> np.ndarray:
    """Return a matrix (5, 7) that maps the laboratory state, 1 and the command to d/dt of the laboratory state."""
    m, b = device.mass_kg, device.viscous_n_s_per_m
    table = np.zeros((5, 7))
    handle, motor = np.zeros(7), np.zeros(7)
    lag = device.bandwidth_hz is not None or device.motor is not None
    force = np.zeros(7)
    force[4 if lag else 6] = 1
    if device.hand:
        m += device.hand.mass_kg
        handle[0] -= device.hand.stiffness_n_per_m
        handle[1] -= device.hand.damping_n_s_per_m
        handle[5] += device.hand.stiffness_n_per_m * device.hand.rest_m
    handle[1] -= b
    if device.transmission:
        k, d, mm, bm = vars(device.transmission).values()
        cable = np.array([-k, -d, k, d, 0, 0, 0])  # on the handle
        handle, motor = handle + cable, force - cable
        motor[3] -= bm
        table[2, 3] = 1
        table[3] = motor / mm
    else:
        handle = handle + force
    if not stuck:
        table[0, 1] = 1
        table[1] = handle / m
    if not device.transmission:
        table[2:4] = table[:2]
    if lag:
        w = 2 * math.pi * (device.bandwidth_hz or 0.0)
        if device.motor and (limited or not w):
            r, inductance, kt, volts, radius = vars(device.motor).values()
            table[4, 4] = -r / inductance
            table[4, 3] = -((kt / radius) ** 2) / inductance
            table[4, 5 if w else 6] = kt / radius * volts / inductance * limited if w else r / inductance
        else:
            table[4, 4], table[4, 6] = -w, w
    return table


def laboratory(device: Device, state: State) -> np.ndarray:
    """Return the simulation's state in laboratory coordinates."""
    x, v, others = state.position_m, state.velocity_m_per_s, list(state.others)
    stretch, stretching = (others.pop(0), others.pop(0)) if device.transmission else (0.0, 0.0)
    return np.array([x, v, x + stretch, v + stretching, others[0]])


def ours(device: Device, y) -> State:
    """Return a laboratory state as the simulation's state."""
    others = [float(y[2] - y[0]), float(y[3] - y[1])] if device.transmission else []
    others += [y[4]] if device.bandwidth_hz is not None or device.motor else []
    return State(float(y[0]), float(y[1]), tuple(float(v) for v in [*others, 0.0, 0.0, 0.0][:3]), 0)


def exponential(matrix: np.ndarray, seconds: float, vector) -> list[Decimal]:
    """Return e^(matrix seconds) vector to far more digits than a float has."""
    with localcontext() as context:
        context.prec = 60
        size = len(matrix)
        norm = float(np.abs(matrix).sum(axis=0).max()) * seconds
        halvings = math.ceil(math.log2(max(norm, 1.0))) + 4
        step = Decimal(seconds) / 2**halvings
        small = [[Decimal(float(value)) * step for value in row] for row in matrix]

        def times(a, b):
            return [
                [sum((a[i][k] * b[k][j] for k in range(size) if a[i][k] and b[k][j]), Decimal(0)) for j in range(size)]
                for i in range(size)
            ]

        term = total = [[Decimal(int(i == j)) for j in range(size)] for i in range(size)]
        for n in range(1, 26):  # (1/16)^26 / 26! is 1e-58
            term = [[value / n for value in row] for row in times(term, small)]
            total = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
        for _ in range(halvings):
            total = times(total, total)
        return [sum(a * Decimal(float(b)) for a, b in zip(row, vector, strict=True)) for row in total]


def _event(function, wanted, direction):
    """Return an event for `solve_ivp`."""

    def event(_, state):
        return function(state) - wanted

    event.terminal, event.direction = True, direction
    return event


def asked_v(device: Device, y, command: float) -> float:
    """Return the voltage that a current loop asks of a laboratory state."""
    r, inductance, kt, _, radius = vars(device.motor).values()
    kf, w = kt / radius, 2 * math.pi * device.bandwidth_hz
    return (r * y[4] + kf**2 * y[3] + inductance * w * (command - y[4])) / kf


def integrated(device: Device, y, command: float, seconds: float) -> tuple[np.ndarray, list[str]]:
    """Return the laboratory state after an interval, by numerical integration with events, and the events' names."""
    y, left, happened = np.array(y, float), seconds, []
    level = device.coulomb_n or 0.0
    volts = device.motor is not None and device.bandwidth_hz is not None
    inputs = np.array([1.0, command])
    mass = device.mass_kg + (device.hand.mass_kg if device.hand else 0.0)

    def on_handle(state):
        return float(rates(device)[1] @ [*state, *inputs]) * mass

    def voltage(state):
        return asked_v(device, state, command)

    limit = device.motor.voltage_limit_v if volts else math.inf
    asked = voltage(y) if volts else 0.0
    limited = int(np.sign(asked)) if abs(asked) > limit else 0
    while left > 0:
        assert len(happened) < 100
        force = on_handle(y)
        stuck = device.coulomb_n is not None and y[1] == 0 and abs(force) <= level and happened[-1:] != ["breaks"]
        along = 0 if stuck or device.coulomb_n is None else float(np.sign(y[1] if y[1] != 0 else force))
        if along and y[1] == 0:
            y[1] = along * 1e-15  # SciPy does not find an event that begins at its own value
        table = rates(device, limited, stuck)
        matrix, constant = table[:, :5].copy(), table[:, 5:] @ inputs
        constant[1 if device.transmission else slice(1, 4, 2)] -= along * level / mass

        def change(_, state, matrix=matrix, constant=constant):
            return matrix @ state + constant

        # (function, the value at which the event happens, its direction, its name)
        watched = []
        if device.coulomb_n is not None and not stuck:
            watched = [(lambda s: s[1], 0.0, -along, "rests")]
        elif stuck:
            watched = [(on_handle, side * level, side, "breaks") for side in (-1, 1)]
        if limited:
            watched.append((voltage, limited * limit, -limited, "recovers"))
        elif volts:
            watched += [(voltage, side * limit, side, "limits") for side in (-1, 1)]
        events = [_event(*each[:3]) for each in watched]
        # An event is found by its sign at the ends of a step: two in one step are missed, so steps must be short.
        options = {"events": events, "rtol": 1e-11, "atol": 1e-13, "max_step": seconds / 50}
        solution = solve_ivp(change, (0, left), y, "DOP853", **options)
        y, left = solution.y[:, -1], left - solution.t[-1]
        for times, (_, _, side, name) in zip(solution.t_events or [], watched, strict=True):
            if len(times):
                happened.append(name)
                if name == "rests":
                    y[1] = 0.0
                    if not device.transmission:
                        y[3] = 0.0
                elif name == "limits":
                    limited = side
                elif name == "recovers":
                    limited = 0
    return y, happened
