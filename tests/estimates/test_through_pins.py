"""Counts through pins: every strobe sees the recorded count, and the RTL gives the words of the model."""

import hashlib
from functools import cache

import numpy as np
import pytest

from hardwall.model import stamped
from hardwall.model.axis.design import Timing
from hardwall.model.encoder import quadrature
from hardwall.model.estimators.acceleration import Velocities
from hardwall.sim.estimates.replay import replay
from hardwall.sim.estimates.replay_axis import run
from hardwall.sim.estimates.through_pins import through_pins
from hardwall.sim.world.encoder import level
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.outputs import EVERY_OUTPUT
from stimuli.replays import BOUND, COARSEN, recording, swing

# One estimator on the count, with a memory, and one on the stamps; by `make soak` all.
KINDS = [("levant", "u"), ("levant-edge", "u")]
SOME = pytest.mark.parametrize(("estimator", "output"), EVERY_OUTPUT if LONG else KINDS)


@cache
def axis_of(estimator: str):
    """Return the axis that `swing` and the recordings get."""
    return replay(swing(), estimator, coarsen=COARSEN, acceleration_max_counts_per_s2=BOUND).spec


def extremes(spec, samples=20_000) -> np.ndarray:
    """Return counts that move as fast as the pins allow, turn at every sample, rest, wrap the axis's count, wander."""
    random, most = rng(), spec.clocks_per_sample
    parts = [
        np.full(200, most),
        np.tile([most, -most], 20),
        np.tile([most, -1, 1 - most, 0], 20),
        np.zeros(50, np.int64),
        np.tile([1, -1], 50),
        np.full(3 * 2**spec.count_width // 3, 3),
        random.integers(-most, most + 1, 1000),
        random.integers(-1, 2, 1000),
        random.integers(-3, 4, samples),
    ]
    counts = 777 + np.cumsum(np.concatenate(parts))
    assert np.ptp(counts) > 2 * 2**spec.count_width
    return counts


@SOME
def test_rtl_gives_the_words_of_fixed_at_the_extremes(estimator, output):
    spec = axis_of(estimator)
    counts = extremes(spec)
    fixed, fixed_flags, _ = run(spec, counts, "fixed", output)
    rtl, rtl_flags, _ = run(spec, counts, "rtl", output)
    # Velocities, and accelerations where the estimator has them.
    for words, of_hardware in zip(fixed, rtl, strict=True):
        assert words.any()
        assert np.flatnonzero(words != of_hardware).tolist() == []
    assert spec.design.flag_names(rtl_flags) == spec.design.flag_names(fixed_flags)
    assert "velocity_saturated" in spec.design.flag_names(rtl_flags)


@SOME
def test_a_replay_is_the_same_on_rtl_and_fixed(estimator, output):
    """The recording has another rate and is not coarsened; per count and sample, the axis is the same."""
    made = recording(swing().counts // COARSEN, rate_hz=500)
    given = {"acceleration_max_counts_per_s2": BOUND / COARSEN / 4}
    fixed, rtl = (replay(made, estimator, output, backend, **given) for backend in ("fixed", "rtl"))
    assert np.flatnonzero(fixed.velocity_counts_per_s != rtl.velocity_counts_per_s).tolist() == []
    assert fixed.velocity_sha256 == rtl.velocity_sha256
    words = np.round(rtl.velocity_counts_per_s / 500 / rtl.spec.design.estimator.velocity.lsb).astype("<i8")
    assert rtl.velocity_sha256 == hashlib.sha256(words.tobytes()).hexdigest()
    assert fixed.flags == rtl.flags == []


@pytest.mark.parametrize("clocks", [41, 64])
def test_every_strobe_sees_the_recorded_count(clocks):
    """The decoder's model behind the pins, up to one edge a clock, counts exactly and raises no flag."""
    random, spec = rng(), axis_of("fdm")
    counts = np.concatenate(
        [
            [0],
            np.cumsum(
                np.concatenate([[clocks] * 9, [-clocks, clocks] * 9, random.integers(-clocks, clocks + 1, 3000)])
            ),
        ]
    )
    width = 40
    decoder = spec.design.decoder._replace(count_width=width)
    axis = spec.design.params(spec.design.encode())
    # A finite difference as wide as the count.
    axis = axis._replace(estimator=axis.estimator._replace(count_width=width, velocity_max=2**width))
    state = stamped.State(0, 0, 0, 0, quadrature.START, spec.design.start(), 0, int(level(0)))
    controller, made = stamped.Controller(decoder, 0, 0, axis), Velocities(np.zeros(len(counts), np.int64))
    edges = stamped.room_for(2 * clocks)
    state, left = through_pins(
        controller, state, Timing(clocks, clocks - 1, 30), counts, made, edges, 0, 0, len(counts)
    )
    assert made.velocity.tolist() == np.diff(counts, prepend=0).tolist()
    assert (left, state.flags) == (0, 0)
