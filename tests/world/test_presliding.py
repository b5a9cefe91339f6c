"""The handle on bristles from leg to leg: its edges, rest, full bristles, and what the ends of the ranges do to it."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hardwall.model.stamped import room_for
from hardwall.sim.scene.quantities import Damping, Force, Mass, Speed, Stiffness
from hardwall.sim.world.advance import Interval, Moment, advance, advance_quietly
from hardwall.sim.world.bristles import UNIT, Bent
from hardwall.sim.world.encoder import Encoder, locate
from hardwall.sim.world.presliding import FULL, bristled, fastest_per_s
from hardwall.sim.world.rigid import Coulomb, Handle, Motion, Rigid, span
from stimuli.bristles import COULOMB_N, DAHL, HANDLE, LUGRE, STATIC_N
from stimuli.device_motion import ANYWHERE, after

PLANTS = {"dahl": DAHL, "lugre": LUGRE}
FINE, COARSE = Encoder(1e-8, 1e8), Encoder(2e-5, 1e8)


def ends(quantity):
    """Return the least and the largest number of a quantity of scenes."""
    marks = quantity.__metadata__[0].metadata
    return [next(getattr(mark, end) for mark in marks if hasattr(mark, end)) for end in ("ge", "le")]


def moved(plant, encoder, state, force, seconds, clocks):
    """Return the state after an interval, and the clocks and cells of its edges."""
    edges, cell = room_for(4096), locate(encoder, state.position_m)
    interval = Interval(span(plant.handle, seconds), 0, clocks)
    moment = advance(plant, encoder, Moment(state, cell, 0), force, interval, edges)
    assert moment.n_edges >= 0
    return moment, edges.clocks[: moment.n_edges].copy()


@pytest.mark.parametrize("name", PLANTS)
def test_edges_are_stamped_where_the_motion_passes_them(name):
    """Clock by clock the position, by shorter and shorter intervals of the same code, is in the cell of the stamps.

    A stamp may be off by rounding where an edge is passed at the very clock: no such case is in these.
    """
    plant, rng = PLANTS[name], np.random.default_rng(1)
    passed, full = 0, 0
    for case in range(16):
        velocity = [0.0, 2e-3, -1e-2, 2.0][case % 4]
        encoder = FINE if abs(velocity) < 1 else FINE._replace(count_m=2e-7)
        start = Bent(float(rng.normal()) * 1e-7, velocity, float(rng.uniform(-1, 1)) * 1e-6)
        force, clocks = float(rng.normal(0, 0.15)), 4000
        end, stamps = moved(plant, encoder, start, force, clocks / 1e8, clocks)
        assert (np.diff(stamps) >= 0).all()
        assert ((stamps > 0) & (stamps <= clocks)).all()
        some = rng.permutation(stamps)[:60]
        for clock in np.unique(np.concatenate([some, some - 1, rng.integers(1, clocks, 5)])):
            if not 0 < clock <= clocks:
                continue
            there = after(plant, start, force, span(plant.handle, clock / 1e8))
            until, before = moved(plant, encoder, start, force, clock / 1e8, clock)
            assert until.cell.number == locate(encoder, there.position_m).number
            assert len(before) == np.searchsorted(stamps, clock, "right")
        passed += len(stamps)
        full += abs(end.motion.bend_m) == plant.full_m != abs(start.bend_m)
    assert passed > 100
    assert full > 2, "bristles fill, and edges are passed after that"


@pytest.mark.parametrize("name", PLANTS)
def test_full_bristles_are_rigid_coulomb_friction(name):
    """Bit for bit, on the quiet path and on the other."""
    plant, rng = PLANTS[name], np.random.default_rng(2)
    for _ in range(200):
        sign = float(rng.choice([-1, 1]))
        velocity, force = sign * float(rng.uniform(0.02, 1)), float(rng.normal(0, 0.3))
        length = span(plant.handle, 1e-4)
        start, motion = Bent(0.5, velocity, sign * plant.full_m), Motion(0.5, velocity)
        expected = after(Rigid(plant.handle, Coulomb(COULOMB_N)), motion, force, length)
        quiet, surely = advance_quietly(plant, Moment(start, ANYWHERE, 0), force, Interval(length, 0, 1))
        assert surely
        assert quiet.motion == (*expected, start.bend_m)
        assert after(plant, start, force, length) == (*expected, start.bend_m)


@pytest.mark.parametrize("name", PLANTS)
def test_an_interval_is_quiet_only_without_an_event(name):
    """An edge, a turn, and by LuGre's model a level that begins to rise; and then the other path has its result."""
    plant, rng = PLANTS[name], np.random.default_rng(6)
    free = plant.stribeck.free_m_per_s if plant.stribeck else 0.0
    said = {"edge": 0, "slow": 0, "bent": 0, "quiet": 0}
    for _ in range(600):
        sign, bent = float(rng.choice([-1, 1])), bool(rng.random() < 0.1)
        start = Bent(0.0, sign * float(10 ** rng.uniform(-3, -1)), sign * plant.full_m * (0.5 if bent else 1.0))
        force, interval = float(rng.normal(0, 5)), Interval(span(plant.handle, 1e-3), 0, 100_000)
        moment = Moment(start, locate(COARSE, 0.0), 0)
        quiet, surely = advance_quietly(plant, moment, force, interval)
        end, stamps = moved(plant, COARSE, start, force, 1e-3, 100_000)
        ideal = Rigid(plant.handle, Coulomb(COULOMB_N))
        slowest = sign * after(ideal, Motion(0.0, start.velocity_m_per_s), force, interval.length).velocity_m_per_s
        slow = min(slowest, abs(start.velocity_m_per_s)) <= free
        cause = "bent" if bent else "slow" if slow else "edge" if len(stamps) else "quiet"
        said[cause] += 1
        assert surely == (cause == "quiet"), cause
        if surely:
            assert quiet == end
    assert min(said.values()) > 20, said


