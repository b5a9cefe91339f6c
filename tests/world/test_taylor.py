"""Devices with more parts than a handle: against 60-digit exponentials, integrators with events, and the geometry."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import matrix_balance

from hardwall.model.runtime.compiled import compiled
from hardwall.model.stamped import Edges, room_for
from hardwall.sim.world import rigid
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.device import Device, Hand, Motor, Transmission, equations, fastest_per_s, train
from hardwall.sim.world.encoder import Encoder, level, locate, offsets
from hardwall.sim.world.linear import State, stretch
from oracles.device import (
    asked_v,
    between,
    exponential,
    integrated,
    laboratory,
    ours,
    random_cable,
    random_motor,
    rates,
)
from stimuli.device_motion import ANYWHERE, COARSE, NO_EDGES, after, moved
from stimuli.lengths import LONG

U = 2.0**-53


def random_device(rng, dry):
    parts = {}
    if rng.random() < 0.7:
        parts["transmission"] = random_cable(rng)
    if rng.random() < 0.5:
        damping = float(rng.choice([0.0, between(rng, 1e-2, 1e4)]))
        parts["hand"] = Hand(between(rng, 1e-3, 10), damping, between(rng, 1, 1e8), float(rng.normal()))
    if rng.random() < 0.6:
        parts["bandwidth_hz"] = between(rng, 10, 1e5)
    elif rng.random() < 0.5:
        parts["motor"] = random_motor(rng)
    coulomb = between(rng, 1e-3, 10) if dry else None
    viscous = float(rng.choice([0.0, between(rng, 1e-3, 1e4)]))
    return Device(between(rng, 1e-3, 100), viscous, coulomb, **parts)


CORNERS = [
    Device(mass, 0.0, transmission=Transmission(stiffness, damping, mass, 0.0))
    for mass in (1e-3, 100.0) for stiffness in (1.0, 1e8) for damping in (0.0, 1e4)
]  # fmt: skip


def test_motion_without_events_is_the_exponential_from_extreme_to_extreme():
    """Every leg adds roundings of the balanced state's size, in all under 64 halves of a unit.

    The series, with n + 2 = 7 products a term, adds less than (7 + 2) e; the entries of the tables, with a few
    roundings each, add no more than that again.
    """
    rng = np.random.default_rng(1)
    worst, compared = 0.0, 0
    cases = [(device, step) for device in CORNERS for step in (1e-7, 1e-5)]
    cases += [(random_device(rng, dry=False), between(rng, 1e-7, 1e-3)) for _ in range(150)]
    for device, seconds in cases:
        free = equations(device)
        legs = int(np.ceil(fastest_per_s(device) * seconds)) + 1
        if legs > 25_000:
            continue
        y = rng.normal(size=5) * [0.1, 1.0, 0.0, 1.0, 1.0]
        y[2] = y[0] + rng.normal() * 1e-3
        if not device.transmission:
            y[2:4] = y[:2]
        command = float(rng.normal(0, 3))
        motor_stall = device.motor.stall_n if device.motor and device.bandwidth_hz is None else np.inf
        given = min(max(command, -motor_stall), motor_stall)
        whole = np.zeros((7, 7))
        whole[:5] = rates(device)
        expected = ours(device, exponential(whole, seconds, [*y, 1.0, given])[:5])
        found = moved(device, ours(device, y), command, seconds)

        n = len(free.rates)
        start, end, exact = (np.array([*state[:2], *state.others])[:n] for state in (ours(device, y), found, expected))
        _, (scales, _) = matrix_balance(free.rates[:, :n], permute=False, separate=True)
        sizes = scales * max(np.abs(each / scales).max() for each in (start, exact))
        sizes += np.abs(free.rates[:, n:] @ [1.0, given]) / fastest_per_s(device)
        error = (np.abs(end - exact) / (U * legs * sizes)).max()
        worst, compared = max(worst, error), compared + 1
    assert worst <= 64
    assert compared > 140


def test_sticking_and_limits_agree_with_numerical_integration():
    rng = np.random.default_rng(2)
    seen = dict.fromkeys(("rests", "breaks", "limits", "recovers"), 0)
    for case in range(400):
        parts = {"bandwidth_hz": between(rng, 20, 500)}
        if case % 2:
            parts["transmission"] = random_cable(rng, (1e2, 3e4), (0.02, 0.5), 20.0)
        if case % 3 == 0:
            parts["hand"] = Hand(0.1, between(rng, 0.1, 20), between(rng, 10, 1000), float(rng.normal(0, 0.01)))
        if case % 4 < 2:
            parts["motor"] = random_motor(rng)
        device = Device(between(rng, 0.05, 1), between(rng, 0.01, 5), between(rng, 0.01, 2), **parts)
        y = rng.normal(size=5) * [0.01, 0.1, 0.0, 0.1, 1.0]
        y[2] = y[0] + rng.normal() * 1e-3
        if case % 5 < 2:
            y[1] = 0.0
        if "transmission" not in parts:
            y[2:4] = y[:2]
        command, seconds = float(rng.normal(0, 4)), between(rng, 1e-3, 2e-2)
        expected, happened = integrated(device, y, command, seconds)
        for name in happened:
            seen[name] += 1
        found = laboratory(device, moved(device, ours(device, y), command, seconds))
        if device.transmission is None:
            expected[2:4] = expected[:2]
        assert found == pytest.approx(expected, rel=1e-7, abs=1e-8), (case, device, happened)
    assert min(seen.values()) >= 20, seen


def test_sticking_and_limits_agree_with_numerical_integration_from_extreme_to_extreme():
    """Forces of some newtons act on any stiffness, mass and damping.

    The integrator errs by 1e-11 a step, in at most some thousand steps, and by as little at every event: the tolerance,
    a millionth of the change, is far larger.
    """
    rng = np.random.default_rng(7)
    seen = dict.fromkeys(("rests", "breaks", "limits", "recovers"), 0)
    cases = 1500 if LONG else 300
    for case in range(cases):
        device = random_device(rng, dry=True)
        motor = device.motor or random_motor(rng)
        device = replace(device, motor=motor)
        seconds = min(between(rng, 1e-7, 1e-3), 1000 / fastest_per_s(device))
        hand, cable = device.hand, device.transmission
        y = rng.normal(size=5) * [1e-3, 0.1 * between(rng, 1e-3, 1), 0.0, 0.1 * between(rng, 1e-3, 1), 1.0]
        if hand:
            y[0] = hand.rest_m + rng.normal() * min(10 / hand.stiffness_n_per_m, 1e-2)
        if case % 5 < 2:
            y[1] = 0.0
        y[2:4] = [y[0] + rng.normal() * min(10 / cable.stiffness_n_per_m, 1e-2), y[3]] if cable else y[:2]
        if device.bandwidth_hz:
            command = float(rng.normal(0, 4))
            limit_v = abs(asked_v(device, y, command)) * between(rng, 0.8, 1.2)
            device = replace(device, motor=replace(motor, voltage_limit_v=limit_v))
        else:
            command = motor.stall_n * float(rng.uniform(-1, 1))
        expected, happened = integrated(device, y, command, seconds)
        for name in happened:
            seen[name] += 1
        found = laboratory(device, moved(device, ours(device, y), command, seconds))
        if not cable:
            expected[2:4] = expected[:2]
        assert (abs(found - expected) <= 1e-6 * abs(expected - y) + 1e-12).all(), (case, device, happened)
    assert min(seen.values()) >= cases // 75, seen


def test_a_voltage_that_crosses_all_of_its_range_in_a_leg_is_followed():
    """With narrow limits and fast devices, whole legs agree with legs of another length, and one case with SciPy."""
    motor = Motor(
        1.8173661069341358, 2.3265107419110975e-4, 0.4116723507997901, 0.5511340164319264, 0.010239159076919186
    )
    device = Device(
        0.0033818178039655943, bandwidth_hz=15.979827711410739, motor=motor,
        hand=Hand(0.0, 0.0, 12015192.797688242, -7.833879805856382e-05),
    )  # fmt: skip
    state = State(-7.809452347391156e-05, -0.04945183797444533, (-2.2938110501431392, 0.0, 0.0), 0)
    command, seconds = 0.011602462336783888, 7.745856374583966e-4
    found = moved(device, state, command, seconds)
    expected, happened = integrated(device, laboratory(device, state), command, seconds)
    assert happened.count("limits") > 5
    assert laboratory(device, found) == pytest.approx(expected, rel=1e-6, abs=1e-9)
    rng, apart = np.random.default_rng(6), 0
    for _ in range(300):
        motor = Motor(between(rng, 1, 20), between(rng, 1e-4, 1e-2), 0.2, between(rng, 0.01, 1), 0.01)
        device = Device(
            between(rng, 1e-3, 1), bandwidth_hz=between(rng, 10, 1000), motor=motor,
            hand=Hand(0.0, 0.0, between(rng, 1e3, 1e7), 0.0),
        )  # fmt: skip
        state = State(float(rng.normal() * 1e-4), float(rng.normal() * 0.1), (float(rng.normal()), 0.0, 0.0), 0)
        system, command = train(device, 1e-3), float(rng.normal())
        legs = system, system._replace(leg_s=system.leg_s / 3.7)
        ends = [after(each, state, command, 1e-3) for each in legs]
        scale = max(abs(end.velocity_m_per_s) for end in ends) + 1e-3
        assert abs(ends[0].velocity_m_per_s - ends[1].velocity_m_per_s) < 1e-7 * scale
        apart += ends[0] != ends[1]
    assert apart > 200, "legs of another length round otherwise"


@pytest.mark.parametrize("coulomb", [None, 0.3])
def test_a_handle_alone_moves_as_the_closed_form_has_it(coulomb):
    rng = np.random.default_rng(3)
    friction = rigid.Coulomb(coulomb) if coulomb else None
    for _ in range(300):
        mass, viscous = between(rng, 1e-3, 100), float(rng.choice([0.0, between(rng, 1e-3, 10)]))
        seconds, force = between(rng, 1e-6, 1e-2), float(rng.normal())
        start = rigid.Motion(float(rng.normal()), float(rng.normal() * rng.integers(0, 2) * 1e-2))
        handle = rigid.Handle(mass, viscous)
        expected = after(rigid.Rigid(handle, friction), start, force, rigid.span(handle, seconds))
        device = Device(mass, viscous, coulomb, hand=Hand(0.0, 0.0, 0.0, 0.0))
        found = moved(device, State(*start, (0.0, 0.0, 0.0), 0), force, seconds)
        scale = abs(start.velocity_m_per_s) + (abs(force) + (coulomb or 0)) * seconds / mass
        assert found[:2] == pytest.approx(expected, rel=8 * U, abs=64 * U * scale)


@pytest.mark.parametrize("stiffness", [1.0, 1e8])
@pytest.mark.parametrize("mass", [1e-3, 100.0])
def test_two_masses_on_an_undamped_cable_keep_their_energy(stiffness, mass):
    """Over a hundred thousand intervals of a tenth of the fastest time, energy walks by roundings without a drift."""
    device = Device(mass, transmission=Transmission(stiffness, 0.0, mass, 0.0))
    seconds = 0.1 / fastest_per_s(device)
    system, steps = train(device, seconds), 100_000

    @compiled
    def run(system, encoder, moment, interval, steps, edges):
        for _ in range(steps):
            moment = stretch(system, encoder, moment, 0.0, 0.0, interval.length, interval, edges)
        return moment

    def energy(state):
        v, (stretch_m, stretching, _) = state.velocity_m_per_s, state.others
        return mass * (v**2 + (v + stretching) ** 2) / 2 + stiffness * stretch_m**2 / 2

    start = State(0.0, 0.3, (1e-3, -0.1, 0.0), 0)
    end = run(system, COARSE, Moment(start, ANYWHERE, 0), Interval(seconds, 0, 1), steps, NO_EDGES).motion
    assert energy(end) == pytest.approx(energy(start), rel=20 * np.sqrt(steps) * U)
    momentum = [mass * (2 * state.velocity_m_per_s + state.others[1]) for state in (start, end)]
    assert momentum[1] == pytest.approx(momentum[0], rel=20 * np.sqrt(steps) * U)


@pytest.mark.parametrize("at_motor", [False, True])
def test_pins_show_the_geometry_at_every_clock(at_motor):
    """The stamps of whole intervals agree with the encoder's position clock by clock."""
    rng = np.random.default_rng(4 + at_motor)
    encoder = Encoder(1e-4, 1e4, offsets(0.2, 0.1))
    edges = near = 0
    for _ in range(60):
        cable = random_cable(rng, (1e3, 1e5), (0.02, 0.3), 10.0)
        device = Device(
            0.2, 1.0, float(rng.uniform(0.01, 1)), bandwidth_hz=300.0, transmission=cable, encoder_at_motor=at_motor
        )
        clocks = int(rng.integers(20, 100))
        seconds, command = clocks / encoder.clock_hz, float(rng.normal(0, 5))
        start = State(0.0, float(rng.normal() * 0.2), (float(rng.normal() * 1e-3), 0.0, 0.0), 0)
        at = start.others[0] if at_motor else 0.0
        system = train(device, seconds)
        found, cell = room_for(5000), locate(encoder, at)
        interval = Interval(seconds, 0, clocks)
        _, last, n_edges = advance(system, encoder, Moment(start, cell, 0), command, interval, found)
        stamps, words = found
        assert n_edges >= 0
        assert (np.diff(stamps[:n_edges]) >= 0).all()
        assert ((stamps[:n_edges] >= 1) & (stamps[:n_edges] <= clocks)).all()
        for clock in range(1, clocks + 1):
            here = moved(device, start, command, clock / encoder.clock_hz)
            seen_m = here.position_m + here.others[0] * at_motor
            true, passed = locate(encoder, seen_m), int((stamps[:n_edges] <= clock).sum())
            shown = words[passed - 1] if passed else level(cell.number)
            if min(abs(seen_m - true.lower_m), abs(seen_m - true.upper_m)) < 1e-12:
                near += 1
                continue
            assert shown == level(true.number), clock
        assert last.number == locate(encoder, seen_m).number
        edges += n_edges
    assert edges > 500
    assert near < 20


def test_a_handle_that_sticks_keeps_its_place_bit_for_bit():
    device = Device(0.3, 1.0, 0.5, bandwidth_hz=200.0)
    state = State(0.1, 0.0, (0.2, 0.0, 0.0), 0)
    for _ in range(50):
        state = moved(device, state, 0.45, 1e-4)
        assert state[:2] == (0.1, 0.0)
    assert state.others[0] == pytest.approx(0.45 - 0.25 * np.exp(-2 * np.pi * 200 * 5e-3), rel=1e-12)


def test_full_arrays_are_reported():
    device = Device(0.3, bandwidth_hz=200.0)
    encoder = Encoder(1e-6, 1e6)
    stamps, words = np.full(4, -1), np.full(4, -1)
    moment = Moment(State(0.0, 1.0, (0.0, 0.0, 0.0), 0), locate(encoder, 0.0), 0)
    end = advance(train(device, 1e-3), encoder, moment, 0.0, Interval(1e-3, 0, 1000), Edges(stamps[:3], words))
    assert end.n_edges == -1
    assert stamps[3] == words[3] == -1
