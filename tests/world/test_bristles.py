"""Bristles: against SciPy's Radau with a derived bound, and against what the two models have in closed form."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hardwall.sim.world.bristles import BEND, MOST, UNIT, VELOCITY, Bent, expand, rest_of, size
from hardwall.sim.world.presliding import bristled
from hardwall.sim.world.rigid import Coulomb, Handle, Motion, Rigid, span
from stimuli.bristles import COULOMB_N, DAHL, HANDLE, LUGRE, STATIC_N, STRIBECK
from stimuli.device_motion import after
from stimuli.lengths import some_of

PLANTS = {"dahl": DAHL, "lugre": LUGRE}
FREE = Handle(0.35, 0.0)


def level(plant, velocity):
    if plant.stribeck is None:
        return plant.coulomb_n
    static_n, vs, _ = plant.stribeck
    return plant.coulomb_n + (static_n - plant.coulomb_n) * math.exp(-((velocity / vs) ** 2))


def rates(plant, state, force):
    """Return the rates of change of x, v and z, as the two papers have them."""
    (m, b), (_, v, z) = plant.handle, state
    bending = v - plant.stiffness_n_per_m * abs(v) * z / level(plant, v)
    friction = plant.stiffness_n_per_m * z + plant.damping_n_s_per_m * bending + b * v
    return [v, (force - friction) / m, bending]


def jacobian(plant, state, force):
    """Return how the rates depend on x, v and z, by differences, on the state's side of v = 0."""
    matrix = np.zeros((3, 3))
    for column, step in ((1, 1e-5 * max(abs(state[1]), 1e-9)), (2, 1e-6 * plant.full_m)):
        more, less = np.array(state), np.array(state)
        more[column] += step
        less[column] -= step
        matrix[:, column] = np.subtract(rates(plant, more, force), rates(plant, less, force)) / (2 * step)
    return matrix


def integrated(plant, start, force, seconds):
    """Return the state by Radau's method, without events, and how far off x, v and z may be.

    A step's own error is at most what the method was asked for, and the linearised motion, step by step the exponential
    of its Jacobian, carries it to the end. As much again is for what is of second order in these errors, and for the
    Jacobian's change within a step.
    """
    relative, absolute = 1e-11, np.array([1e-17, 1e-14, 1e-17])
    found = solve_ivp(lambda _, y: rates(plant, y, force), (0, seconds), start, "Radau", rtol=relative, atol=absolute)
    assert found.success
    asked = absolute + relative * np.abs(found.y).max(axis=1)
    carried, off = np.eye(3), np.zeros(3)
    for step in reversed(range(len(found.t) - 1)):
        off += np.abs(carried) @ asked
        middle = (found.y[:, step] + found.y[:, step + 1]) / 2
        carried = carried @ expm(jacobian(plant, middle, force) * (found.t[step + 1] - found.t[step]))
    return found.y[:, -1], 2 * off


def cases(plant, number):
    """Return starts, forces and times: at rest, slow and slipping; pushed on and back."""
    rng = np.random.default_rng(number)
    speeds = [0.0, 1e-5, 1e-4, STRIBECK, 5e-3, 8e-3, 0.05]
    for speed in some_of(speeds, 0, 2, 3, 6):
        sign = float(rng.choice([-1, 1]))
        start = Bent(float(rng.normal()) * 1e-6, sign * speed, float(rng.uniform(-1, 1)) * plant.full_m)
        yield start, float(rng.normal(0, 0.15)), float(10 ** rng.uniform(-3.5, -2))


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("number", some_of(range(2), 1))
def test_motion_agrees_with_radau_within_what_radau_may_be_off(name, number):
    plant = PLANTS[name]
    for start, force, seconds in cases(plant, number):
        expected, off = integrated(plant, start, force, seconds)
        ours = after(plant, start, force, span(plant.handle, seconds))
        # The bound says something: it is far less than the way of the bristles, and than the speed that they give.
        assert off[2] < 1e-4 * plant.full_m, (start, force, seconds, off)
        assert (np.abs(np.subtract(ours, expected)) <= off).all(), (start, force, seconds, ours, expected, off)