def test_dahls_full_bristles_turn_where_coulomb_friction_turns():
    """Up to the turn the way is that of ideal friction, and from there on the bristles let go."""
    ideal = Rigid(HANDLE, Coulomb(COULOMB_N))
    start, force = Bent(0.0, 1e-3, DAHL.full_m), -0.25
    length = span(HANDLE, 2e-2)
    at = after(ideal, Motion(0.0, 1e-3), force, length), after(DAHL, start, force, length)
    assert at[0].velocity_m_per_s < 0
    assert at[1].velocity_m_per_s < at[0].velocity_m_per_s, "bristles push back until they are bent the other way"
    assert at[1].bend_m == -DAHL.full_m


def test_bristles_fill_and_stay_full():
    for plant in PLANTS.values():
        for sign in (-1.0, 1.0):
            state, gaps = Bent(0.0, sign * 0.05, 0.0), []
            for _ in range(200):
                state = after(plant, state, sign * 0.3, span(HANDLE, 1e-5))
                gaps.append(abs(sign * plant.full_m - state.bend_m) / plant.full_m)
            assert gaps[-1] == 0.0
            assert all(gap > FULL for gap in gaps if gap)
            assert 0 < sum(gap > 0 for gap in gaps) < 150


@pytest.mark.parametrize("name", PLANTS)
def test_a_handle_whose_bristles_bear_the_force_keeps_its_state(name):
    plant = PLANTS[name]
    for bend in (0.0, 3e-7, -plant.full_m):
        state, force = Bent(0.1, 0.0, bend), plant.stiffness_n_per_m * bend
        assert after(plant, state, force, span(HANDLE, 1.0)) == state
    assert after(plant, Bent(0.1, 0.0, 3e-7), 0.03 * (1 + 1e-12), span(HANDLE, 1e-3)).velocity_m_per_s > 0


@pytest.mark.parametrize("name", PLANTS)
def test_a_split_interval_gives_the_same_motion(name):
    """Each leg rounds by a few units of the sizes in it; bristles carry an error of v and z on without growth by Dahl's
    model, in the roots of energies, but for e^(w t / 2) with w = sqrt(S / m), and LuGre's level grows it by as much."""
    plant, rng = PLANTS[name], np.random.default_rng(3)
    m, stiffness = plant.handle.mass_kg, plant.stiffness_n_per_m
    for _ in range(300):
        start = Bent(0.0, float(rng.normal()) * 10 ** float(rng.uniform(-6, -1)), float(rng.uniform(-1, 1)) * 1e-6)
        force, seconds = float(rng.normal(0, 0.2)), float(10 ** rng.uniform(-6, -3))
        first = seconds * float(rng.uniform(0, 1))
        whole = after(plant, start, force, span(HANDLE, seconds))
        parts = after(plant, start, force, span(HANDLE, first))
        parts = after(plant, parts, force, span(HANDLE, seconds - first))
        speed = abs(start.velocity_m_per_s) + (abs(force) + STATIC_N) * seconds / m
        # Legs: the turns, and what full_m takes of the way; 200 is more than any of these has.
        off = 200 * 8 * UNIT * math.hypot(math.sqrt(m) * speed, STATIC_N / math.sqrt(stiffness))
        off += 2 * FULL * COULOMB_N * seconds / math.sqrt(m)  # the gap of full bristles that is closed
        off *= math.exp(2 * seconds * plant.calm_per_s)
        assert abs(whole.velocity_m_per_s - parts.velocity_m_per_s) <= off / math.sqrt(m)
        assert abs(whole.bend_m - parts.bend_m) <= off / math.sqrt(stiffness)


