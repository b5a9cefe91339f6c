"""Switching between a cycle's time and a window's counts: RTL against model, model against exact rationals."""

import math
from dataclasses import replace
from fractions import Fraction
from random import Random

import cocotb
import pytest

from hardwall.hdl.estimators.period_count import Estimator
from hardwall.model.estimators import period_count
from hardwall.model.estimators.period_count import START
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, simulate
from hardwall.testing.estimators import follow, model, reset_words
from stimuli.edges import Edge, Strobe, anything, rows, sights, turn
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import spec

NAME = "period-count"


def design(name: str) -> period_count.Design:
    return spec(name, "period-count").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def with_words(d: period_count.Design, plain, random: Random):
    """Yield rows with a word: mostly the reset value, otherwise any value."""
    switch = reset_words(d)[0]
    for row in plain:
        if random.random() < 0.002:
            switch = reset_words(d)[0] if random.random() < 0.7 else random.randrange(d.switch.format.max + 1)
            switch = switch if random.random() < 0.8 else random.randrange(4)
        yield *row, switch


def at_the_switch(d: period_count.Design):
    """Yield rows without edges whose windows are decided by one bit: counting begins with it, and goes on with it.

    Two of them more are of the largest speed that the format has, and of the next.
    """
    window, half, most = 1 << d.window_bits, 1 << (d.count_width - 1), d.switch.format.max
    largest = d.velocity.max * window >> d.velocity.f
    for size in (*(1 << bit for bit in range(d.count_width)), largest, largest + 1):
        for way in (size, -size):
            for k in range(2 * window + 1):
                count = k // window * way
                switch = min(size + 1, most) if k > window else size - 1
                yield (count + half) % (2 * half) - half, *[0] * 8, int(k == 0), switch


def of_one_bit(d: period_count.Design):
    """Yield rows whose cycles give speeds of a single bit, in both directions, while no window is counted."""
    strobes, edges, now = [], [], 0
    for bit in range(d.velocity.f + 1):
        cycle = d.dividend >> (bit + 1)
        if not 24 < cycle < 64 * d.clocks:
            continue
        for down in (0, 1):
            numbers = range(1, 13) if not down else range(12, 0, -1)
            edges += [Edge(now + 1 + k * cycle // 4, number, down) for k, number in enumerate(numbers)]
            end = edges[-1].at + 2 * d.clocks
            while now < end:
                now += d.clocks
                strobes.append(Strobe(now, 0, sum(edge.at < now for edge in edges)))
    yield from ((*row, d.switch.format.max) for row in rows(d, strobes, edges))


def at_an_edge(d: period_count.Design):
    """Yield rows of which one is at the very clock of an edge: an age of 0 is taken for no known edge."""
    edges = [Edge(1 + 2 * d.clocks * k, k + 1, 0) for k in range(9)]
    ends = [*(d.clocks * k for k in range(1, 17)), edges[-1].at]
    ends += [ends[-1] + d.clocks * k for k in range(1, 4)]
    strobes = [Strobe(end, 0, sum(edge.at <= end for edge in edges)) for end in ends]
    yield from ((*row, d.switch.format.max) for row in rows(d, strobes, edges))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    d, random = design(name), seeded()
    decided = [*at_the_switch(d), *of_one_bit(d), *at_an_edge(d)]
    samples = SAMPLES // (10 if name == "narrow" else 1)
    samples = max(samples - len(decided), samples // 2)
    turns = [rows(d, *turn(d, random, samples // 3), invert) for invert in (False, True)]
    plain = (row for part in (*turns, anything(d, random, samples // 3)) for row in part)
    expected = await follow(dut, make(name), [*with_words(d, plain, random), *decided], START)
    assert {0, 1} <= set(expected["saturated"]) <= {0, 1, 2, 3}
    for end in (-d.velocity.max, 0, d.velocity.max):
        assert end in expected["velocity"]


@pytest.mark.parametrize("name", some_of(["mhz", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def speeds(d: period_count.Design, strobes, edges, switch: int):
    """Yield (velocity in counts a sample, whether counted), as the module's equations give them, unrounded."""
    cycle, counting, moved = None, False, 0
    counts = []  # counts at the window's strobes
    for sight in sights(d, strobes, edges):
        if sight.restart:
            counting, moved, counts = False, 0, []
        counts.append(sight.count)
        if len(counts) == (1 << d.window_bits) + 1:
            moved, counts = counts[-1] - counts[0], counts[-1:]
            counting = abs(moved) > switch or (counting and abs(moved) >= switch - 1)
        if not sight.ages or (sight.news and not sight.cycle):
            cycle = None
        elif sight.news and sight.cycle[0] == 4:
            cycle = sight.cycle[1]
        speed = Fraction(0)
        if cycle and len(sight.ages) == 4:
            speed = Fraction(4 * d.clocks, max(cycle, sight.ages[3]))
        speed = -speed if sight.down else speed
        yield (Fraction(moved, 1 << d.window_bits) if counting else speed), counting


@pytest.mark.parametrize(("name", "switch"), [("mhz", None), ("mhz", 60), ("paper", None), ("narrow", 5)])
def test_model_is_the_exact_speed_rounded(name, switch):
    d, random = design(name), seeded()
    switch = switch or reset_words(d)[0]
    # No window may alias, so the speeds stay within the axis's range.
    strobes, edges = turn(d, random, 20_000, most=2 if name == "narrow" else None)
    seen = model(d, [(*row, switch) for row in rows(d, strobes, edges)], START)
    modes = {False: 0, True: 0}
    for k, (speed, counting) in enumerate(speeds(d, strobes, edges, switch)):
        word = math.floor(abs(speed) * 2**d.velocity.f + Fraction(1, 2))
        expected = min(word, d.velocity.max) * (-1 if speed < 0 else 1), int(word > d.velocity.max)
        assert (seen["velocity"][k], seen["saturated"][k] & 1) == expected, f"sample {k}: {strobes[k]}"
        modes[counting] += word > 0
    assert modes[False] > 100
    assert modes[True] > 100


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ({"window_s": -1.0, "switch_m_per_s": 1.0}, "window_s must be 1e-30 to 1e\\+30, not -1.0"),
        ({"window_s": 1e-3, "switch_m_per_s": math.nan}, "switch_m_per_s must be 1e-30 to 1e\\+30, not nan"),
        ({"window_s": 1e-9, "switch_m_per_s": 1.0}, "window_s must be .* to .* at these rates, not 1e-09"),
        ({"window_s": 1e3, "switch_m_per_s": 1.0}, "window_s must be .* to .* at these rates, not 1000.0"),
        ({"window_s": 1e-4, "switch_m_per_s": 1e-9}, "switch_m_per_s must be .* to .* with this window, not 1e-09"),
        (
            {"window_s": 1e-4, "switch_m_per_s": 1e9},
            "switch_m_per_s must be .* to .* with this window, not 1000000000.0",
        ),
    ],
)
def test_gains_that_cannot_be_held_are_refused(gains, named):
    with pytest.raises(ValueError, match=f"^{named}$"):
        period_count.Design(spec("paper", "period-count"), period_count.Gains(**gains))


@pytest.mark.parametrize("bound", [0.01, 1.6785, 12.0, 1000.0])
def test_latency_leaves_the_force_path_its_clocks(bound):
    assert replace(spec("mhz", "period-count"), acceleration_max_m_per_s2=bound).design.estimator.latency <= 38


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
