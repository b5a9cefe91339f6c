"""The handle: against the matrix exponential, 60-digit arithmetic, an integrator with events, and known cases."""

import math
import struct
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hardwall.model.runtime.compiled import compiled
from hardwall.sim.world.advance import Interval, Moment, advance_quietly
from hardwall.sim.world.rigid import Coulomb, Handle, Motion, Rigid, glide, reach, span, turn, turned
from stimuli.device_motion import ANYWHERE, after

U = 2.0**-53  # half a unit in the last place of 1
UNIT = Handle(mass_kg=1.0, viscous_n_s_per_m=0.0)


def bits(motion: Motion) -> bytes:
    return struct.pack("<2d", *motion)


def random_handle(rng) -> Handle:
    viscous = rng.choice([0.0, 10 ** rng.uniform(-3, 1.5)])
    return Handle(float(10 ** rng.uniform(-1, 0.5)), float(viscous))


def random_motion(rng) -> Motion:
    return Motion(*rng.normal(0, 1, 2).tolist())


def exact_span(handle: Handle, seconds: float) -> list[Decimal]:
    """Return decay, coast_s, velocity_per_newton and position_per_newton to far more digits than a float has."""
    mass, viscous, time = Decimal(handle.mass_kg), Decimal(handle.viscous_n_s_per_m), Decimal(seconds)
    with localcontext() as context:
        context.prec = 60
        z = -viscous * time / mass
        if z == 0:
            decay, phi1, phi2 = Decimal(0), Decimal(1), Decimal("0.5")
        else:
            context.prec += 2 * max(0, -z.adjusted())  # the digits that phi2 cancels
            decay = z.exp() - 1
            phi1 = decay / z
            phi2 = (phi1 - 1) / z
        return [decay, time * phi1, time * phi1 / mass, time * time * phi2 / mass]


def test_span_is_accurate_for_every_friction():
    # Errors in units of U: z has 2, and no coefficient amplifies it; its series adds 2, and the later products at most
    # 6. Without the series (from z = -1/4 on) phi2 has the error of phi1, 4, times |phi1 / (z phi2)| <= 7.7.
    rng = np.random.default_rng(1)
    arguments = [0.0, 1e-300, 1e-17, 9.99e-4, 1.001e-3, 0.2499, 0.25, 0.2501, 1.0, 36.0, 40.0, 700.0, 1e4]
    arguments += (10.0 ** rng.uniform(-9, 3, 300)).tolist() + rng.uniform(0.1, 0.4, 200).tolist()
    for argument in arguments:
        mass, seconds = (10.0 ** rng.uniform(-3, 1, 2)).tolist()
        handle = Handle(mass, argument * mass / seconds)
        bound = Decimal((10 if argument < 0.2499999 else 40) * U)
        for ours, exact in zip(span(handle, seconds)[1:], exact_span(handle, seconds), strict=True):
            assert abs(Decimal(ours) - exact) <= bound * abs(exact)


def test_motion_without_dry_friction_is_the_matrix_exponential():
    rng = np.random.default_rng(2)
    for _ in range(500):
        handle, motion = random_handle(rng), random_motion(rng)
        force, seconds = float(rng.normal(0, 3)), float(10 ** rng.uniform(-6, 0.5))
        m, b = handle
        system = np.array([[0, 1, 0], [0, -b / m, 1 / m], [0, 0, 0]])
        expected = expm(system * seconds) @ [*motion, force]
        # The error of expm itself is about the norm of its argument, below 1000, in units of U.
        scale = abs(motion.position_m) + (abs(motion.velocity_m_per_s) + abs(force) * seconds / m) * (1 + seconds)
        assert after(Rigid(handle, None), motion, force, span(handle, seconds)) == pytest.approx(
            expected[:2], rel=0, abs=2000 * U * scale
        )


def integrated(handle: Handle, level: float, motion: Motion, force: float, seconds: float) -> tuple[np.ndarray, str]:
    """Return the state after one interval by numerical integration with events, and the events in it."""

    def slip(state, direction, time):
        if time == 0:
            return state, 0.0

        def rest(_, y):
            return y[1]

        rest.terminal, rest.direction = True, -direction
        m, b = handle
        solution = solve_ivp(
            lambda _, y: [y[1], (force - b * y[1] - direction * level) / m],
            (0, time),
            state,
            "DOP853",
            events=rest,
            rtol=1e-12,
            atol=1e-14,
        )
        return solution.y[:, -1], time - solution.t[-1]

    state, left = np.array(motion), seconds
    fate = "slips on"
    if state[1] != 0:
        state, left = slip(state, np.sign(state[1]), seconds)
        if left > 0:
            state[1] = 0.0
            fate = "sticks" if abs(force) <= level else "turns"
    if left > 0 and abs(force) > level:
        state, left = slip(state, np.sign(force), left)
    return state, fate


