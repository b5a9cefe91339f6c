"""A motor with a damping circuit across its terminals: against the circuit's own equations in volts and amperes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hardwall.sim.world.device import Device, Hand, Motor, Shunt, Transmission, equations, fastest_per_s, train
from hardwall.sim.world.euler import stepped
from hardwall.sim.world.linear import State
from oracles.device import between, random_cable
from stimuli.device_motion import after, moved

MOTOR = Motor(2.0, 3e-4, 0.04, 24.0, 0.01)  # kf = 4 N/A: 8 N s/m with its terminals shorted
SHUNTS = {"resistor": Shunt(3.0), "resistor and capacitor": Shunt(3.0, 2e-3)}
NEVER_V = 1e5
"""A voltage that no amplifier here reaches."""


class Circuit:
    """Handle, motor's side and circuit in SI units: x and v of the handle, x and v of the motor's side, the current of
    the motor (A), the current that the loop asks for (A), and the capacitor's voltage (V)."""

    def __init__(self, device: Device, command: float):
        self.device, self.command = device, command
        self.kf = device.motor.torque_constant_n_m_per_a / device.motor.pulley_radius_m

    def volts(self, y) -> tuple[float, float]:
        """Return the voltage at the terminals, and that which the loop's current would need."""
        shunt, limit = self.device.shunt, self.device.motor.voltage_limit_v
        needed = y[6] + shunt.resistance_ohm * (y[5] - y[4])
        return min(max(needed, -limit), limit), needed

    def shunted_a(self, y) -> float:
        """Return the current through the circuit."""
        return (self.volts(y)[0] - y[6]) / self.device.shunt.resistance_ohm

    def rates(self, _, y):
        device, motor, shunt, cable, hand = self.device, self.device.motor, self.device.shunt, *self.sides()
        x, v, xm, vm, amperes, asked_a, _ = y
        on_motor, mass = self.kf * amperes, device.mass_kg
        on_handle = -device.viscous_n_s_per_m * v
        if hand:
            mass += hand.mass_kg
            on_handle += hand.stiffness_n_per_m * (hand.rest_m - x) - hand.damping_n_s_per_m * v
        if cable:
            pull = cable.stiffness_n_per_m * (xm - x) + cable.damping_n_s_per_m * (vm - v)
            motor_acceleration = (on_motor - pull - cable.motor_viscous_n_s_per_m * vm) / cable.motor_mass_kg
            acceleration = (on_handle + pull) / mass
        else:
            acceleration = motor_acceleration = (on_handle + on_motor) / mass
        terminals = self.volts(y)[0]
        back_emf = motor.torque_constant_n_m_per_a * vm / motor.pulley_radius_m
        # A resistor alone takes a part of the current at standstill, for which the amplifier makes up.
        whole_a = (
            self.command / self.kf * (1 if shunt.capacitance_f else 1 + motor.resistance_ohm / shunt.resistance_ohm)
        )
        return [
            v, acceleration, vm, motor_acceleration,
            (terminals - motor.resistance_ohm * amperes - back_emf) / motor.inductance_h,
            2 * math.pi * device.bandwidth_hz * (whole_a - asked_a),
            self.shunted_a(y) / shunt.capacitance_f if shunt.capacitance_f else 0.0,
        ]  # fmt: skip

    def sides(self):
        return self.device.transmission, self.device.hand

    def after(self, y, seconds: float) -> tuple[np.ndarray, bool]:
        """Return the state after an interval, and whether the voltage met its limit or left it meanwhile.

        Where it does, only the current's rate has a bend, and the integrator's own steps become short enough.
        """
        options = {"rtol": 1e-12, "atol": 1e-14, "max_step": seconds / 50}
        way = solve_ivp(self.rates, (0, seconds), y, "DOP853", **options)
        limited = {volts != needed for volts, needed in map(self.volts, way.y.T)}
        return way.y[:, -1], len(limited) == 2

    def ours(self, y) -> State:
        """Return the state as the simulation's."""
        device, shunt = self.device, self.device.shunt
        gain = 1 if shunt.capacitance_f else 1 + device.motor.resistance_ohm / shunt.resistance_ohm
        states = [y[2] - y[0], y[3] - y[1]] if device.transmission else []
        states += [self.kf * y[4], self.kf * y[5] / gain]
        states += [self.kf * y[6] / device.motor.resistance_ohm] if shunt.capacitance_f else []
        more = len(states) > 3
        states = [float(state) for state in [*states, 0.0, 0.0, 0.0]]
        return State(float(y[0]), float(y[1]), tuple(states[:3]), 0, tuple(states[3:5]) if more else None)


def values(state: State) -> np.ndarray:
    return np.array([state.position_m, state.velocity_m_per_s, *state.others, *(state.more or ())])


