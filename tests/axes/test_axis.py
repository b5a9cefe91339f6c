"""Axes in a rota, pins to force: RTL against the models of decoder and axis, with everything changing while it runs."""

from collections import deque

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.axes.axis import Axes
from hardwall.model.axes import axis as axes
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis import axis
from hardwall.model.spec import AxisSpec
from hardwall.testing import SAMPLES, Bench, parameters, rng, simulate
from oracles.axes import Seen, Write, check, lanes_of
from stimuli import handle
from stimuli.axes import random_words, rota
from stimuli.lengths import LONG, REACHING, WHOLE, long_form
from stimuli.places import place
from stimuli.specs import MHZ

LEVELS = "encoder_a", "encoder_b", "encoder_z", "drive_enable"
PULSES = "preload", "origin_shift", "index_arm", "clear_flags", "slip"
"""The inputs of one bit for each axis besides `commit`."""
CHANCES = {"commit": 0.004, "preload": 0.004, "origin_shift": 0.004, "index_arm": 0.02, "clear_flags": 0.01}
CHANCES |= {"slip": 0.001}
"""The chances of a pulse in a clock."""
STIFFEST = "wall_stiffness", "output_force_limit", "output_slew_limit"
"""The words whose largest make the largest drive."""


def make(**given) -> Axes:
    return Axes(rota(**given))


class World:
    """The encoders and the host of axes: they do what they like at every clock, and what they did is kept.

    Attributes:
        given: the inputs at every clock.
        writes: the words that the host wrote.
    """

    def __init__(self, spec: AxesSpec, random: np.random.Generator):
        self.spec, self.random, self.given, self.writes = spec, random, [], []
        self.levels = dict.fromkeys(LEVELS, 0) | {"drive_enable": (1 << spec.axes) - 1}
        habits = handle.Habits(illegal=0.01, index=0.1)
        self.moves = [
            handle.edges(np.random.default_rng(seed), habits) for seed in random.integers(1 << 32, size=spec.axes)
        ]
        self.left = [0] * spec.axes
        self.orders: deque = deque()

    def _pins(self) -> None:
        for number, move in enumerate(self.moves):
            while self.left[number] == 0:
                changed, self.left[number] = next(move)
                for name, level in changed.items():
                    self.levels[name] = self.levels[name] & ~(1 << number) | level << number
            self.left[number] -= 1

    def _orders(self) -> None:
        """Give orders to write all words of an axis in any order, and to commit them."""
        number, words = int(self.random.integers(self.spec.axes)), random_words(self.spec.design, self.random)
        kind = self.random.random()
        if kind < 0.25:
            # Of a wall that is all damper, the lowest bit of a velocity decides.
            most = next(word.format.max for word in self.spec.design.words if word.name == "wall_damping")
            words |= {"wall_damping": most, "wall_stiffness": 0, "wall_forbid_pull": 0}
        elif kind < 0.45:
            # The stiffest wall, and nothing that limits its force but the axis.
            words |= {each.name: each.format.max for each in self.spec.design.words if each.name in STIFFEST}
        self.orders += [(number, name, words[name]) for name in self.random.permutation(list(words)).tolist()]
        self.orders.append((number, "", 0))

    def _host(self) -> dict[str, int]:
        """Return the inputs of the host that are high in this clock."""
        spec, random = self.spec, self.random
        acts = {"word_write": 0, "commit": 0, **dict.fromkeys(PULSES, 0)}
        if not self.orders and random.random() < 0.2:
            self._orders()
        if self.orders and random.random() < 0.8:
            number, name, word = self.orders.popleft()
            if name:
                self.writes.append(Write(len(self.given), number, name, word))
                row = [each.name for each in spec.design.words].index(name)
                acts |= {"word_write": 1, "word_axis": number, "word_number": row, "word_value": word}
            else:
                acts["commit"] = 1 << number
        act, number = random.random(), int(random.integers(spec.axes))
        for name, chance in CHANCES.items():
            if random.random() < chance:
                acts[name] |= 1 << number
                acts["preload_count"] = place(random, spec.count_width)
        if act < 0.01:
            # Most of the time an axis is enabled.
            bit = 1 << int(random.integers(spec.axes))
            low = act < 0.002
            self.levels["drive_enable"] = self.levels["drive_enable"] & ~bit | (0 if low else bit)
        return acts

    def step(self) -> dict[str, int]:
        """Return the inputs of the next clock."""
        self._pins()
        self.given.append({"preload_count": 0} | self._host() | self.levels)
        return self.given[-1]


def check_strobes(spec: AxesSpec, seen: Seen) -> None:
    """Check which axis is sampled at every clock."""
    rota = [clock % spec.clocks_per_sample for clock in range(len(seen.words))]
    assert seen.port("strobe") == [int(place < spec.axes) for place in rota]
    assert all(axis == place for axis, place in zip(seen.port("strobe_axis"), rota, strict=True) if place < spec.axes)


