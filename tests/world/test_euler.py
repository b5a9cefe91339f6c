"""The fixed-step solver: against the exact one with finer and finer steps; its friction, edges and divergence."""

import math

import numpy as np
import pytest

from hardwall.model.stamped import Edges, room_for
from hardwall.sim.scene.build import world_of
from hardwall.sim.scene.errors import SceneError
from hardwall.sim.scene.load import load
from hardwall.sim.walls import hit
from hardwall.sim.world.advance import Interval, Moment, advance
from hardwall.sim.world.converter import Pulse
from hardwall.sim.world.device import Device, Hand, Transmission, train
from hardwall.sim.world.encoder import Encoder, level, locate, offsets
from hardwall.sim.world.euler import Stepped, longest_s, stepped
from hardwall.sim.world.linear import State
from oracles.device import between, ours, random_cable, random_motor
from stimuli.device_motion import COARSE, after, moved
from stimuli.scenes import PULSES

REST = State(0.0, 0.0, (0.0, 0.0, 0.0), 0)
SECONDS = 2e-2
SCALES = np.array([0.01, 0.1, 1e-3, 0.1, 1.0])
"""Scales of x, v, s, w, f in these tests; without a cable f is the third."""


def system(device, step_s, seconds=SECONDS):
    return stepped(train(device, seconds), device, step_s)


def moved_in_steps(device, state, command, step_s, seconds=SECONDS):
    """Return the state after an interval, by the code under test."""
    return after(system(device, step_s, seconds), state, command, seconds)


def random_case(rng, number, events):
    """Return a device, a state and a command; with `events` the device has dry friction and often a voltage limit."""
    parts = {"bandwidth_hz": between(rng, 20, 500)}
    if number % 2:
        parts["transmission"] = random_cable(rng, (1e2, 3e4), (0.02, 0.5), 20.0)
    if number % 3 == 0:
        parts["hand"] = Hand(0.1, between(rng, 0.1, 20), between(rng, 10, 1000), float(rng.normal(0, 0.01)))
    if events and number % 4 < 2:
        parts["motor"] = random_motor(rng)
    coulomb = between(rng, 0.01, 2) if events else None
    device = Device(between(rng, 0.05, 1), between(rng, 0.01, 5), coulomb, **parts)
    y = rng.normal(size=5) * [0.01, 0.1, 0.0, 0.1, 1.0]
    y[2] = y[0] + rng.normal() * 1e-3
    return device, ours(device, y), float(rng.normal(0, 4))


def errors(device, state, command, steps_s):
    """Return the distances of the steps' end states from the exact one, in the states' scales."""
    scales = SCALES if device.transmission else SCALES[[0, 1, 4, 4, 4]]
    exact, *found = (
        np.array([each.position_m, each.velocity_m_per_s, *each.others])
        for each in (
            moved(device, state, command, SECONDS),
            *(moved_in_steps(device, state, command, step_s) for step_s in steps_s),
        )
    )
    return [float(np.abs((each - exact) / scales).max()) for each in found]


def test_without_events_the_error_is_of_the_first_order_in_the_step():
    """At 1 us all higher orders are under a per cent, because the fastest rate here is some thousands a second."""
    rng = np.random.default_rng(1)
    for number in range(40):
        coarse, fine = errors(*random_case(rng, number, events=False), (2e-6, 1e-6))
        assert math.log2(coarse / fine) == pytest.approx(1.0, abs=0.02)


def test_with_friction_that_sticks_and_limits_it_falls_with_the_step():
    """An event is late by up to a step, and the delay varies with the step, so the order is one on average."""
    rng = np.random.default_rng(2)
    orders = []
    for number in range(60):
        coarse, fine = errors(*random_case(rng, number, events=True), (1e-4, 1e-6))
        orders.append(math.log10(coarse / fine) / 2)
    assert np.median(orders) == pytest.approx(1.0, abs=0.02)
    assert min(orders) > 0.5


