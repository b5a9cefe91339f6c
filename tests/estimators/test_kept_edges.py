"""The kept edges: RTL against model, model against exact rationals, its windows, and the ends of int64."""

import math
from fractions import Fraction

import cocotb
import numpy as np
import pytest
from mts import design, stimulus

from hardwall.hdl.estimators.kept_edges import KeptEdges
from hardwall.model.checks import FieldError
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators import kept_edges, mt
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.kept_edges import NOTHING, Gains, KeptDesign, observe
from hardwall.model.spec import AxisSpec
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, simulate
from hardwall.testing.estimators import model
from stimuli.edges import Edge, rows, turn
from stimuli.seeded import seeded
from stimuli.specs import PAPER, spec

NAME = "mt"
OUTPUTS = ("moved", "down", "time", "quiet", "news", "age")


def make(name: str, half: int) -> KeptEdges:
    return KeptEdges(design(NAME, name, half))


def observed(d: KeptDesign, inputs) -> dict[str, np.ndarray]:
    """Return what the model observes; of the age of an edge that is not known, nothing is said."""
    edges, out = NOTHING, []
    for row in inputs:
        before = edges
        edges, age = observe(d.params({}), edges, Seen(*row[:-1]), row[-1])
        news = edges.known and (edges.stamp, edges.number) != (before.stamp, before.number)
        out.append((edges.moved, edges.down, edges.time, before.quiet, news, age))
    return dict(zip(OUTPUTS, np.array(out, np.int64).T, strict=True))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    bench, names = Bench(dut, component), (*(f"seen__{name}" for name in Seen._fields), "restart")
    await bench.reset()
    at_next_strobe = bench.monitor("strobe", *OUTPUTS)
    few = stimulus(component.design, SAMPLES // 10)
    inputs, outputs = await bench.campaign("strobe", "valid", names, OUTPUTS, few, momentary=names)
    expected = observed(component.design, inputs.rows)
    d = component.design
    assert {0, min(d.edges_max, 1 << d.count_width - 1)} <= set(expected["moved"])
    unknown = expected["age"] == 0
    assert set(expected["moved"][unknown]) == {0}
    expected["age"][unknown] = [row[OUTPUTS.index("age")] for row in np.array(outputs.rows)[unknown]]
    check(inputs, outputs, expected, component.latency)
    assert at_next_strobe.rows[1:] == outputs.rows[:-1], "the outputs must stay until the next strobe"


@pytest.mark.parametrize(("name", "half"), [("mhz", 3), ("narrow", 5)])
def test_rtl(name, half):
    simulate(__file__, make, name=name, half=half)


def speeds(d: KeptDesign, strobes, edges: list[Edge]):
    """Yield velocity and bound in counts a clock, as the module's equations give them, from lists of edges alone.

    The bound is infinite while silence is no evidence.
    """
    since, lasts, velocity, quiet, doubt = None, [], Fraction(0), 0, 0
    half_count = 1 << (d.count_width - 1)
    for strobe in strobes:
        if since is None or strobe.restart:
            since, lasts = strobe.edges, []
        last = edges[strobe.edges - 1] if strobe.edges > since else None
        if last and strobe.at - last.at >= 3 << (d.stamp_width - 2):
            since, last = strobe.edges, None
        if last is None:
            lasts, velocity, quiet, doubt = [], Fraction(0), 0, 0
            yield velocity, Fraction(0)
            continue
        news = not lasts or last is not lasts[-1]
        lasts.append(last)
        older = lasts[max((len(lasts) - 1) // d.half - 1, 0) * d.half]
        # Some samples last longer than the axis's, so that times alias, too.
        time = (last.at - older.at) % (1 << d.stamp_width)
        if time:
            moved = (last.number - older.number + half_count) % (2 * half_count) - half_count
            velocity = Fraction(moved, time)
        doubt = max(doubt - 1, 0)
        if news and abs(velocity) * quiet > Fraction(3, 2):
            doubt = d.doubt
        quiet = strobe.at - last.at
        yield velocity, math.inf if doubt else Fraction(3, 2 * quiet)


@pytest.mark.parametrize(("name", "half"), [("mhz", None), ("paper", 1), ("narrow", 3), ("wide", None)])
def test_model_is_the_exact_mean_velocity_within_its_bound(name, half):
    d = design(NAME, name, half)
    strobes, edges = turn(d, seeded(), 6_000)
    seen = model(d, rows(d, strobes, edges), d.start())
    moving = 0
    for k, (velocity, bound) in enumerate(speeds(d, strobes, edges)):
        word = math.floor(min(abs(velocity), bound) * d.clocks * 2**d.velocity.f + Fraction(1, 2))
        expected = min(word, d.velocity.max) * (-1 if velocity < 0 else 1), int(word > d.velocity.max)
        assert (seen["velocity"][k], seen["saturated"][k] & 1) == expected, f"sample {k}: {strobes[k]}"
        moving += word > 0
    assert moving > 1_500


def test_a_turn_within_a_count_reads_the_mean_and_not_the_edges_that_passed():
    """The same edge passed both ways is the same place: between them the axis has not moved on the mean."""
    d = design(NAME, "mhz", 50)
    params, state = d.params({}), d.start()
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
    d = design(NAME, name, most)
    assert d.clocks * d.edges_max << d.velocity.f + 1 < 1 << kept_edges.DIVIDEND_BITS
    assert (3 << d.stamp_width - 2) + 2 * most * d.clocks <= 1 << d.stamp_width
    with pytest.raises(FieldError, match=r"^window_s must be more than 0 and at most .* at these rates, not"):
        design(NAME, name, most + 1)
    half_count, top = 1 << (d.count_width - 1), (1 << d.stamp_width) - 1
    for count, time, age in ((-half_count, 1, 1), (half_count - 1, top, 1), (half_count - 1, 1, top // 2)):
        stamp = (top - age) & top
        kept = NOTHING._replace(running=1, known=1, older_stamp=(stamp - time) & top, number=1)
        before = d.start()._replace(edges=kept)
        sight = Seen(count, top, stamp, 0, 0, 0, 0, 0, 0)
        given = estimate(d.params({}), before, sight, 0)
        assert given == kept_edges.step.py_func(d.params({}), before, sight, 0)
        assert abs(given[1]) <= d.velocity.max


@pytest.mark.parametrize(("window_s", "told"), [(-1.0, "1e-30 to 1e\\+30"), (math.nan, ".*"), (10.0, "more than 0 .*")])
def test_a_window_that_cannot_be_held_is_refused(window_s, told):
    with pytest.raises(ValueError, match=f"^window_s must be {told}.*, not {window_s}$"):
        mt.Design(spec("mhz", NAME), Gains(window_s))


def test_an_axis_whose_samples_are_too_long_is_refused():
    slow = PAPER | {"clock_hz": 1_000_000_000, "sample_hz": 10, "actuation_hz": 10}
    with pytest.raises(ValueError, match=r"^sample_hz must be at least .*, not 10$"):
        _ = AxisSpec(**slow, estimator=NAME).design
