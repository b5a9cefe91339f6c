"""The contract of an estimator with an acceleration: its format, its kernels, its port, and motions that are known."""

from fractions import Fraction
from itertools import product
from math import floor

import numpy as np
import pytest
from amaranth.hdl import Shape
from amaranth.lib.wiring import Out

from hardwall.hdl.estimators import registry as hardware
from hardwall.hdl.estimators.acceleration import AcceleratedBlock
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.edge_velocity_estimator import EdgeVelocityEstimator
from hardwall.model.encoder.quadrature import Seen, seen_count
from hardwall.model.estimators import registry
from hardwall.model.estimators.acceleration import WIDTH, Accelerated, Velocities, acceleration_of, keep, room_of
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.levant_higher_design import NOISE
from hardwall.model.motion import Motion
from hardwall.model.velocity_estimator import VelocityEstimator
from hardwall.testing.estimators import outputs, run
from stimuli.lengths import LONG
from stimuli.specs import spec

ACCELERATED = [
    "kalman",
    "levant-edge",
    "edge-kalman",
    "count-kalman",
    "levant-2",
    "levant-3",
    "levant-2-filtering",
    "levant-3-filtering",
    "levant-2-implicit",
    "levant-3-implicit",
    "levant-adaptive",
]
ALONE = "kalman"
"""The estimator whose velocities are kept alone, too: that body has nothing of an estimator."""
each = pytest.mark.parametrize("name", ACCELERATED)
AXES = ("paper", "mhz", "narrow", "wide")
RATE_HZ = 1e6
ACCELERATION = 2e6
MOTION = Motion(acceleration_max=2 * ACCELERATION, speed_max=1e6, travel=1e6, jerk_max=1e9)
"""All in counts and seconds."""
SHARES = {"kalman": 0.2, "levant-edge": 1.0, "edge-kalman": 0.03, "count-kalman": 0.5}
"""How far an acceleration may be off, of the true one."""
REST_S = 0.5
"""The standstill after the motion: longer than the slowest estimator takes to read it."""


def design(name: str, axis: str = "mhz") -> Accelerated:
    return spec(axis, name).design.estimator


def test_it_is_known_which_estimators_have_one():
    of_model = {name for name, kind in registry.ESTIMATORS.items() if issubclass(kind, Accelerated)}
    of_hardware = {name for name, kind in hardware.ESTIMATORS.items() if issubclass(kind, AcceleratedBlock)}
    assert of_model == of_hardware == {*ACCELERATED}


@each
def test_campaigns_compare_it_too(name):
    assert outputs(design(name)) == ("velocity", "acceleration", "saturated")


@pytest.mark.parametrize("axis", AXES)
@each
def test_the_port_has_the_format_of_the_design(name, axis):
    d = design(name, axis)
    assert isinstance(d.acceleration, SQ)
    assert d.acceleration.width <= WIDTH
    assert hardware.block_of(d).signature.members["acceleration"] == Out(Shape(d.acceleration.width, signed=True))


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", ["levant-edge", "edge-kalman", "count-kalman"])
def test_the_steepest_line_has_a_word(name, axis):
    """The slope of the line is held; over a sample it is exact, rounded down, and within its format at both ends."""
    d = design(name, axis)
    line = d.filter if name == "count-kalman" else d
    params = line.params({word.name: word.reset for word in line.words})
    steepest, units = params.acceleration_max, Fraction(line.clocks, 1 if name == "levant-edge" else 2**line.unit)
    for slope in (-steepest, -1, 0, 1, steepest):
        word = acceleration_of(params, line.start()._replace(acceleration=slope))
        assert word == floor(Fraction(slope, 2**line.a.f) * units * 2**line.acceleration.f)
        assert -line.acceleration.max - 1 <= word <= line.acceleration.max
    assert line.acceleration == d.acceleration