def test_stick_and_slip_agree_with_numerical_integration():
    rng = np.random.default_rng(3)
    fates = {"slips on": 0, "sticks": 0, "turns": 0}
    for case in range(2000):
        handle, motion, level = random_handle(rng), random_motion(rng), float(rng.uniform(0, 2))
        if case % 10 == 0:
            motion = motion._replace(velocity_m_per_s=0.0)
        force, seconds = float(rng.normal(0, 3)), float(rng.uniform(0.01, 2))
        expected, fate = integrated(handle, level, motion, force, seconds)
        fates[fate] += 1
        ours = after(Rigid(handle, Coulomb(level)), motion, force, span(handle, seconds))
        assert ours == pytest.approx(expected, rel=1e-9, abs=1e-9), (handle, motion, level, force, seconds, fate)
        if fate == "sticks":
            assert ours.velocity_m_per_s == 0
    assert min(fates.values()) > 200, fates


@pytest.mark.parametrize("level", [None, 0.0, 0.4])
def test_a_split_interval_gives_the_same_motion(level):
    # Every coefficient is off by at most 40 U of itself, and so are the time of a turn and the terms after it. The
    # velocity then differs by its error at the turn, because friction makes the force before the turn the larger one.
    rng = np.random.default_rng(4)
    coulomb = None if level is None else Coulomb(level)
    for _ in range(3000):
        handle, motion, force = random_handle(rng), random_motion(rng), float(rng.normal(0, 1))
        seconds = float(10 ** rng.uniform(-6, 0.5))
        first = seconds * float(rng.uniform(0, 1))
        whole = after(Rigid(handle, coulomb), motion, force, span(handle, seconds))
        part = after(Rigid(handle, coulomb), motion, force, span(handle, first))
        parts = after(Rigid(handle, coulomb), part, force, span(handle, seconds - first))
        speed = abs(motion.velocity_m_per_s) + (abs(force) + (level or 0.0)) * seconds / handle.mass_kg
        assert parts == pytest.approx(whole, rel=0, abs=200 * U * (speed + abs(motion.position_m) + speed * seconds))


def test_a_stuck_handle_keeps_its_motion_bit_for_bit():
    rng = np.random.default_rng(5)
    interval = span(Handle(0.35, 1.0), 1e-3)
    for position in [0.0, -0.0, 5e-324, *rng.normal(0, 0.1, 20).tolist()]:
        start = motion = Motion(position, 0.0)
        for force in [0.1, -0.1, 0.0, -0.0, *rng.uniform(-0.1, 0.1, 50).tolist()]:  # reversals while stuck among them
            motion = after(Rigid(Handle(0.35, 1.0), Coulomb(0.1)), motion, force, interval)
            assert bits(motion) == bits(start)


def test_the_level_itself_holds_and_the_next_force_moves():
    interval = span(UNIT, 1.0)
    for sign in (1.0, -1.0):
        above = math.nextafter(0.5, 1.0)
        assert after(Rigid(UNIT, Coulomb(0.5)), Motion(2.0, 0.0), sign * 0.5, interval) == (2.0, 0.0)
        moved = after(Rigid(UNIT, Coulomb(0.5)), Motion(0.0, 0.0), sign * above, interval)
        assert moved == (sign * (above - 0.5) / 2, sign * (above - 0.5))


# m = 1, b = 0, dyadic numbers: each result is exact by hand.
@pytest.mark.parametrize(
    ("level", "velocity", "force", "seconds", "expected"),
    [
        (1.0, 1.0, 0.0, 1.0, (0.5, 0.0)),  # stops exactly at the end
        (1.0, -1.0, 0.0, 1.0, (-0.5, 0.0)),
        (1.0, 1.0, 0.0, 8.0, (0.5, 0.0)),  # stops within the interval
        (1.0, 1.0, 0.0, 0.5, (0.375, 0.5)),  # does not stop yet
        (0.5, 1.0, -0.5, 4.0, (0.5, 0.0)),  # pushed back by exactly the level of friction: stays
        (0.5, 1.0, 0.5, 4.0, (4.0, 1.0)),  # pushed on by exactly the level of friction: goes on for ever
        (0.5, 1.0, -1.5, 1.5, (-0.25, -1.0)),  # stops after 0.5 s at 0.25 m, then slips back with -1 N for 1 s
        (0.5, -1.0, 1.5, 1.5, (0.25, 1.0)),
        (0.0, 1.0, -1.0, 2.0, (0.0, -1.0)),  # no friction: up and back
        (0.0, 0.0, 0.0, 2.0, (0.0, 0.0)),
    ],
)
def test_known_stops(level, velocity, force, seconds, expected):
    assert after(Rigid(UNIT, Coulomb(level)), Motion(0.0, velocity), force, span(UNIT, seconds)) == expected