def test_dahls_friction_fills_exponentially_with_the_way():
    """z = s full + (z0 - s full) exp(-|x - x0| / full), whatever forces move the handle, while it does not turn.

    Each of N legs rounds x and z, and leaves out of them, less than 4 units of the largest x and z in it; an error of
    x is one of as much of z, for |dz/dx| is 2 at most.
    """
    rng = np.random.default_rng(3)
    intervals = 60
    for _ in range(20):
        sign = float(rng.choice([-1, 1]))
        start = state = Bent(0.0, sign * 1e-3, float(rng.uniform(-1, 1)) * DAHL.full_m)
        seen = 0
        for _ in range(intervals):
            state = after(DAHL, state, sign * float(rng.uniform(0.1, 0.15)), span(HANDLE, 5e-5))
            assert state.velocity_m_per_s * sign > 0
            way = abs(state.position_m - start.position_m)
            expected = sign * DAHL.full_m + (start.bend_m - sign * DAHL.full_m) * math.exp(-way / DAHL.full_m)
            seen += 0.1 < way / DAHL.full_m < 3
            # An interval is one leg or two here.
            most = 2 * intervals * 4 * UNIT * (2 * way + DAHL.full_m)
            assert abs(state.bend_m - expected) <= most
        assert seen > 5


def test_presliding_takes_the_area_of_dahls_loops():
    """m v^2 / 2 at each turn is 0: what the force gives on a stretch from turn to turn, the bristles take.

    On a stretch of length w they take Fc (w + (s z0 - full) (1 - exp(-w / full))).
    """
    plant = bristled(FREE, COULOMB_N, 1e5, 0.0, COULOMB_N, 1.0)
    full, force, step = plant.full_m, 0.06, span(FREE, 1e-5)
    state, before, turns, ways = Bent(0.0, 0.0, 0.0), Bent(0.0, 0.0, 0.0), 0, []
    while turns < 12:
        moved = after(plant, state, force, step)
        if moved.velocity_m_per_s * state.velocity_m_per_s < 0:
            # The turn is within this step; bisect for it with the code itself.
            low, high = 0.0, 1e-5
            for _ in range(60):
                middle = 0.5 * (low + high)
                there = after(plant, state, force, span(FREE, middle))
                low, high = (middle, high) if there.velocity_m_per_s * state.velocity_m_per_s > 0 else (low, middle)
            there = after(plant, state, force, span(FREE, low))
            way = there.position_m - before.position_m
            sign = math.copysign(1.0, way)
            rest = (before.bend_m - sign * full) * -math.expm1(-abs(way) / full)
            taken = COULOMB_N * (abs(way) + sign * rest)
            # The time of the turn is known to a unit, in which the kinetic energy is the square of what rounds.
            assert taken == pytest.approx(force * way, rel=0, abs=1e-9 * COULOMB_N * full)
            ways.append(abs(way))
            before, turns = there, turns + 1
        state = moved
    assert all(later < earlier for earlier, later in zip(ways, ways[2:], strict=False)), ways


@pytest.mark.parametrize("speed", [2e-4, 1e-3, 3e-3, 0.02])
def test_lugres_friction_at_a_steady_speed_is_its_curve(speed):
    """A force of g(v) + b v holds the speed v for ever, with bristles bent by g(v) / S, where b is large enough.

    What is left after the start from another speed fades; only rounding of the forces remains.
    """
    b = 400.0
    plant = bristled(Handle(0.35, b), COULOMB_N, 1e5, 300.0, STATIC_N, STRIBECK)
    force = level(plant, speed) + b * speed
    state = Bent(0.0, 0.7 * speed, 0.5 * plant.full_m)
    for _ in range(40):
        state = after(plant, state, force, span(plant.handle, 5e-3))
    assert state.velocity_m_per_s == pytest.approx(speed, rel=1e-12)
    assert state.bend_m == pytest.approx(level(plant, speed) / 1e5, rel=1e-12)


