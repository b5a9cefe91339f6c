"""The M/T method: RTL against model, model against exact rationals, fixed point against float64, and its bound."""

import math
from dataclasses import replace
from fractions import Fraction

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.mt import Estimator
from hardwall.model.checks import FieldError
from hardwall.model.estimators import kept_edges, mt
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.kept_edges import NOTHING, Gains
from hardwall.model.quadrature import Seen
from hardwall.model.spec import AxisSpec
from hardwall.sim.estimates import accuracy, signals
from hardwall.sim.world.encoder import offsets
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from hardwall.testing.estimators import follow, model
from stimuli.edges import (
    Edge,
    anything,
    check_a_standing_axis_reads_zero_and_a_slowing_one_falls,
    check_rounding_is_the_only_difference,
    exact,
    rows,
    turn,
    velocities,
)
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import PAPER, spec

NAME = "mt"
RUN = Seen._fields.index("run")


def design(name: str, half: int | None = None) -> mt.Design:
    """Return the design for an axis, with a window of `half` samples twice or the default one."""
    axis = spec(name, NAME)
    return mt.Design(axis, Gains(2 * half / axis.sample_hz) if half else Gains.default(axis))


def make(name: str, half: int | None = None) -> Estimator:
    return Estimator(design(name, half))


def without_run(stimulus):
    """Yield rows of all the decoder's outputs without the run, which is not used."""
    return ((*row[:RUN], *row[RUN + 1 :]) for row in stimulus)


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    d, random = design(**parameters()), seeded()
    samples = SAMPLES // (4 if parameters()["name"] == "mhz" else 10)
    turns = [rows(d, *turn(d, random, samples // 3), invert) for invert in (False, True)]
    stimulus = without_run(row for part in (*turns, anything(d, random, samples // 3)) for row in part)
    expected = await follow(dut, make(**parameters()), stimulus, NOTHING)
    assert set(expected["saturated"]) == {0, 1}
    for end in (-d.velocity.max, 0, d.velocity.max):
        assert end in expected["velocity"]


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    bench = Bench(dut, make(**parameters()))
    await bench.reset()
    moving = [
        {"count": 0, "stamp": 40, "stamp_a_rise": 10},
        {"count": 1, "stamp": 70, "stamp_a_rise": 50},
        {"count": 5, "stamp": 90, "stamp_a_rise": 85},
    ]
    for expected_moving, row in zip((False, False, True), moving, strict=True):
        await bench.transact("strobe", "valid", **{f"seen__{name}": value for name, value in row.items()})
        assert (bench.reader("velocity")() > 0) == expected_moving
    await bench.reset()
    await bench.transact("strobe", "valid", seen__count=5, seen__stamp=90, seen__stamp_a_rise=85)
    assert bench.reader("velocity")() == 0


@pytest.mark.parametrize(("name", "half"), some_of([("mhz", None), ("narrow", 1), ("narrow", 5)], 0, 1))
def test_rtl(name, half):
    simulate(__file__, make, name=name, half=half)


def speeds(d: mt.Design, strobes, edges: list[Edge]):
    """Yield velocity and bound in counts a clock, as the module's equations give them, from lists of edges alone."""
    since, lasts, velocity = None, [], Fraction(0)
    half_count = 1 << (d.count_width - 1)
    for strobe in strobes:
        if since is None or strobe.restart:
            since, lasts = strobe.edges, []
        last = edges[strobe.edges - 1] if strobe.edges > since else None
        if last and strobe.at - last.at >= 3 << (d.stamp_width - 2):
            since, last = strobe.edges, None
        if last is None:
            lasts, velocity = [], Fraction(0)
            yield velocity, Fraction(0)
            continue
        lasts.append(last)
        older = lasts[max((len(lasts) - 1) // d.half - 1, 0) * d.half]
        # Some samples last longer than the axis's, so that times alias, too.
        time = (last.at - older.at) % (1 << d.stamp_width)
        if time:
            moved = (last.number - older.number + half_count) % (2 * half_count) - half_count
            velocity = Fraction(moved, time)
        yield velocity, Fraction(3, 2 * (strobe.at - last.at))


@pytest.mark.parametrize(("name", "half"), [("mhz", None), ("paper", 1), ("narrow", 3), ("wide", None)])
def test_model_is_the_exact_mean_velocity_within_its_bound(name, half):
    d = design(name, half)
    strobes, edges = turn(d, seeded(), 6_000)
    seen = model(d, without_run(rows(d, strobes, edges)), NOTHING)
    moving = 0
    for k, (velocity, bound) in enumerate(speeds(d, strobes, edges)):
        word = math.floor(min(abs(velocity), bound) * d.clocks * 2**d.velocity.f + Fraction(1, 2))
        expected = min(word, d.velocity.max) * (-1 if velocity < 0 else 1), int(word > d.velocity.max)
        assert (seen["velocity"][k], seen["saturated"][k]) == expected, f"sample {k}: {strobes[k]}"
        moving += word > 0
    assert moving > 1_500


@pytest.mark.parametrize("rate", [1_000, 100_000])
def test_fixed_point_is_the_algorithm_rounded(rate):
    check_rounding_is_the_only_difference(NAME, rate)


@pytest.mark.parametrize("displaced", [0.0, 0.1])
def test_the_error_is_within_the_guaranteed_bound(displaced):
    """On the paper's signal from where a window is short of a count in motion, with edges in place and out of place."""
    rate, signal = 10_000, replace(signals.paper(), seconds=0.2)
    axis = accuracy.axis_spec(NAME, rate, signal.acceleration_max_m_per_s2)
    d = axis.design.estimator
    late = offsets((displaced, -displaced, displaced, -displaced), 0.0)
    seen, flags = velocities(signal, axis, "float", late)
    true, unit = exact(signal, axis, len(seen)), axis.velocity_unit_m_per_s
    c = axis.acceleration_max_m_per_s2 / axis.count_m / rate**2
    fastest = np.abs(true).max() / unit
    # A stamp is late by less than a clock; the last edge is older than the sample by less than the time of an edge.
    stamps = fastest / (d.half * d.clocks)
    bound = c * (d.half + 1) + 2 * displaced / d.half + stamps + 2 * c
    error = np.abs(seen - true)[4 * d.half :] / unit
    assert flags == 0
    assert error.max() <= bound
    assert error.max() >= 0.3 * bound


def test_a_turn_within_a_count_reads_the_mean_and_not_the_edges_that_passed():
    """The same edge passed both ways is the same place: between them the axis has not moved on the mean."""
    d = design("mhz", 50)
    params, state = d.params({}), NOTHING
    there = [(0, 0, 100, {}), (1, 0, 200, {"stamp_a_rise": 150}), (2, 0, 300, {"stamp_b_rise": 250})]
    back = [(1, 1, 400, {"stamp_b_rise": 350}), (0, 1, 500, {"stamp_a_rise": 450})]
    seen, stamps = [], {}
    for count, down, now, passed in there + back:
        stamps |= passed
        kind = {"stamp_a_rise": 0, "stamp_b_rise": 1}[next(iter(passed), "stamp_a_rise")]
        sight = Seen(count, now, stamps.get("stamp_a_rise", 0), stamps.get("stamp_b_rise", 0), 0, 0, kind, down, 1)
        state, velocity, _ = estimate(params, state, sight, 0)
        seen.append(velocity * d.velocity.lsb)
    # The first edge is 1 at clock 150: edge 2 at 250, edge 2 again at 350, edge 1 again at 450.
    assert seen == pytest.approx([0, 0, 50 / 100, 50 / 200, 0], abs=d.velocity.lsb)


def test_a_standing_axis_reads_zero_and_a_slowing_one_falls():
    check_a_standing_axis_reads_zero_and_a_slowing_one_falls(NAME)


def test_the_default_window_is_the_minimax_one():
    axis = spec("mhz", NAME)
    d, c = axis.design.estimator, axis.acceleration_max_m_per_s2 / axis.count_m / axis.sample_hz**2
    halves = d.half + np.array([-3, 0, 3])
    assert (c * halves + 2 * axis.edge_error_max_counts / halves).argmin() == 1
    assert axis.design.gains.window_s * axis.sample_hz == pytest.approx(2 * d.half, abs=1)
    coarse = AxisSpec(**PAPER, edge_error_max_counts=0.4, estimator=NAME)
    assert coarse.design.gains.window_s == pytest.approx(2 * Gains.default(spec("paper", NAME)).window_s)


@pytest.mark.parametrize("name", ["mhz", "narrow", "paper", "wide"])
def test_int64_holds_every_intermediate_at_the_longest_window(name):
    """From the ends of the inputs the kernel gives what Python's own integers give."""
    axis = spec(name, NAME)
    most = kept_edges.half_max(axis)
    d = design(name, most)
    assert d.clocks * d.edges_max << d.velocity.f + 1 < 1 << kept_edges.DIVIDEND_BITS
    assert (3 << d.stamp_width - 2) + 2 * most * d.clocks <= 1 << d.stamp_width
    with pytest.raises(FieldError, match=r"^window_s must be more than 0 and at most .* at these rates, not"):
        design(name, most + 1)
    half_count, top = 1 << (d.count_width - 1), (1 << d.stamp_width) - 1
    for count, time, age in ((-half_count, 1, 1), (half_count - 1, top, 1), (half_count - 1, 1, top // 2)):
        stamp = (top - age) & top
        kept = NOTHING._replace(running=1, known=1, older_stamp=(stamp - time) & top, number=1)
        sight = Seen(count, top, stamp, 0, 0, 0, 0, 0, 0)
        given = estimate(d.params({}), kept, sight, 0)
        assert given == kept_edges.step.py_func(d.params({}), kept, sight, 0)
        assert abs(given[1]) <= d.velocity.max


@pytest.mark.parametrize(("window_s", "told"), [(-1.0, "1e-30 to 1e\\+30"), (math.nan, ".*"), (10.0, "more than 0 .*")])
def test_a_window_that_cannot_be_held_is_refused(window_s, told):
    with pytest.raises(ValueError, match=f"^window_s must be {told}.*, not {window_s}$"):
        mt.Design(spec("mhz", NAME), Gains(window_s))


def test_an_axis_whose_samples_are_too_long_is_refused():
    slow = PAPER | {"clock_hz": 1_000_000_000, "sample_hz": 10, "actuation_hz": 10}
    with pytest.raises(ValueError, match=r"^sample_hz must be at least .*, not 10$"):
        _ = AxisSpec(**slow, estimator=NAME).design


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
