"""The watch over bursts: RTL against model, and model against lists of edges and motions of known acceleration."""

import math
from collections.abc import Iterator
from dataclasses import replace

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.estimators.bursts import Bursts
from hardwall.model.estimators.bursts import EVENTS, NOTHING, STEEPER, Limits, limits, watch
from hardwall.model.quadrature import Seen
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
    names = *(f"seen__{name}" for name in Seen._fields), "restart"
    await bench.reset()
    out, read = [], [bench.reader(name) for name in ("jolt", "found")]
    for row in strobes:
        bench.drive(strobe=1, **dict(zip(names, row, strict=True)))
        await RisingEdge(dut.clk)
        bench.drive(strobe=0)
        # An output is read as it is before an edge.
        await ClockCycles(dut.clk, component.latency)
        out.append([each() for each in read])
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


def moved(axis, steep: float, random: np.random.Generator, error: float) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges of a handle that rests, and is then accelerated one way, and back, as if by a relay.

    Its edges are up to twice `error` counts nearer or farther from one another than a count.
    """
    acceleration, seconds = steep * STEEPER * axis.acceleration_max_m_per_s2, 0.01
    clocks, tau = int(axis.clock_hz * seconds), 1 / axis.clock_hz
    push, at = np.zeros(clocks), 0
    while at < clocks:
        # Rest; a push from there, for some counts; and the same against it.
        at += int(axis.clock_hz * 10.0 ** random.uniform(-5.0, -3.0))
        length = int(axis.clock_hz * math.sqrt(axis.count_m / acceleration) * random.uniform(0.5, 6.0))
        way = acceleration * random.choice([-1, 1])
        push[at : at + length], push[at + length : at + 2 * length] = way, -way
        at += 2 * length
    place = np.cumsum(np.cumsum(push)) * tau**2 / axis.count_m + random.uniform(0, 1)
    ends = math.floor(place.min()) - 2, math.ceil(place.max()) + 2
    scale = np.arange(*ends) + random.choice([-error, 0.0, error], size=ends[1] - ends[0])
    cell = np.searchsorted(scale, place, side="right") + ends[0] - 1
    jumps = np.flatnonzero(np.diff(cell))
    assert np.abs(np.diff(cell)).max() <= 1
    up = np.diff(cell)[jumps] > 0
    at_clock = jumps + 1
    numbers = np.where(up, cell[at_clock], cell[jumps])
    edges = [Edge(int(c), int(n), int(not u)) for c, n, u in zip(at_clock, numbers, up, strict=True)]
    sampled = np.arange(1, clocks // axis.clocks_per_sample) * axis.clocks_per_sample
    taken = np.searchsorted(at_clock, sampled)
    # The scale begins where the handle does: the count of no edge is 0.
    first = int(cell[0])
    edges = [edge._replace(number=edge.number - first) for edge in edges]
    return [Strobe(int(c), 0, int(n)) for c, n in zip(sampled, taken, strict=True)], edges


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
    """Relays of 0.98 of the acceleration that no axis has."""
    axis, random, passed = axis_of(name), np.random.default_rng(1), 0
    for _ in range(20):
        strobes, edges = moved(axis, 0.98, random, 0.495)
        passed += len(edges)
        assert jolts(axis, strobes, edges) == 0
    assert passed > 500


@pytest.mark.parametrize("name", AXES)
def test_a_motion_of_far_more_acceleration_is_one(name):
    axis, random = axis_of(name), np.random.default_rng(1)
    assert sum(jolts(axis, *moved(axis, 400.0, random, 0.0)) for _ in range(10)) > 0


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


def test_another_design_is_refused():
    with pytest.raises(TypeError, match=r"^design must be a bursts.Limits, not 3$"):
        Bursts(3)
