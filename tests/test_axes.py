"""Axes in a rota, pins to force: RTL against the models of decoder and axis, with everything changing while it runs."""

from collections import deque

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hardwall.hdl.axes import Axes
from hardwall.model import axes, axis, clocked
from hardwall.model.axes import AxesSpec
from hardwall.model.clocked_axes import Outputs
from hardwall.model.design import ENCODER_FLAGS
from hardwall.model.spec import AxisSpec
from hardwall.testing import SAMPLES, Bench, parameters, rng, simulate
from oracles.axes import Lane, Write, lane
from stimuli import handle
from stimuli.axes import random_words, rota
from stimuli.lengths import LONG, REACHING, long_form
from stimuli.specs import MHZ

PINS = clocked.Pins._fields
LEVELS, PULSES = ("encoder_a", "encoder_b", "encoder_z", "drive_enable"), ("preload", "index_arm", "clear_flags")
"""The inputs of one bit for each axis besides `commit`."""
CHANCES = {"commit": 0.004, "preload": 0.004, "index_arm": 0.02, "clear_flags": 0.01}
"""The chances of a pulse in a clock."""
STIFFEST = "wall_stiffness", "output_force_limit", "output_slew_limit"
"""The words whose largest make the largest drive."""
RECORD = "count", "velocity", "wall_force", "drive", "flags"
"""The words of the record of a sample, and of `Samples`."""


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
                place = [each.name for each in spec.design.words].index(name)
                acts |= {"word_write": 1, "word_axis": number, "word_number": place, "word_value": word}
            else:
                acts["commit"] = 1 << number
        act, number = random.random(), int(random.integers(spec.axes))
        half = 1 << spec.count_width - 1
        for name, chance in CHANCES.items():
            if random.random() < chance:
                acts[name] |= 1 << number
                acts["preload_count"] = int(random.integers(-half, half))
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

    def lane(self, number: int) -> Lane:
        """Return what the model makes of it all, for one axis."""

        def bits(name: str) -> np.ndarray:
            return np.array([given[name] >> number & 1 for given in self.given], np.int64)

        pins = {name: bits(name) for name in (*LEVELS, *PULSES)}
        pins["preload_count"] = np.array([given["preload_count"] for given in self.given], np.int64)
        return lane(self.spec, number, clocked.Pins(**pins), bits("commit"), self.writes)


class Seen:
    """The outputs of the hardware at every clock, from its packed words.

    Attributes:
        words: the packed words, by clock.
    """

    def __init__(self, bench: Bench, spec: AxesSpec):
        self.packing, self.spec, self.words = bench.packing, spec, []
        design = spec.design
        self.shapes = {
            "drive": (spec.force.width, 1),
            "flags": (len(design.flags), 0),
            "illegal_count": (8, 0),
            "edge_kind": (2, 0),
        }
        self.shapes |= dict.fromkeys(("count", "index_count"), (spec.count_width, 1))

    def port(self, name: str) -> list[int]:
        """Return a port at every clock."""
        return self.packing.column(name, self.words)

    def lanes(self, name: str) -> np.ndarray:
        """Return a port that every axis has a part of, by axis and clock."""
        width, signed = self.shapes.get(name, (1, 0))
        sign = 1 << width >> 1 if signed else 0
        column, mask = self.port(name), (1 << width) - 1
        rows = [[(word >> width * number & mask ^ sign) - sign for word in column] for number in range(self.spec.axes)]
        return np.array(rows, np.int64)


