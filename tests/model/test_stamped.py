"""An axis on a record of stamped edges: decoder and axis give the same clock by clock and all at once."""

import numpy as np
import pytest

from hardwall.model import stamped
from hardwall.model.axis import axis
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder import quadrature
from hardwall.testing import rng
from stimuli.specs import spec

SPEC = spec("mhz", "fdm")
UPWARDS = [0b00, 0b01, 0b11, 0b10]


def walk(samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return edges of a random walk, at most one a clock, and the count from every edge on."""
    random = rng()
    clocks = np.flatnonzero(random.random(samples * SPEC.clocks_per_sample) < 0.006)
    clocks = clocks[clocks > 10]
    counts = np.cumsum(random.choice([-1, 1], len(clocks), p=[0.3, 0.7]))
    return clocks, np.array(UPWARDS)[counts % 4], counts


@pytest.mark.parametrize("floating", [False, True])
def test_records_are_the_decoders_clocks_and_the_axis_samples(floating):
    samples, period = 400, SPEC.clocks_per_sample
    clocks, levels, _ = walk(samples)
    of = Axis(SPEC, floating, wall_stiffness=5e3, wall_damping=3.0, encoder_glitch_clocks=2, wall_position=10e-6)
    seen = stamped.run(of, clocks, levels, samples)
    # One clock at a time.
    pins = np.zeros(samples * period, np.int64)
    for clock, level in zip(clocks, levels, strict=True):
        pins[clock:] = level
    decoded = quadrature.run(of.design.decoder, quadrature.Inputs(pins & 1, pins >> 1, 0, 2))
    state = of.design.start(floating)
    for k in range(samples):
        before = quadrature.State(*(int(column[(k + 1) * period - 2]) for column in decoded))
        fault = quadrature.fault(before)
        state, velocity, force = axis.step(of.params, state, quadrature.seen(before), 0, fault, 1)
        assert (velocity, force, state.output.drive, state.flags) == (
            seen.velocity[k], seen.force[k], seen.drive[k], seen.flags[k]
        ), k  # fmt: skip
    assert np.abs(seen.force).max() > 0


def test_counts_come_after_the_decoders_latency():
    clocks, levels, counts = walk(400)
    seen = stamped.run(Axis(SPEC, encoder_glitch_clocks=0), clocks, levels, 400)
    strobes = np.arange(1, 401) * SPEC.clocks_per_sample - 1
    latency = quadrature.latency(0)
    passed = np.searchsorted(clocks, strobes - latency, side="right")
    assert np.cumsum(seen.velocity).tolist() == np.concatenate([[0], counts])[passed].tolist()


def test_no_edges_are_standstill():
    seen = stamped.run(Axis(SPEC), np.array([], np.int64), [], 5, level=3)
    assert not any((seen.velocity.any(), seen.drive.any(), seen.flags.any()))