@each
def test_both_kernels_begin_with_zero(name):
    d = design(name)
    gains = spec("mhz", name).design.gains
    integer = d.params({word.name: word.reset for word in d.words})
    real = d.float_params(gains, d.outputs[0], {})
    for params, floating in ((integer, False), (real, True)):
        state, rows = d.start(floating), ((5, 0), (5, 0), (6, 0), (-1000, 1))
        assert acceleration_of(params, state) == 0
        (counts, restarts), rest = np.array(rows).T.copy(), np.zeros(4, np.int64)
        both, flags = room_of(d, (4,), float if floating else np.int64), np.zeros(4, np.int64)
        run(params, state, Seen(counts, *[rest] * (len(Seen._fields) - 1)), restarts, both, flags)
        for k, (count, restart) in enumerate(rows):
            state, velocity, _ = estimate(params, state, seen_count(count), restart)
            assert (both.velocity[k], both.acceleration[k]) == (velocity, acceleration_of(params, state))
            assert isinstance(acceleration_of(params, state), float | np.floating) == floating
            if name == ALONE:
                alone = Velocities(np.zeros(1))
                keep(alone, 0, velocity, params, state)
                assert alone.velocity[0] == velocity
        # A restart forgets the past: its sample is the first again.
        assert acceleration_of(params, state) == 0


def moved(name: str, acceleration: float, seconds: float, backend: str) -> tuple[np.ndarray, np.ndarray]:
    """Return velocity and acceleration, in counts and seconds, of a motion from rest, which ends at a standstill."""
    rate = RATE_HZ
    if registry.design_of(name).uses_stamps():
        edges = np.arange(1, int(abs(acceleration) * seconds**2 / 2))
        # Each edge is a count from the last one, and the motion starts in the middle of a cell.
        times = np.append(0.0, np.sqrt(2 * (edges - 0.5) / abs(acceleration)))
        counts = np.sign(acceleration).astype(int) * np.arange(len(times)) - int(acceleration < 0)
        counts = counts - counts[0]
        taken = EdgeVelocityEstimator(rate, name, MOTION, backend=backend)
        return taken.with_acceleration(times, counts, until_s=times[-1] + REST_S)
    t = np.arange(round(seconds * rate)) / rate
    counts = np.floor(acceleration * t**2 / 2 + 0.5).astype(np.int64)
    taken = VelocityEstimator(rate, name, MOTION, backend=backend)
    return taken.with_acceleration(np.append(counts, np.full(round(REST_S * rate), counts[-1])))


def bound(name: str) -> float:
    """Return how far an acceleration may be off, in counts/s^2.

    Of the Levants it is the module's figure for what an error of a count makes. The others have none: it is a share.
    """
    if name in SHARES:
        return SHARES[name] * ACCELERATION
    d = VelocityEstimator(RATE_HZ, name, MOTION).spec.design.estimator
    return NOISE * d.lipschitz ** (2 / (d.order + 1)) * RATE_HZ**2


@pytest.mark.parametrize(
    ("sign", "backend"), product([1, -1], ["fixed", "float"]) if LONG else [(1, "float"), (-1, "fixed")]
)
@each
def test_a_constant_acceleration_is_read(name, sign, backend):
    """After the start the mean is the true one to a hundredth, and every sample to `bound`; at rest it is 0."""
    velocity, acceleration = moved(name, sign * ACCELERATION, 0.15, backend)
    steady, change = acceleration[75_000:149_000], velocity[149_000] - velocity[75_000]
    assert np.mean(steady) == pytest.approx(sign * ACCELERATION, rel=0.01)
    assert np.abs(steady - sign * ACCELERATION).max() <= bound(name)
    # Both outputs are of the same moments.
    assert np.sum(steady) / RATE_HZ == pytest.approx(change, rel=0.01)
    at_rest = np.abs(acceleration[-1000:]).max()
    assert at_rest <= (0 if name in SHARES and backend == "fixed" else bound(name))