def check_clocks(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check every output of every axis at every clock."""
    for name in {*Outputs._fields, "commit_pending"} - {"stamp"}:
        found = seen.lanes(name)
        for number, each in enumerate(lanes):
            wanted = each.commit_pending if name == "commit_pending" else getattr(each.outputs, name)
            wrong = np.flatnonzero(found[number] != wanted)
            assert not len(wrong), f"{name} of axis {number}: {len(wrong)} clocks differ, first clock {wrong[:1]}"
    assert seen.port("stamp") == lanes[0].outputs.stamp.tolist()
    ready = seen.port("word_ready")
    assert ready == [int(clock >= spec.clocks_per_sample) for clock in range(len(ready))]


def check_estimates(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check the velocity of every sample, its clock, its count, and whether the estimator was saturated."""
    velocity, saturated = np.array(seen.port("velocity")), np.array(seen.port("saturated"))
    count = np.array(seen.port("estimated_count"))
    for number, estimated in enumerate(seen.lanes("estimated")):
        came = np.flatnonzero(estimated)
        first = number + axes.FRONT_LATENCY + spec.pipeline.latency
        assert came.tolist() == list(range(first, len(velocity), spec.clocks_per_sample))
        samples = lanes[number].samples
        assert (velocity[came] == samples.velocity[: len(came)]).all()
        assert (count[came] == samples.count[: len(came)]).all()
        assert (saturated[came] == (samples.raised[: len(came)] >> len(ENCODER_FLAGS) != 0)).all()


def check_strobes(spec: AxesSpec, seen: Seen) -> None:
    """Check which axis is sampled at every clock."""
    rota = [clock % spec.clocks_per_sample for clock in range(len(seen.words))]
    assert seen.port("strobe") == [int(place < spec.axes) for place in rota]
    assert all(axis == place for axis, place in zip(seen.port("strobe_axis"), rota, strict=True) if place < spec.axes)


def check_records(spec: AxesSpec, lanes: list[Lane], seen: Seen) -> None:
    """Check the records of all samples, and that none is missing."""
    came = np.flatnonzero(seen.port("record_valid")).tolist()
    ended = [0] * spec.axes
    columns = {name: seen.port(f"record_{name}") for name in ("axis", *RECORD)}
    for clock in came:
        number = columns["axis"][clock]
        k, samples = ended[number], lanes[number].samples
        assert clock == number + k * spec.clocks_per_sample + spec.latency + 1
        record = {name: columns[name][clock] for name in RECORD}
        assert record == {name: int(getattr(samples, name)[k]) for name in RECORD}, f"sample {k} of axis {number}"
        ended[number] += 1
    clocks, first = len(seen.words), spec.latency + 1
    assert ended == [len(range(number + first, clocks, spec.clocks_per_sample)) for number in range(spec.axes)]
    assert min(ended) > clocks // spec.clocks_per_sample // 2


@cocotb.test()
async def every_axis_is_a_single_one(dut):
    spec, random = rota(**parameters()), rng()
    bench = Bench(dut, Axes(spec))
    clocks, rose, drives = max(SAMPLES, REACHING) // 200 * spec.clocks_per_sample, 0, []
    await bench.reset()
    # The second run begins with a reset amid the first.
    for _ in range(2):
        world, seen = World(spec, random), Seen(bench, spec)
        for _ in range(clocks):
            bench.drive(**world.step())
            await RisingEdge(dut.clk)
            seen.words.append(int(dut.bench_seen.value))
        bench.drive(rst=1)
        await RisingEdge(dut.clk)
        bench.drive(rst=0)
        lanes = [world.lane(number) for number in range(spec.axes)]
        check_clocks(spec, lanes, seen)
        check_strobes(spec, seen)
        check_estimates(spec, lanes, seen)
        check_records(spec, lanes, seen)
        assert all(each.committed > 5 for each in lanes)
        rose |= int(np.bitwise_or.reduce([np.bitwise_or.reduce(each.outputs.flags) for each in lanes]))
        drives += [each.outputs.drive for each in lanes]
    # The run must show forces in both directions, both faults of the encoder, a saturated estimator, and both limits.
    assert any((drive > 0).any() for drive in drives)
    assert any((drive < 0).any() for drive in drives)
    assert spec.design.flag_names(rose) == list(spec.design.flags)


@pytest.mark.parametrize(
    ("number", "spare", "estimator"),
    [
        (number, spare, estimator)
        for number, spare in ((1, 0), (3, 2), (16, 0))
        for estimator in axes.PIPELINES
        if LONG or number == 3 or (number, estimator) == (1, "fdm")
    ],
)
def test_rtl(number, spare, estimator):
    simulate(__file__, make, axes=number, estimator=estimator, spare=spare)


def test_rtl_of_a_window_of_which_every_few_samples_are_stored():
    assert rota(2, "window", window_s=0.1).design.estimator.history.every > 1
    simulate(__file__, make, axes=2, estimator="window", window_s=0.1)


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
