"""The watch over bursts: RTL against model, and model against lists of edges and motions of known acceleration."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.estimators.bursts import Bursts
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.bursts import EVENTS, NOTHING, STEEPER, Limits, limits, watch
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from stimuli.edges import Edge, Strobe, anything, rows
from stimuli.emissions import Emission
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import spec

SIZES = {
    "wide": Limits(count_width=16, stamp_width=26, span=340, tolerated=0, window=9, memory=400),
    "slow samples": Limits(count_width=16, stamp_width=26, span=80, tolerated=300, window=2, memory=40),
    "narrow": Limits(count_width=6, stamp_width=10, span=20, tolerated=30, window=1, memory=3),
}
CLOCKS = 50


class Sampled(Limits):
    """Limits as stimuli of edges take them: with the clocks of a sample."""

    clocks = CLOCKS


def trains(limits: Limits, samples: int) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges: silences and runs of edges about the limits, either way, with some steps back."""
    random, strobes, edges = seeded(), [], []
    at, place, way = 0, 0, 1
    while len(strobes) < samples:
        n, gap = random.randrange(1, 9), max(1, int(limits.span * random.uniform(0.1, 1.1) / 2))
        way = -way if random.random() < 0.1 else way
        silence = random.choice([8 * gap + random.randrange(-3, 7), 8 * gap + CLOCKS * random.randrange(40), 10 * gap])
        at += max(silence, 1)
        for _ in range(n):
            step = -way if random.random() < 0.05 else way
            edges.append(Edge(at, place + 1 if step > 0 else place, int(step < 0)))
            place += step
            at += max(1, gap + random.randrange(-2, 3))
        late = (limits.window + 2) * CLOCKS if random.random() < 0.1 else 0
        due = len(strobes) * CLOCKS
        while due < at + late and len(strobes) < samples:
            strobes.append(Strobe(due + CLOCKS, int(random.random() < 0.002), 0))
            due += CLOCKS
        at += late
    taken, counted = 0, []
    for strobe in strobes:
        while taken < len(edges) and edges[taken].at < strobe.at:
            taken += 1
        counted.append(strobe._replace(edges=taken))
    return counted, edges