def test_friction_holds_and_lets_go():
    device = Device(0.3, 1.0, 0.5, bandwidth_hz=200.0)
    held = moved_in_steps(device, State(0.1, 0.0, (0.2, 0.0, 0.0), 0), 0.49, 1e-5)
    assert held[:2] == (0.1, 0.0)
    # The force rises from 0 to 1 N as 1 - exp(-w t): it is beyond 0.5 N from w t = log 2 on.
    loose_s = math.log(2) / (2 * math.pi * 200)
    assert moved_in_steps(device, REST, 1.0, 1e-5, loose_s - 2e-5)[:2] == (0.0, 0.0)
    assert moved_in_steps(device, REST, 1.0, 1e-5, loose_s + 2e-5).velocity_m_per_s > 0.0


def test_a_handle_that_is_stopped_leaves_its_motor_moving():
    """In the step in which friction stops the handle, only the cable's force changes the motor's velocity."""
    device = Device(0.3, 0.0, 1.0, transmission=Transmission(1e3, 0.0, 0.05, 0.0))
    start, step_s = State(0.0, 1e-5, (2e-4, 0.03, 0.0), 0), 1e-4
    end = moved_in_steps(device, start, 0.0, step_s, step_s)
    assert end.velocity_m_per_s == 0.0
    before, after = (each.velocity_m_per_s + each.others[1] for each in (start, end))
    assert after - before == pytest.approx(-1e3 * 2e-4 / 0.05 * step_s, rel=1e-9)


@pytest.mark.parametrize("at_motor", [False, True])
def test_edges_are_where_the_line_from_step_to_step_passes_them(at_motor):
    """In one step of 1 ms through many edges, the pins at every clock follow a line between the step's ends."""
    rng = np.random.default_rng(3)
    encoder, clocks, edges = Encoder(1e-4, 1e5, offsets(0.2, 0.1)), 100, 0
    for _ in range(40):
        cable = random_cable(rng, (1e3, 1e4), (0.1, 0.3), 10.0)
        device = Device(0.2, 1.0, transmission=cable, encoder_at_motor=at_motor)
        start = State(0.0, float(rng.normal()), (float(rng.normal() * 1e-3), 0.0, 0.0), 0)
        found = room_for(5000)
        seconds = clocks / encoder.clock_hz
        plant, first_m = system(device, seconds, seconds), start.others[0] * at_motor
        cell = locate(encoder, first_m)
        interval = Interval(seconds, 0, clocks)
        end, last, n_edges = advance(plant, encoder, Moment(start, cell, 0), 1.0, interval, found)
        stamps, words = found
        last_m = end.position_m + end.others[0] * at_motor
        assert last.number == locate(encoder, last_m).number
        assert (np.diff(stamps[:n_edges]) >= 0).all()
        for clock in range(1, clocks + 1):
            here_m = first_m + (last_m - first_m) * clock / clocks
            true = locate(encoder, here_m)
            if min(abs(here_m - true.lower_m), abs(here_m - true.upper_m)) < 1e-12:
                continue
            passed = int((stamps[:n_edges] <= clock).sum())
            assert (words[passed - 1] if passed else level(cell.number)) == level(true.number)
        edges += n_edges
    assert edges > 200


def test_full_arrays_are_reported():
    encoder = Encoder(1e-6, 1e6)
    stamps, words = np.full(4, -1), np.full(4, -1)
    plant, start = system(Device(0.3, bandwidth_hz=200.0), 1e-5, 1e-3), State(0.0, 1.0, (0.0, 0.0, 0.0), 0)
    moment, interval = Moment(start, locate(encoder, 0.0), 0), Interval(1e-3, 0, 1000)
    assert advance(plant, encoder, moment, 0.0, interval, Edges(stamps[:3], words)).n_edges == -1
    assert stamps[3] == words[3] == -1


def test_a_step_never_spans_a_change_of_the_command():
    """A pulse lasts 0.3 of the period, and a step the whole period: without a part that resists, the mean is exact."""
    device = Device(0.5, pulse=Pulse(2.0, 1000, 100))
    encoder = COARSE._replace(clock_hz=1e6)
    end = after(system(device, 1e-3, 1e-3), REST, -0.8, 1e-3, 0, 1000, encoder)
    assert end.width == 300
    assert end.velocity_m_per_s == pytest.approx(-0.8 / 0.5 * 1e-3, rel=1e-12)