def test_lugre_breaks_loose_at_its_static_level():
    for force, slips in ((0.99 * STATIC_N, False), (1.01 * STATIC_N, True)):
        state = Bent(0.0, 0.0, 0.0)
        for step in range(4000):  # the force grows slowly
            state = after(LUGRE, state, force * min(step / 3000, 1.0), span(HANDLE, 1e-3))
        assert (abs(state.velocity_m_per_s) > 1e-2) == slips


@pytest.mark.parametrize("seconds", [1e-3, 0.1])
def test_stiffer_bristles_come_to_ideal_friction(seconds):
    """Bristles hold, or have yet to take, the energy of full ones twice at most: no more speed than that gives it."""
    ideal = Rigid(HANDLE, Coulomb(COULOMB_N))
    for velocity, force in ((0.02, 0.05), (-0.02, 0.05), (0.02, -0.3), (0.0, 0.25), (0.0, 0.05)):
        expected = after(ideal, Motion(0.0, velocity), force, span(HANDLE, seconds))
        for stiffness in (1e5, 1e7, 1e9, 1e10):
            plant = bristled(HANDLE, COULOMB_N, stiffness, 0.0, COULOMB_N, 1.0)
            ours = after(plant, Bent(0.0, velocity, 0.0), force, span(HANDLE, seconds))
            speed = math.sqrt(2 * 2 * COULOMB_N * plant.full_m / HANDLE.mass_kg)
            assert abs(ours.position_m - expected.position_m) <= 4 * plant.full_m + speed * seconds


def test_the_bound_of_the_rest_holds():
    """Against the terms of order 17 to 33 of the same series, in exact products of Python's floats."""
    rng = np.random.default_rng(4)
    for _ in range(200):
        order = int(rng.integers(2, 9))
        first, second = rng.normal(size=(2, 20))
        first[order + 3 :], second[order + 3 :] = 0.0, 0.0
        rests = [float(np.abs(series[order + 1 :]).sum()) for series in (first, second)]
        beyond = np.abs(np.convolve(first, second)[order + 1 :]).sum()
        assert beyond <= rest_of(first, rests[0], second, rests[1], order) * (1 + 1e-12)
        assert size(first, order) == pytest.approx(np.abs(first[: order + 1]).sum(), rel=1e-14)


@pytest.mark.parametrize("name", PLANTS)
def test_a_leg_that_fits_leaves_out_less_than_it_says(name):
    """A series of the largest order has terms that one of a lower order lacks: they are within the bound."""
    plant, rng = PLANTS[name], np.random.default_rng(5)
    said = {True: 0, False: 0}
    for _ in range(400):
        speed = float(10 ** rng.uniform(-6, -2.2))
        state = Bent(0.0, speed, float(rng.uniform(-1, 1)) * plant.full_m)
        force, seconds, order = float(rng.normal(0, 0.2)), float(10 ** rng.uniform(-7, -3)), int(rng.integers(3, 10))
        slow = plant.stribeck is not None
        fits = expand(plant, plant.stribeck, state, 1, slow, force, seconds, order)
        said[bool(fits)] += 1
        if not fits:
            continue
        v, z = (size(plant.terms[row], order) for row in (VELOCITY, BEND))
        expand(plant, plant.stribeck, state, 1, slow, force, seconds, MOST)
        lacking = np.abs(plant.terms[:, order + 1 :]).sum(axis=1)
        given = seconds * (abs(force) + plant.stiffness_n_per_m * z) / plant.handle.mass_kg
        assert lacking[BEND] <= UNIT * z
        assert lacking[VELOCITY] <= UNIT * (v + given)
    assert min(said.values()) > 60, said
