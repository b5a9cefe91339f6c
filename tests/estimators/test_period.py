"""Period timing: RTL against model, model against exact rationals, fixed point against the real algorithm, promises."""

import math
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from random import Random

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.period import Estimator
from hardwall.model import stamped
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators import period
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.period import FLOAT_START, START
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from hardwall.testing.estimators import follow, model
from stimuli.edges import (
    Edge,
    Strobe,
    anything,
    rows,
    sights,
    turn,
)
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import spec

NAME = "period"


def design(name: str) -> period.Design:
    return spec(name, "period").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def at_the_bound(d: period.Design, random: Random, cases: int) -> tuple[list[Strobe], list[Edge]]:
    """Return motions that pause until the time since their last edge bounds the speed to about what it is.

    Two edges tell a speed. The sample after these comes when the bound's quotient is that of the speed, or the next
    one on either side of it.
    """
    strobes, edges, now = [], [], 0
    speed, bound = (part * d.clocks << d.velocity.f for part in (2, 3))
    longest = 1 << (d.stamp_width - 2)
    while len(strobes) < 3 * cases:
        gap = round(2.0 ** random.uniform(1, d.stamp_width - 3))
        age = int(bound / (speed // gap + random.choice((-1, 0, 1)) + 0.5))
        if not gap < age < longest:
            continue
        edges += [Edge(now + 1, 0, 0), Edge(now + 1 + gap, 1, 0)]
        strobes += [Strobe(now, 1, len(edges) - 2), Strobe(now + gap + 2, 0, len(edges))]
        now += gap + 1 + age
        strobes.append(Strobe(now, 0, len(edges)))
        now += 1
    return strobes, edges


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    d, random = design(name), seeded()
    samples = SAMPLES // (10 if name == "narrow" else 1)
    turns = [rows(d, *turn(d, random, samples // 3), invert) for invert in (False, True)]
    bounds = rows(d, *at_the_bound(d, random, samples // 30))
    stimulus = [row for part in (*turns, bounds, anything(d, random, samples // 3)) for row in part]
    expected = await follow(dut, make(name), stimulus, START)
    assert {0, 1} <= set(expected["saturated"]) <= {0, 1, 2, 3}
    for end in (-d.velocity.max, 0, d.velocity.max):
        assert end in expected["velocity"]


def on_pins(seen: dict[str, int]) -> dict[str, int]:
    """Return the decoder's outputs by the names of the ports."""
    return {f"seen__{name}": value for name, value in seen.items()}


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    name = parameters()["name"]
    bench = Bench(dut, make(name))
    await bench.reset()
    edges = {"run": 4, "edge": 0, "down": 0}
    moving = [
        {"count": 0, "stamp": 40, "stamp_a_rise": 10, "stamp_b_rise": 15, "stamp_a_fall": 20, "stamp_b_fall": 25},
        {"count": 1, "stamp": 70, "stamp_a_rise": 50, "stamp_b_rise": 15, "stamp_a_fall": 20, "stamp_b_fall": 25},
        {"count": 5, "stamp": 90, "stamp_a_rise": 85, "stamp_b_rise": 70, "stamp_a_fall": 75, "stamp_b_fall": 80},
    ]
    for expected_moving, row in zip((False, False, True), moving, strict=True):
        await bench.transact("strobe", "valid", **on_pins(row | edges))
        assert (bench.reader("velocity")() > 0) == expected_moving
    await bench.reset()
    await bench.transact("strobe", "valid", **on_pins(moving[-1] | edges))
    assert bench.reader("velocity")() == 0


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def speeds(d: period.Design, strobes, edges):
    """Yield (speed, direction) in counts a clock, as the module's equations give them, unrounded."""
    speed = Fraction(0)
    for sight in sights(d, strobes, edges):
        ages = sight.ages
        if not ages:
            speed = Fraction(0)
        elif sight.news:
            speed = Fraction(1, ages[1] - ages[0]) if len(ages) > 1 else Fraction(0)
            speed = Fraction(*sight.cycle) if sight.cycle else speed
        bounds = [Fraction(3, 2 * ages[0])] if ages else []
        bounds += [Fraction(4, ages[3])] if len(ages) == 4 else []
        yield min([speed, *bounds]), sight.down


@lru_cache(maxsize=1)
def turning(name: str):
    """Return strobes and edges, and their exact speeds, which are those of the inverted scale too."""
    d = design(name)
    strobes, edges = turn(d, seeded(), 10_000)
    return strobes, edges, list(speeds(d, strobes, edges))


@pytest.mark.parametrize("invert", [False, True])
@pytest.mark.parametrize("name", ["mhz", "paper", "narrow", "wide"])
def test_model_is_the_exact_speed_rounded(name, invert):
    d, (strobes, edges, exact_speeds) = design(name), turning(name)
    seen = model(d, rows(d, strobes, edges, invert), START)
    moving = 0
    for k, (speed, down) in enumerate(exact_speeds):
        word = math.floor(speed * d.clocks * 2**d.velocity.f + Fraction(1, 2))
        expected = min(word, d.velocity.max) * (-1 if down else 1), int(word > d.velocity.max)
        assert (seen["velocity"][k], seen["saturated"][k] & 1) == expected, f"sample {k}: {strobes[k]}"
        moving += word > 0
    assert moving > 2_000


def still(d: period.Design, at: int, run: int = 4) -> Seen:
    """Return an axis whose last edges came at the clocks 0, 10, 20, 30."""
    return Seen(7, at & ((1 << d.stamp_width) - 1), 0, 10, 20, 30, 3, 0, run)


@pytest.mark.parametrize("start", [START, FLOAT_START])
def test_first_sample_and_restart_read_zero(start):
    d = design("mhz")
    params = d.params({}) if start is START else d.float_params(spec("mhz", "period").design.gains, "u", {})
    state, velocity, flags = estimate(params, start, still(d, 40), 0)
    assert (velocity, flags) == (0, 0)
    for count, stamp in enumerate((50, 60), 1):
        kinds = {"stamp_a_rise": 48} if count == 1 else {"stamp_a_rise": 48, "stamp_b_rise": 58}
        seen = still(d, stamp)._replace(count=7 + count, edge=count - 1, **kinds)
        state, velocity, flags = estimate(params, state, seen, 0)
        assert (velocity != 0) == (count == 2)
    state, velocity, flags = estimate(params, state, seen, 1)
    assert (velocity, flags) == (0, 0)


def test_an_old_edge_never_comes_back_as_a_new_one():
    """Through many wraps of the stamp, an axis at rest reads 0, and one edge after that gives no velocity yet."""
    d = design("mhz")
    params, state = d.params({}), START
    earlier = {"stamp_a_rise": 1, "stamp_b_rise": 1, "stamp_a_fall": 1, "stamp_b_fall": 1}
    state, *_ = estimate(params, state, still(d, 5)._replace(count=3, **earlier), 0)
    state, velocity, _ = estimate(params, state, still(d, 40), 0)
    assert velocity > 0
    quarter = 1 << (d.stamp_width - 2)
    for k in range(1, 4000):
        state, velocity, flags = estimate(params, state, still(d, 40 + k * (quarter // 3)), 0)
        assert flags == 0
        assert velocity == 0 or 40 + k * (quarter // 3) - 30 < 3 * quarter
    now = 40 + 4000 * (quarter // 3)
    stamps = 1 << d.stamp_width
    seen = still(d, now)._replace(count=8, edge=0, stamp_a_rise=(now - 5) % stamps)
    state, velocity, _ = estimate(params, state, seen, 0)
    assert velocity == 0


def test_rate_too_slow_for_the_stamps_is_refused():
    axis = replace(spec("paper", "period"), actuation_hz=2)
    with pytest.raises(ValueError, match=r"^sample_hz must be at least 2.8\d* at clock_hz 12000000, not 2$"):
        replace(axis, sample_hz=2)


def test_speed_too_large_for_a_word_is_refused():
    with pytest.raises(ValueError, match=r"^speed_max_m_per_s must be at most .*, not 1e\+30$"):
        replace(spec("mhz", "period"), speed_max_m_per_s=1e30)


@pytest.mark.parametrize("bound", [0.01, 1.6785, 12.0, 1000.0])
def test_latency_leaves_the_force_path_its_clocks(bound):
    assert replace(spec("mhz", "period"), acceleration_max_m_per_s2=bound).design.estimator.latency <= 38


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)


@pytest.mark.parametrize("name", ["mhz", "paper", "narrow", "wide"])
def test_rounding_is_at_most_a_hundredth_of_every_speed_that_can_be_read(name):
    d = design(name)
    slowest = 4 * d.clocks / (period.AGE_LIMIT * 2.0**d.stamp_width)  # counts a sample: a cycle in the age limit
    assert d.velocity.lsb / 2 <= period.ERROR_SHARE * slowest


def test_a_filter_by_default_keeps_short_pulses_from_the_estimate():
    """Ten pulses a second of two clocks, at 10 mm/s; without a filter they are edges of a fast motion, unflagged."""
    axis = spec("mhz", NAME)
    apart = round(1e-6 / 10e-3 * axis.clock_hz)  # clocks from one edge to the next
    number = np.arange(1, 3_001)
    pulses = apart * (number[100::1000] + 1) - 50  # on B, a little before the next edge
    level = ((number + 1) & 3) ^ (((number + 1) & 3) >> 1)
    within = level[pulses // apart - 1]
    clocks = np.concatenate([apart * number, pulses, pulses + 2])
    levels = np.concatenate([level, within ^ 2, within])
    order = np.argsort(clocks, kind="stable")
    worst = {}
    for glitch in ({}, {"encoder_glitch_clocks": 0}):
        of = Axis(axis, **glitch)
        seen = stamped.run(of, clocks[order], levels[order], 3_000 * apart // axis.clocks_per_sample, int(level[-1]))
        assert of.design.flag_names(int(seen.flags[-1])) == []
        worst[of.words["encoder_glitch_clocks"]] = np.abs(seen.velocity_m_per_s[1_000:] - 10e-3).max()
    assert worst[15] < 10e-6
    assert worst[0] > 1.0