def stimulus(limits: Limits, samples: int) -> Iterator[tuple[int, ...]]:
    of = Sampled(*limits)
    yield from rows(of, *trains(limits, samples // 2))
    yield from anything(of, seeded(), samples // 2)


def model(limits: Limits, inputs) -> np.ndarray:
    """Return (jolt, found) of every sample, shape (samples, 2)."""
    state, out = NOTHING, []
    for row in inputs:
        state, found = watch(limits, state, Seen(*row[:-1]), row[-1])
        out.append((state.jolt, found))
    return np.array(out, np.int64)


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = Bursts(SIZES[parameters()["name"]])
    bench, strobes = Bench(dut, component), list(stimulus(component.design, SAMPLES))
    names, random = (*(f"seen__{name}" for name in Seen._fields), "restart"), seeded()
    await bench.reset()
    out, read = [], [bench.reader(name) for name in ("jolt", "found")]
    for row in strobes:
        bench.drive(strobe=1, **dict(zip(names, row, strict=True)))
        await RisingEdge(dut.clk)
        bench.drive(strobe=0)
        # An output is read as it is before an edge.
        await ClockCycles(dut.clk, component.latency)
        out.append([each() for each in read])
        # Nothing may change while the block waits, however long.
        for _ in range(random.randrange(3)):
            await RisingEdge(dut.clk)
    expected = model(component.design, strobes)
    assert {(0, 0), (1, 0), (0, 1), (1, 1)} == set(map(tuple, expected.tolist()))
    assert out == expected.tolist()


@pytest.mark.parametrize("name", some_of(SIZES, 0))
def test_rtl(name):
    simulate(__file__, lambda name: Bursts(SIZES[name]), name=name)


class Trial:
    """What the watch is to find, from lists of edges and strobes that do not wrap."""

    def __init__(self, limits: Limits, strobes: list[Strobe], edges: list[Edge]):
        self.limits, self.strobes, self.edges = limits, strobes, edges
        self.events: list[int] = []
        self.first = self.until = self.silence = 0

    def found(self, k: int) -> bool:
        """Return whether edges come in bursts at a sample; to be called of every sample in turn."""
        strobe, before = self.strobes[k], self.strobes[k - 1]
        if k == 0 or strobe.restart:
            self.events, self.until, self.silence = [], k, 0
            return False
        if strobe.edges > before.edges:
            quiet = before.at - (self.edges[before.edges - 1].at if before.edges else 0)
            quiet = min(quiet, max(4 * (self.limits.span + 1), self.limits.tolerated) + 1)
            if k >= self.until or quiet > self.silence:
                self.silence, self.first, self.until = quiet, before.edges, k + self.limits.window
            if k < self.until and self._is_jolt(self.edges[max(strobe.edges - 3, 0) : strobe.edges], strobe.edges):
                if self.silence > self.limits.tolerated:
                    self.events.append(k)
                self.until, self.silence = k, 0
        together = 1
        for later, sooner in zip(self.events[:0:-1], self.events[-2::-1], strict=True):
            if later - sooner >= self.limits.memory:
                break
            together += 1
        return together >= EVENTS and k - self.events[-1] < self.limits.memory

    def _is_jolt(self, last: list[Edge], edges: int) -> bool:
        span = last[-1].at - last[0].at
        moved = self._place(edges) - self._place(self.first)
        one_way = len(last) == 3 and len({edge.down for edge in last}) == 1
        return one_way and abs(moved) >= 3 and span <= self.limits.span and 4 * (span + 1) < self.silence

    def _place(self, edges: int) -> int:
        last = self.edges[edges - 1] if edges else Edge(0, 0, 0)
        return last.number - last.down


@pytest.mark.parametrize("name", ["wide", "slow samples"])
def test_a_jolt_is_three_close_edges_soon_after_a_silence(name):
    limits = SIZES[name]
    strobes, edges = trains(limits, 20_000)
    seen, trial = model(limits, rows(Sampled(*limits), strobes, edges))[:, 1], Trial(limits, strobes, edges)
    expected = [int(trial.found(k)) for k in range(len(strobes))]
    assert 0.05 < np.mean(expected) < 0.95
    assert seen.tolist() == expected


AXES = {
    "mhz": {},
    "100 kHz": {"sample_hz": 100_000, "actuation_hz": 100_000},
    "10 kHz": {"sample_hz": 10_000, "actuation_hz": 10_000},
    "coarse": {"count_m": 20e-6, "speed_max_m_per_s": 20.0},
}


def axis_of(name: str):
    return replace(spec("mhz", "mt"), **AXES[name])


def pushed(axis, steep: float, random: np.random.Generator) -> np.ndarray:
    """Return the acceleration, m/s^2, at every clock of 10 ms: rests, and pushes this way or that with the same back.

    `steep` is that acceleration in those of the watch.
    """
    acceleration = steep * STEEPER * axis.acceleration_max_m_per_s2
    push, at = np.zeros(axis.clock_hz // 100), 0
    while at < len(push):
        at += int(axis.clock_hz * 10.0 ** random.uniform(-5.0, -3.0))
        length = int(axis.clock_hz * math.sqrt(axis.count_m / acceleration) * random.uniform(0.5, 6.0))
        way = acceleration * random.choice([-1, 1])
        push[at : at + length], push[at + length : at + 2 * length] = way, -way
        at += 2 * length
    return push


def passed(axis, push: np.ndarray, begin: float, errors) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges of a handle that rests at a place, counts, and is accelerated.

    `errors` returns by how many counts the edges of given numbers are out of their place.
    """
    place = begin + np.cumsum(np.cumsum(push)) / axis.clock_hz**2 / axis.count_m
    numbers = np.arange(math.floor(place.min()) - 2, math.ceil(place.max()) + 2)
    cell = np.searchsorted(numbers + errors(numbers), place, side="right") + numbers[0] - 1
    steps = np.diff(cell)
    clocks = np.flatnonzero(steps) + 1
    assert np.abs(steps).max() == 1
    # The scale begins where the handle does: the count of no edge is 0.
    found = zip(clocks.tolist(), (np.maximum(cell[clocks], cell[clocks - 1]) - cell[0]).tolist(), strict=True)
    edges = [Edge(at, number, int(steps[at - 1] < 0)) for at, number in found]
    sampled = np.arange(1, len(push) // axis.clocks_per_sample) * axis.clocks_per_sample
    taken = np.searchsorted(clocks, sampled)
    return [Strobe(at, 0, number) for at, number in zip(sampled.tolist(), taken.tolist(), strict=True)], edges


def nearest(numbers: np.ndarray) -> np.ndarray:
    """Return errors with which a cell of 1.99 counts is before three edges as near as any, 0.505 counts."""
    return np.array([-0.495, 0.495, 0.0, -0.495])[numbers % 4]


def from_the_end_of_a_long_cell(axis, steep: float) -> np.ndarray:
    """Return accelerations of a handle that rests where such a cell begins, and two cycles on rests again."""
    acceleration = steep * STEEPER * axis.acceleration_max_m_per_s2
    length = round(axis.clock_hz * math.sqrt(2 * 4 * axis.count_m / acceleration))
    rest = 20 * length + 5 * axis.clocks_per_sample
    once = np.repeat([0.0, acceleration, -acceleration], [rest, length, length])
    return np.tile(once, 10)


def jolts(axis, strobes: list[Strobe], edges: list[Edge]) -> int:
    """Return how many jolts the watch finds."""
    of = limits(axis)
    state, number = NOTHING, 0
    for row in rows(Sampled(*of), strobes, edges):
        state, _ = watch(of, state, Seen(*row[:-1]), row[-1])
        number += state.jolt
    return number


@pytest.mark.parametrize("name", AXES)
def test_no_motion_of_less_acceleration_is_a_jolt(name):
    """Relays of 0.98 of the acceleration that no axis has, on scales whose edges err by 0.495 counts."""
    axis, random, number = axis_of(name), np.random.default_rng(1), 0
    for _ in range(20):
        errors = random.choice([-0.495, 0.0, 0.495], size=1 << 12)
        strobes, edges = passed(axis, pushed(axis, 0.98, random), random.uniform(0, 1), lambda n, of=errors: of[n])
        number += len(edges)
        assert jolts(axis, strobes, edges) == 0
    assert number > 500


@pytest.mark.parametrize("name", AXES)
def test_nor_is_the_worst_one_and_far_more_acceleration_is(name):
    """The worst begins where it has the longest way to gain speed, to three edges as near as any."""
    axis = axis_of(name)

    def found(steep: float) -> int:
        return jolts(axis, *passed(axis, from_the_end_of_a_long_cell(axis, steep), -0.485, nearest))

    assert found(0.98) == 0
    # At 10 kHz a sample sees the end of such a motion alone, where it brakes.
    assert found(30.0) > 0 or name == "10 kHz"


@pytest.mark.parametrize("name", ["mhz", "100 kHz"])
@pytest.mark.parametrize("in_a_burst", [3, 5, 40])
def test_bursts_are_found_at_the_third(name, in_a_burst):
    """Whatever the phase: three or more edges 400 ns apart, behind a silence that a sample sees for four times that."""
    axis = axis_of(name)
    of, apart = limits(axis), 20
    period = 1000 + in_a_burst * apart
    for phase in range(0, period, 130):
        clocks = Emission(period, apart, phase).clocks(np.repeat(np.arange(30) * period, in_a_burst))
        edges = [Edge(int(clock), n, 0) for n, clock in enumerate(clocks, 1)]
        sampled = np.arange(1, clocks[-1] // axis.clocks_per_sample) * axis.clocks_per_sample
        strobes = [Strobe(int(c), 0, int(n)) for c, n in zip(sampled, np.searchsorted(clocks, sampled), strict=True)]
        found = model(of, rows(Sampled(*of), strobes, edges))[:, 1]
        first = int(found.argmax())
        assert found[first]
        assert found[first:].all()
        assert sampled[first] <= clocks[0] + 6 * period


def test_the_times_are_those_of_the_page():
    page = (Path(__file__).parents[2] / "docs/reference/estimators.md").read_text(encoding="utf-8")
    part = page[page.index("## Edges in bursts") :]
    axis = spec("mhz", "mt")
    assert f"within {(limits(axis).span + 1) / axis.clock_hz * 1e6:.1f} us" in part
    assert f"less than {STEEPER * axis.acceleration_max_m_per_s2:g} m/s" in part
    for name in ("edge-kalman", "levant-edge", "mt"):
        tolerated = spec("mhz", name).design.estimator.bursts.tolerated / axis.clock_hz
        assert re.search(rf"^\| `{name}`.*: {tolerated * 1e6:.0f} us \|", part, re.MULTILINE)


def test_another_design_is_refused():
    with pytest.raises(TypeError, match=r"^design must be a bursts.Limits, not 3$"):
        Bursts(3)