def random_case(rng, number: int):
    """Return a device with a shunt and without dry friction, its circuit's state, and a command."""
    motor = Motor(between(rng, 0.3, 10), between(rng, 1e-4, 1e-2), between(rng, 0.01, 0.2), NEVER_V, 0.01)
    parts = {"transmission": random_cable(rng, (1e2, 3e4), (0.02, 0.5), 20.0)} if number % 2 else {}
    if number % 3 == 0:
        parts["hand"] = Hand(0.1, between(rng, 0.1, 20), between(rng, 10, 1000), float(rng.normal(0, 0.01)))
    shunt = Shunt(between(rng, 0.3, 30), between(rng, 1e-5, 1e-2) if number % 4 < 2 else None)
    device = Device(
        between(rng, 0.05, 1),
        between(rng, 0.01, 5),
        bandwidth_hz=between(rng, 20, 2000),
        motor=motor,
        shunt=shunt,
        **parts,
    )
    kf = motor.newtons_per_ampere
    y = rng.normal(size=7) * [0.01, 0.1, 0.0, 0.1, 1 / kf, 1 / kf, 1.0]
    y[2] = y[0] + rng.normal() * 1e-3
    if not device.transmission:
        y[2:4] = y[:2]
    if not shunt.capacitance_f:
        y[6] = 0.0
    return device, y, float(rng.normal(0, 4))


def test_motion_is_that_of_the_circuit_within_and_at_the_limit_of_its_voltage():
    rng, met = np.random.default_rng(1), 0
    for number in range(200):
        device, y, command = random_case(rng, number)
        if number % 5 < 3:
            limit_v = abs(Circuit(device, command).volts(y)[1]) * between(rng, 0.5, 1.5)
            device = replace(device, motor=replace(device.motor, voltage_limit_v=limit_v))
        circuit, seconds = Circuit(device, command), between(rng, 1e-4, 1e-2)
        end, switched = circuit.after(y, seconds)
        expected = values(circuit.ours(end))
        found = values(moved(device, circuit.ours(y), command, seconds))
        assert found == pytest.approx(expected, rel=1e-8, abs=1e-9), (number, device)
        met += switched
    assert met > 30, "as many voltages met their limit or left it"


@pytest.mark.parametrize("name", SHUNTS)
def test_a_held_motor_has_the_force_of_its_command_in_the_end(name):
    """And the amplifier's largest current is that of the motor and the circuit together."""
    device = Device(1e12, bandwidth_hz=1e3, motor=MOTOR, shunt=SHUNTS[name], force_limit_n=20.0)
    most = 20.0 / (5 / 3 if name == "resistor" else 1)
    for command, force in ((7.0, 7.0), (-50.0, -most)):
        end = moved(device, State(0.0, 0.0, (0.0, 0.0, 0.0), 0), command, 0.5)
        assert end.others[0] == pytest.approx(force, rel=1e-9)


def damping_at(shunt: Shunt, hz: float) -> complex:
    """Return force over velocity (N s/m) of a motor that a heavy mass on a spring moves at a frequency, as measured
    over a period."""
    w, mass = 2 * math.pi * hz, 1e9
    device = Device(mass, bandwidth_hz=1e3, motor=MOTOR, shunt=shunt, hand=Hand(0.0, 0.0, mass * w**2, 0.0))
    state, steps = State(0.0, 1.0, (0.0, 0.0, 0.0), 0), 64
    settled = 20 * (MOTOR.resistance_ohm + shunt.resistance_ohm) * (shunt.capacitance_f or 0.0)
    state = moved(device, state, 0.0, math.ceil(settled * hz + 1) / hz)
    forces, speeds = [], []
    for _ in range(steps):
        forces.append(state.others[0])
        speeds.append(state.velocity_m_per_s)
        state = moved(device, state, 0.0, 1 / hz / steps)
    turning = np.exp(-2j * math.pi * np.arange(steps) / steps)
    return -(forces @ turning) / (speeds @ turning)


@pytest.mark.parametrize("name", SHUNTS)
@pytest.mark.parametrize("hz", [0.5, 5.0, 16.0, 50.0, 500.0])
def test_the_damping_is_kf_squared_over_the_impedance_at_every_frequency(name, hz):
    """The corner of 5 ohms and 2 mF is at 15.9 Hz."""
    shunt, s = SHUNTS[name], 2j * math.pi * hz
    impedance = 5.0 + s * 3e-4 + (1 / (s * 2e-3) if shunt.capacitance_f else 0.0)
    assert damping_at(shunt, hz) == pytest.approx(4.0**2 / impedance, rel=1e-6)


def test_the_damping_at_rest_and_far_above_the_corner_is_that_of_the_paper():
    """A resistor damps by kf^2 / (R + Rd) at any speed; with a capacitor a steady motion is free, and a fast one is
    damped as much."""
    resistor, both = SHUNTS.values()
    steady = {}
    for shunt in (resistor, both):
        device = Device(1e12, bandwidth_hz=1e3, motor=MOTOR, shunt=shunt)
        steady[shunt] = moved(device, State(0.0, 1.0, (0.0, 0.0, 0.0), 0), 0.0, 1.0).others[0]
    assert steady[resistor] == pytest.approx(-(4.0**2) / 5, rel=1e-9)
    assert abs(steady[both]) < 1e-9
    slow = Motor(2.0, 1e-9, 0.04, 24.0, 0.01)  # without its inductance to speak of
    device = Device(1e9, bandwidth_hz=1e3, motor=slow, shunt=both)
    at_once = moved(device, State(0.0, 1.0, (0.0, 0.0, 0.0), 0), 0.0, 1e-7).others[0]
    assert at_once == pytest.approx(-(4.0**2) / 5, rel=1e-4)


