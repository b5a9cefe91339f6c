"""The Kalman filter of count changes: RTL against model, model against exact rationals, promises on known motions."""

import math
from dataclasses import replace

import cocotb
import numpy as np
import pytest
from edge_oracle import Oracle
from filters import equals, rms, run, starts_afresh

from hardwall.hdl.estimators.count_kalman import Estimator
from hardwall.model.estimators import kalman
from hardwall.model.estimators.count_kalman import START, STEPS, Design
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, simulate
from hardwall.testing.estimators import follow, model
from stimuli.lengths import LONG, some_of
from stimuli.papers_signal import axis_at, swing
from stimuli.seeded import seeded
from stimuli.specs import spec

JERK = 50e-3 * (2 * math.pi) ** 3
"""About the largest jerk of the paper's signal, m/s^3."""


def axis(name: str) -> AxisSpec:
    """Return the axis of that name; at the rate of `slow` the times wrap every 128 samples."""
    if name == "slow":
        return replace(spec("paper", "count-kalman"), sample_hz=100, actuation_hz=100)
    return spec(name, "count-kalman")


def design(name: str) -> Design:
    return axis(name).design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def stimulus(d: Design, samples: int):
    """Yield rows of (count, restart): every speed, through every wrap; rests, jumps, turns, noise, restarts."""
    random = seeded()
    half, wrap = 1 << (d.count_width - 1), 1 << (d.filter.time_bits - 1)
    fast = (d.velocity.max >> d.velocity.f) + 2
    count = half - 5
    for _ in range(20):
        yield count, 1
    # Motion faster than the velocity format, and than the distance's, in both directions.
    for k in range(120):
        count += (fast, 2 * d.filter.distance.max)[k // 20 % 2] * (1 if k // 40 % 2 else -1)
        yield count, 0
    for _ in range(300):
        count += fast
        yield count, 0
    while samples > 0:
        style, pace, up = random.randrange(7), random.randrange(10), random.choice((-1, 1))
        every, where = random.randrange(1, 40), random.random()
        speed = min(2.0 ** random.uniform(-8, 2), d.filter.distance.max)
        # A rest, beyond the wrap of the times where that is near.
        rest = random.choice((0, 0, 1, 7, 60, random.randrange(wrap), 2 * wrap, 5 * wrap))
        for _ in range(rest if rest < 2000 else 0):
            yield count, 0
            samples -= 1
        for k in range(random.randrange(5, 150)):
            if style == 0:  # any speed at every sample
                count += random.randrange(-fast, fast + 1) >> random.randrange(pace + 1)
            elif style == 1:  # single edges, with turns
                up = -up if random.random() < 0.1 else up
                count += up * int(random.random() < 2.0**-pace)
            elif style == 2:  # jumps
                count = random.randrange(-half, half)
            elif style == 3:  # two edges at once, and none
                count += up * 2 * int(k % every == 0)
            elif style < 6:  # a constant speed, to which the gains become quiet
                count += up * (math.floor(where + speed) - math.floor(where))
                where = math.fmod(where + speed, 1.0)
            else:
                count += up * int(k % every == 0)
            yield count, int(random.random() < 0.002)
            samples -= 1


def rows_of(d: Design, samples: int):
    """Yield the rows with counts as the decoder wraps them."""
    half = 1 << (d.count_width - 1)
    for count, restart in stimulus(d, samples):
        yield (count + half) % (2 * half) - half, restart


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    samples = SAMPLES if name == "mhz" else SAMPLES // 4
    expected = await follow(dut, make(name), rows_of(design(name), samples), START)
    # The campaign must reach the limits, and the quiet track too.
    assert set(expected["saturated"]) == {0, 1}


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    await starts_afresh(dut, make(**parameters()), {})


@pytest.mark.parametrize("name", some_of(["mhz", "narrow", "slow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def oracle(d: Design, rows):
    """Yield the outputs of the module's rule, with times that never wrap, and of the filter in exact rationals."""
    filter_of, half = Oracle(d.filter), 1 << (d.count_width - 1)
    mask, before, cell, at, down = (1 << d.filter.stamp_width) - 1, None, 0, 0, 0
    for k, (count, restart) in enumerate(rows, 1):
        now, limited = 2 * k, False
        if before is None or restart:
            cell, at, down = count, now, 0
        elif count != before:
            passed = (count - before + half) % (2 * half) - half
            held = max(-d.step_max, min(passed, d.step_max))
            limited, cell = held != passed, (cell + held + half) % (2 * half) - half
            at, down = now - (held in (1, -1)), int(held < 0)
        before = count
        *given, flags = filter_of.step((cell, now & mask, *[at & mask] * 4, 0, down, 1, restart))
        yield *given, int(limited or flags != 0)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow", "wide", "slow"])
def test_model_is_the_exact_equation_rounded_as_documented(name):
    d = design(name)
    equals(oracle, d, list(rows_of(d, 12_000 if LONG else 4_000)), START)


# ---- promises -------------------------------------------------------------------------------------------------------


def velocities(d: Design, counts) -> np.ndarray:
    """Return the velocities of a record, counts a sample."""
    _, velocity, flags = run(d.params({}), START, np.asarray(counts))
    assert not flags.any()
    return velocity * d.velocity.lsb


@pytest.mark.parametrize("every", [3, 20, 1000])
def test_a_speed_of_an_edge_every_so_many_samples_is_exact(every):
    """The time between edges is then exact; the place is rounded by half an LSB at an edge."""
    d = design("mhz")
    samples = max(3_000 * every, 200_000)
    seen = velocities(d, np.arange(samples) // every)[samples * 9 // 10 :]
    rounding = (2.0 ** -(d.filter.error.f + 1) / (2 * every)) + d.velocity.lsb
    assert np.abs(seen - 1 / every).max() <= rounding


@pytest.mark.parametrize("speed", [0.013, 0.1618, 0.731, 1.618, 2.0])
def test_any_speed_is_read_to_a_part_of_what_a_count_says(speed):
    """The mean is off by less than a ten-thousandth, and an estimate by half a count in an agile memory."""
    d = design("mhz")
    seen = velocities(d, np.floor(np.arange(200_000) * speed + 0.3))[100_000:]
    rate = axis("mhz").sample_hz
    memory = d.filter.agile_s[0, 2 * max(math.ceil(2 / speed).bit_length(), 2)] * rate
    assert abs(seen.mean() - speed) < 1e-4 * speed
    assert np.abs(seen - speed).max() < 0.5 / memory


@pytest.mark.parametrize("speed", [0.03, 0.2, 0.6, 1.0, 1.3, 1.7, 2.5, 5.3])
def test_an_edge_errs_as_the_gains_have_it(speed):
    """The axis's distance from the edge at the edge's time, over all places in a cell: the formula's RMS error."""
    speed += 1e-3 * math.sqrt(2)
    places = np.arange(400_001) * speed
    moved = np.diff(np.floor(places))
    before = np.where(moved == 1, 0.5, 0.0)[moved > 0]
    # Its mean is a constant displacement of the scale.
    error = (places[1:] - np.floor(places[1:]))[moved > 0] - before * speed
    ours = axis("mhz")
    time_s = max(1.0, 1 / speed) / ours.sample_hz
    expected = ours.design.estimator.filter._passed_counts(ours, np.array([time_s]))[0] / math.sqrt(12)
    if not 1 < speed < 2:
        assert error.std() == pytest.approx(expected, rel=1e-3)
    else:  # some edges come alone, and are known better than to a cell
        assert 0.6 * expected < error.std() < expected


@pytest.mark.parametrize("every", [20, 300])
def test_an_axis_that_stops_reads_exactly_zero(every):
    """After a stop from constant speed the velocity is 0 within 16 times the last interval, and stays 0."""
    d = design("mhz")
    moving = np.arange(4_000 * every) // every
    seen = velocities(d, np.append(moving, np.full(20 * every, moving[-1])))
    at_rest, before = seen[4_000 * every :], seen[4_000 * every - 1]
    assert at_rest[0] > 0
    assert np.all(np.abs(at_rest) <= before)
    assert not at_rest[17 * every :].any()


def test_a_jump_of_the_count_is_flagged_and_limited():
    """What is beyond the largest difference has no later effect: the velocities are those of that difference."""
    d = design("mhz")
    moving = np.arange(20_000) // 50

    def after(jump: int) -> tuple[np.ndarray, np.ndarray]:
        counts = moving + np.where(np.arange(20_000) >= 10_025, jump, 0)
        _, velocity, flags = run(d.params({}), START, counts)
        return velocity, flags

    (least, unflagged), (seen, flags), (down, _) = (after(jump) for jump in (d.step_max, 1000, -1000))
    assert np.array_equal(seen, least)
    assert not unflagged.any()
    assert np.flatnonzero(flags).tolist() == [10_025]
    assert np.array_equal(down, after(-d.step_max)[0])


@pytest.mark.parametrize("restarts", [(500,), (500, 501), (511, 512, 640)])
def test_a_restart_forgets_everything(restarts):
    """From the last restart on, the velocities are those of a fresh start; at `slow`, times wrap every 128 samples."""
    d = design("slow")
    counts = np.arange(1500) // 3
    rows = [(int(count), int(k in restarts)) for k, count in enumerate(counts)]
    seen = model(d, rows, START)["velocity"][restarts[-1] :]
    fresh = model(d, [(count, 0) for count, _ in rows[restarts[-1] :]], START)["velocity"]
    assert seen.any()
    assert np.array_equal(seen, fresh)


def test_a_vibration_across_one_edge_reads_no_drift():
    assert not velocities(design("mhz"), np.arange(4000) // 100 % 2).any()


def test_wraps_of_count_and_time_change_nothing():
    d = design("slow")
    counts = np.arange(4 << d.filter.time_bits) // 3
    near = (1 << (d.count_width - 1)) - 50
    assert np.array_equal(velocities(d, counts), velocities(d, counts + near))
    # The time has wrapped eight times: an edge every third sample is as it was before.
    assert np.abs(velocities(d, counts)[200:] - 1 / 3).max() < d.velocity.lsb


def test_on_the_papers_signal_its_error_falls_with_the_rate():
    """From 10 kHz to 1 MHz to less than a tenth; that of the filter of counts at samples falls to two thirds.

    That filter is better at 10 kHz if it is told the jerk too, and hardly better at 1 MHz than at 10 kHz.
    """

    def error(name: str, rate: int, start: tuple, jerk: float | None = JERK) -> float:
        counts, exact = swing(rate, 5.0)
        d = replace(axis_at(name, rate), jerk_max_m_per_s3=jerk).design.estimator
        _, velocity, _ = run(d.params({word.name: word.reset for word in d.words}), start, counts)
        from_here = len(counts) // 5
        return rms(velocity[from_here:] * d.velocity.lsb * 1e-6 * rate - exact[from_here:])

    rates = 10_000, 1_000_000
    slow, fast = (error("count-kalman", rate, START) for rate in rates)
    slowly, fastest = (error("kalman", rate, kalman.START, None) for rate in rates)
    told_slowly, told_fastest = (error("kalman", rate, kalman.START) for rate in rates)
    assert fast < slow / 10
    assert fastest > slowly / 2
    assert told_slowly < slow < slowly
    assert told_fastest > told_slowly / 2
    assert fast < min(told_fastest / 5, fastest / 10)


def test_the_sequence_is_a_clock_longer_than_the_filters():
    d = design("mhz")
    assert d.latency == STEPS == d.filter.latency + 1
    assert len(d.filter.agile_s) == 1


def test_a_rate_whose_times_last_less_than_a_second_is_refused():
    with pytest.raises(ValueError, match=r"^sample_hz must be 4 or more"):
        _ = replace(spec("paper", "count-kalman"), sample_hz=2, actuation_hz=2).design


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