def test_the_time_of_a_turn():
    # m / b and w are off by U each, log1p by 2 U, and nothing amplifies them.
    rng = np.random.default_rng(8)
    growths = [0.0, 1e-300, 1e-18, 1e-16, 1e-8, *(10.0 ** rng.uniform(-12, 6, 300)).tolist()]
    for growth in growths:
        mass, speed, against = (10.0 ** rng.uniform(-1, 1, 3)).tolist()
        handle = Handle(mass, growth * against / speed)
        with localcontext() as context:
            context.prec = 60
            slowness, viscous = Decimal(speed) / Decimal(against), Decimal(handle.viscous_n_s_per_m)
            short = viscous * slowness < Decimal("1e-25")
            exact = Decimal(mass) * (slowness if short else (1 + viscous * slowness).ln() / viscous)
        at, rest = turn(handle, Motion(0.0, -speed), against, math.inf)
        assert abs(Decimal(at) - exact) <= Decimal(10 * U) * exact
        assert rest.velocity_m_per_s == 0
        assert rest.position_m < 0


def test_a_turn_lies_in_its_interval():
    rng = np.random.default_rng(9)
    close = 0
    for _ in range(2000):
        handle, start, against = random_handle(rng), Motion(0.0, float(rng.uniform(0.1, 1))), -float(rng.uniform(1, 2))
        last, _ = turn(handle, start, against, math.inf)
        for seconds in (math.nextafter(last, 0), last, math.nextafter(last, 9)):
            if turned(start, glide(start, against, span(handle, seconds))):
                assert turn(handle, start, against, seconds)[0] <= seconds
                close += seconds < last
    assert close > 100


def test_friction_takes_the_kinetic_energy():
    # With b = 0, m v^2 / 2 = Fc times the way to the stop; with b > 0, m v = Fc t + b x for the momentum.
    rng = np.random.default_rng(6)
    for _ in range(200):
        handle, velocity, level = random_handle(rng), float(rng.normal()), float(rng.uniform(0.1, 2))
        frictionless = handle._replace(viscous_n_s_per_m=0.0)
        end = after(Rigid(frictionless, Coulomb(level)), Motion(0.0, velocity), 0.0, span(frictionless, 1e3))
        assert end.velocity_m_per_s == 0
        assert abs(end.position_m) * level == pytest.approx(handle.mass_kg * velocity**2 / 2, rel=20 * U)
        against = -math.copysign(level, velocity)
        at, rest = turn(handle, Motion(0.0, velocity), against, 1e3)
        impulse = level * at + handle.viscous_n_s_per_m * abs(rest.position_m)
        assert impulse == pytest.approx(handle.mass_kg * abs(velocity), rel=100 * U)


def test_heavy_friction_reaches_the_terminal_velocity():
    handle = Handle(1e-6, 10.0)  # z = -1e7 in one second
    assert after(Rigid(handle, None), Motion(0.0, 3.0), 5.0, span(handle, 1.0)) == pytest.approx(
        (0.5 + 2.5e-7, 0.5), rel=1e-15
    )
    # Friction without a force fades the motion but never turns it.
    end = after(Rigid(handle, Coulomb(0.0)), Motion(0.0, 3.0), 0.0, span(handle, 1.0))
    assert end == (pytest.approx(3e-7, rel=1e-15), 0.0)


def test_many_equal_intervals_do_not_drift():
    # The rounded factor of one interval would be off by up to U in the same direction a million times.
    # Rounding the sums instead gives a random walk of steps up to U.
    @compiled
    def run(plant, moment, interval, steps):
        for _ in range(steps):
            moment, _ = advance_quietly(plant, moment, 0.0, interval)
        return moment.motion

    for microseconds in (1.0, 1.7, 2.3):
        handle, steps = Handle(0.35, 1.0), 1_000_000
        start, interval = Moment(Motion(0.0, 1.0), ANYWHERE, 0), Interval(span(handle, microseconds * 1e-6), 0, 1)
        end = run(Rigid(handle, None), start, interval, steps)
        exact = math.exp(-steps * microseconds * 1e-6 / 0.35)
        assert end.velocity_m_per_s == pytest.approx(exact, rel=0, abs=5 * math.sqrt(steps) * U)


def test_reach_inverts_the_travel_of_one_direction():
    rng = np.random.default_rng(7)
    turns = 0
    for _ in range(5000):
        handle, force = random_handle(rng), float(rng.normal(0, 20))
        velocity, seconds = float(rng.normal() * rng.integers(0, 2)), float(10 ** rng.uniform(-6, 0.5))
        start = Motion(0.0, velocity)
        end = after(Rigid(handle, None), start, force, span(handle, seconds))
        if turned(start, end):
            seconds, end = turn(handle, start, force, seconds)
            turns += 1
        travel = float(end.position_m * rng.choice([0.0, 1e-6, rng.uniform(0, 1), 1 - 1e-9, 1.0]))
        at = reach(handle, start, force, seconds, travel)
        assert 0 <= at <= seconds
        assert glide(start, force, span(handle, at)).position_m == pytest.approx(travel, rel=2e-14, abs=0)
    assert turns > 300
    # The square of this travel underflows.
    assert reach(UNIT, Motion(0.0, 0.0), 1e-200, 1.0, 5e-201) == 1.0