@pytest.mark.parametrize("limit_v", [NEVER_V, 0.2])
@pytest.mark.parametrize("cable", [False, True])
@pytest.mark.parametrize("name", SHUNTS)
def test_without_a_command_the_circuit_only_takes_energy(name, cable, limit_v):
    """What is lost within the limit is what the two resistors heat; an amplifier at its limit takes some, too."""
    motor = replace(MOTOR, voltage_limit_v=limit_v)
    parts = {"transmission": Transmission(2e4, 0.0, 0.05, 0.0)} if cable else {}
    device = Device(0.3, 0.0, bandwidth_hz=1e3, motor=motor, shunt=SHUNTS[name], **parts)
    start = np.array([0.0, 0.5, 2e-4 * cable, 0.5 - cable, 0.0, 0.0, 0.0])
    state, seconds, capacitance = Circuit(device, 0.0).ours(start), 1e-5, SHUNTS[name].capacitance_f or 0.0
    plant = train(device, seconds)

    def stored_and_lost(state):
        electrical = [*state.others[2 * cable :], *(state.more or ())]
        amperes, volts = electrical[0] / 4.0, electrical[2] * 2.0 / 4.0 if capacitance else 0.0
        stretch, stretching = state.others[:2] if cable else (0.0, 0.0)
        speed = state.velocity_m_per_s
        stored = 0.3 * speed**2 + 0.05 * cable * (speed + stretching) ** 2 + 2e4 * stretch**2
        stored += 3e-4 * amperes**2 + capacitance * volts**2
        return stored / 2, (2.0 + 3.0) * amperes**2

    energies = [stored_and_lost(state)]
    for _ in range(10_000):
        state = after(plant, state, 0.0, seconds)
        energies.append(stored_and_lost(state))
    stored, lost = np.array(energies).T
    assert (np.diff(stored) <= 1e-15).all()
    assert stored[-1] < 0.95 * stored[0]
    if limit_v == NEVER_V:
        heat = float(np.sum(lost[1:] + lost[:-1]) / 2 * seconds)
        assert stored[0] - stored[-1] == pytest.approx(heat, rel=1e-4)


@pytest.mark.parametrize("shunt", [Shunt(1e5), Shunt(1e5, 1e-6), Shunt(3.0, 1e-8)], ids=["R", "R and C", "small C"])
def test_a_circuit_that_takes_no_current_changes_nothing(shunt):
    device = Device(
        0.3,
        1.0,
        bandwidth_hz=200.0,
        motor=replace(MOTOR, voltage_limit_v=NEVER_V),
        transmission=Transmission(2e4, 2.0, 0.05, 0.0),
    )
    start = State(0.0, 0.1, (0.0, 0.0, 1.0), 0)
    plain = values(moved(device, start, 2.0, 1e-3))
    more = start._replace(more=(1.0, 1.0 + MOTOR.damping_n_s_per_m * 0.1) if shunt.capacitance_f else (1.0, 0.0))
    found = values(moved(replace(device, shunt=shunt), more, 2.0, 1e-3))
    assert found[:5] == pytest.approx(plain, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize("cable", [False, True])
@pytest.mark.parametrize("name", SHUNTS)
def test_steps_of_euler_s_method_come_to_the_same(name, cable):
    """Their error is of the first order in the step."""
    parts = {"transmission": Transmission(2e4, 2.0, 0.05, 0.0)} if cable else {}
    motor = replace(MOTOR, voltage_limit_v=NEVER_V)
    device = Device(0.3, 1.0, bandwidth_hz=200.0, motor=motor, shunt=SHUNTS[name], **parts)
    start = Circuit(device, 0.0).ours([0.0, 0.1, 1e-4 * cable, 0.1, 0.25, 0.25, 0.5 * (name != "resistor")])
    exact, errors = values(moved(device, start, 2.0, 1e-2)), []
    for step_s in (2e-6, 1e-6):
        found = values(after(stepped(train(device, 1e-2), device, step_s), start, 2.0, 1e-2))
        errors.append(np.abs(found - exact))
    moving = errors[1] > 1e-12
    assert moving.sum() == len(equations(device).rates)
    assert errors[0][moving] / errors[1][moving] == pytest.approx(2.0, abs=0.1)


def test_it_is_as_fast_as_its_fastest_part():
    """A small capacitor settles with both resistors' rate."""
    device = Device(0.3, 1.0, bandwidth_hz=200.0, motor=MOTOR, shunt=Shunt(3.0, 1e-9))
    assert 1 / (3.0 * 1e-9) <= fastest_per_s(device) < 10 / (3.0 * 1e-9)