def stiff(model, **changes):
    """Return a plant with a value at an end of its range."""
    values = {"mass": 0.35, "coulomb": COULOMB_N, "stiffness": 1e5, "damping": 300.0, "static": STATIC_N, "vs": 1e-3}
    values |= changes
    if model == "dahl":
        values |= {"damping": 0.0, "static": values["coulomb"]}
    values["static"] = max(values["static"], values["coulomb"])
    handle = Handle(values["mass"], 0.3)
    return bristled(handle, values["coulomb"], *(values[key] for key in ("stiffness", "damping", "static", "vs")))


ENDS = [
    (key, end)
    for key, quantity in {
        "mass": Mass, "coulomb": Force, "stiffness": Stiffness, "damping": Damping, "static": Force, "vs": Speed,
    }.items()
    for end in ends(quantity)
]  # fmt: skip


@pytest.mark.parametrize("model", ["dahl", "lugre"])
@pytest.mark.parametrize(("key", "end"), ENDS)
def test_at_the_ends_of_the_ranges_friction_takes_energy_and_stays_within_its_level(model, key, end):
    """Thrown to and fro, at rest, and left alone: the bristles bear no more than the static level, and without a force
    the energy of handle and bristles never grows. Where D is large the model itself may give energy, so that only
    numbers are asked of it then."""
    plant = stiff(model, **{key: end})
    static_n = plant.stribeck.static_n if plant.stribeck else plant.coulomb_n
    m, stiffness = plant.handle.mass_kg, plant.stiffness_n_per_m
    seconds = min(1e-3, 100 / fastest_per_s(plant))
    length, state = span(plant.handle, seconds), Bent(0.0, 0.0, 0.0)
    for force in (2 * static_n, -3 * static_n, 0.5 * static_n, 1e6, -1e6, 0.0):
        for _ in range(4):
            state = after(plant, state, force, length)
            assert all(map(math.isfinite, state))
            assert abs(state.bend_m) * stiffness <= static_n * (1 + 1e-9)
    energies = []
    for _ in range(20):
        state = after(plant, state, 0.0, length)
        energies.append(m * state.velocity_m_per_s**2 / 2 + stiffness * state.bend_m**2 / 2)
    if plant.damping_n_s_per_m == 0.0:
        assert all(later <= earlier * (1 + 1e-9) for earlier, later in pairwise(energies))


@pytest.mark.parametrize("coulomb", [1e-6, 10.0])
@pytest.mark.parametrize("stiffness", [1e3, 1e8])
def test_soft_and_stiff_bristles_agree_with_an_integrator_of_stiff_equations(stiffness, coulomb):
    """LSODA is asked for 1e-11 of each, a step: its steps' errors together, carried without growth but e^(w t / 2)."""
    plant = stiff("dahl", stiffness=stiffness, coulomb=coulomb)
    (m, b), rate = plant.handle, math.sqrt(stiffness / 0.35)

    def rates(_, y):
        return [y[1], (1.3 * coulomb - b * y[1] - stiffness * y[2]) / m, y[1] - abs(y[1]) * y[2] / plant.full_m]

    seconds, start = 3 / rate, [0.0, 0.0, -0.5 * plant.full_m]
    scale = [plant.full_m, coulomb / math.sqrt(m * stiffness), plant.full_m]
    found = solve_ivp(rates, (0, seconds), start, "LSODA", rtol=1e-11, atol=1e-11 * np.array(scale))
    ours = after(plant, Bent(*start), 1.3 * coulomb, span(plant.handle, seconds))
    off = len(found.t) * 1e-11 * math.exp(rate * seconds / 2) * np.maximum(np.abs(found.y).max(axis=1), scale)
    assert (np.abs(np.subtract(ours, found.y[:, -1])) <= [off[0] + seconds * off[1], off[1], off[2]]).all()