def test_the_longest_step_is_the_known_one():
    """Symplectic Euler diverges on a spring from h w = 2, explicit Euler on a lag from h w = 2."""
    cable = Device(0.3, transmission=Transmission(2e5, 0.0, 0.05, 0.0))
    assert longest_s(cable, 1.0) == pytest.approx(2 / math.sqrt(2e5 * (1 / 0.3 + 1 / 0.05)), rel=1e-4)
    lag = Device(0.3, bandwidth_hz=500.0)
    assert longest_s(lag, 1.0) == pytest.approx(2 / (2 * math.pi * 500), rel=1e-4)
    assert longest_s(lag, 1e-5) == 1e-5
    assert longest_s(Device(0.3), 1.0) == 1.0, "a handle alone drifts, which is not to diverge"


@pytest.mark.parametrize("spring", ["cable", "hand"])
def test_a_spring_keeps_its_energy_to_within_a_step(spring):
    """Symplectic Euler conserves the energy for ever, except for a term of h w / 2 of it."""
    mass, stiffness = 0.2, 1e3
    if spring == "cable":
        device, start = Device(mass, transmission=Transmission(stiffness, 0.0, mass, 0.0)), (0.0, (1e-3, 0.0, 0.0))
        omega = math.sqrt(2 * stiffness / mass)
    else:
        device, start = Device(mass, hand=Hand(0.0, 0.0, stiffness, 0.0)), (1e-3, (0.0, 0.0, 0.0))
        omega = math.sqrt(stiffness / mass)
    start, step_s = State(start[0], 0.0, start[1], 0), 0.4 / omega

    def energy(state):
        (x, v), (stretch, stretching, _) = state[:2], state.others
        if spring == "hand":
            return mass * v**2 / 2 + stiffness * x**2 / 2
        return mass * (v**2 + (v + stretching) ** 2) / 2 + stiffness * stretch**2 / 2

    for steps in (999, 1000, 1001, 100_000):
        end = moved_in_steps(device, start, 0.0, step_s, steps * step_s)
        assert (1 - 0.2) / (1 + 0.2) <= energy(end) / energy(start) <= (1 + 0.2) / (1 - 0.2)


def test_a_hit_rests_where_the_wall_carries_the_push():
    """The tolerance is the dry friction, a count, and half a step of the converter."""
    short = {"protocol.settle_s": 3.0, "protocol.measure_s": 0.2, "controller.estimator": "butterworth"}
    scene = load("drive-2011", short | {"solver.step_s": 1e-4})
    assert isinstance(world_of(scene).plant, Stepped)
    found = hit.run(scene, "fixed")
    assert found.stable
    held_n = 0.1 + 10e3 * 1e-6 + 40.0 / 4096
    assert found.mean_m == pytest.approx(0.3572 / 10e3, abs=held_n / 10e3)


REFUSED = {
    "solver.step_s must be a number of 1e-13 to 1, not 0.0": {"solver.step_s": 0.0},
    "solver.step_s must be 1e-08 to 0.0001, from 10000 steps a sample to one, not 0.001": {"solver.step_s": 1e-3},
    "solver.step_s must be 1e-08 to 0.0001, from 10000 steps a sample to one, not 1e-09": {"solver.step_s": 1e-9},
    "solver.step_s must be at most 6.3662e-05, in longer steps this device diverges of itself, not 0.0001":
        {"solver.step_s": 1e-4, "amplifier.bandwidth_hz": 5000.0},
    "solver.stepp_s is not a key of a scene; did you mean step_s?": {"solver.step_s": 1e-4, "solver.stepp_s": 1.0},
}  # fmt: skip


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_is_refused_in_a_line(message):
    with pytest.raises(SceneError) as refusal:
        load("seed-2011", REFUSED[message])
    assert str(refusal.value) == f"seed-2011: {message}"


def test_a_scene_of_a_handle_alone_has_steps_too():
    assert world_of(load("seed-2011", {"solver.step_s": 1e-5})).plant.step_s == 1e-5
    assert world_of(load("seed-2011", PULSES | {"solver.step_s": 1e-5})).plant.pulse == Pulse(50.0, 600, 2)