@cocotb.test()
async def every_axis_is_a_single_one(dut):
    spec, random = rota(**parameters()), rng()
    bench = Bench(dut, Axes(spec))
    clocks, rose, drives = max(SAMPLES, REACHING) // (200 if WHOLE else 400) * spec.clocks_per_sample, 0, []
    await bench.reset()
    # The second run begins with a reset amid the first.
    for _ in range(2):
        world, seen = World(spec, random), Seen(bench.packing, spec)
        for _ in range(clocks):
            bench.drive(**world.step())
            await RisingEdge(dut.clk)
            seen.words.append(int(dut.bench_seen.value))
        bench.drive(rst=1)
        await RisingEdge(dut.clk)
        bench.drive(rst=0)
        lanes = lanes_of(spec, world.given, world.writes)
        check(spec, lanes, seen)
        check_strobes(spec, seen)
        assert all(each.committed > 5 for each in lanes)
        rose |= int(np.bitwise_or.reduce([np.bitwise_or.reduce(each.outputs.flags) for each in lanes]))
        drives += [each.outputs.drive for each in lanes]
    # The run must show forces in both directions, all faults of the encoder, a saturated estimator, and both limits.
    assert any((drive > 0).any() for drive in drives)
    assert any((drive < 0).any() for drive in drives)
    assert spec.design.flag_names(rose) == list(spec.design.flags)


@pytest.mark.parametrize(
    ("number", "spare", "estimator"),
    [
        (number, spare, estimator)
        for number, spare in ((1, 0), (3, 2), (16, 0))
        for estimator in axes.PIPELINES
        if LONG
        or (WHOLE and (number == 3 or (number, estimator) == (1, "fdm")))
        or (number, estimator) == (3, "levant")
    ],
)
def test_rtl(number, spare, estimator):
    simulate(__file__, make, axes=number, estimator=estimator, spare=spare)


def test_rtl_of_a_window_of_which_every_few_samples_are_stored():
    # With clocks to spare a handle goes faster than the window's format holds.
    assert rota(2, "window", spare=8, window_s=0.1).design.estimator.history.every > 1
    simulate(__file__, make, axes=2, estimator="window", spare=8, window_s=0.1)


@long_form
@pytest.mark.parametrize("estimator", axes.PIPELINES)
def test_rtl_of_the_most_axes(estimator):
    simulate(__file__, make, axes=axes.AXES_MAX, estimator=estimator, spare=0)


def spec_of(**changes) -> AxesSpec:
    return AxesSpec(**{**MHZ, "clock_hz": 96_000_000, "sample_hz": 6_000_000, "actuation_hz": 6_000_000, **changes})


def test_every_axis_of_the_model_is_a_single_one():
    spec = spec_of(axes=3, sample_hz=1_000_000, actuation_hz=500_000)
    alone = {name: getattr(spec, name) for name in (*MHZ, "estimator")}
    random = np.random.default_rng(1)
    counts = np.cumsum(random.integers(-2, 3, (3, 500)), axis=1)
    sets = [{"wall_stiffness": 1e3 * (1 + n), "wall_damping": 10.0 * n, "wall_left": float(n & 1)} for n in range(3)]
    record = axes.Axes(spec, sets).run(counts)
    for number, si in enumerate(sets):
        single = axis.Axis(AxisSpec(**alone), **si).run(counts[number])
        for name in ("velocity", "force", "drive", "flags"):
            assert (getattr(record, name)[number] == getattr(single, name)).all()
    assert (record.drive != 0).any()


def test_the_slots_are_an_axis_each_and_no_fewer_than_the_recurrence():
    assert [spec_of(axes=number, sample_hz=1_000_000, actuation_hz=1_000_000).slots for number in (1, 16, 32)] == [
        15, 16, 32
    ]  # fmt: skip
    assert spec_of(axes=1, estimator="fdm").slots == 4
    assert spec_of(axes=16).clocks_per_sample == 16


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axes": 0}, r"axes must be 1 to 32, not 0"),
        ({"axes": 33}, r"axes must be 1 to 32, not 33"),
        ({"axes": 17}, r"sample_hz must leave 17 clocks for 17 axes in turn, so at most 5647058 .* not 6000000"),
        ({"axes": 2, "estimator": "kalman"}, r"estimator must be one of fdm, levant.*, not 'kalman'"),
    ],
)
def test_impossible_axes_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        spec_of(**changes)


def test_what_is_no_specification_of_axes_is_refused():
    for made in (lambda: Axes(3), lambda: axes.Axes(3, [])):
        with pytest.raises(TypeError, match=r"not 3$"):
            made()


def test_parameters_and_counts_are_of_every_axis():
    spec = spec_of(axes=2)
    with pytest.raises(ValueError, match="each of the 2 axes, not for 1"):
        axes.Axes(spec, [{}])
    with pytest.raises(ValueError, match=r"a row for each of the 2 axes, not the shape \(3, 4\)"):
        axes.Axes(spec, [{}, {}]).run(np.zeros((3, 4), np.int64))
