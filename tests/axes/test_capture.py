"""The capture memory of several axes: RTL against model at every clock, and what a host finds of one of its axes."""

import random as plain
from collections import Counter
from itertools import pairwise

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axes.capture import AxesCapture
from hardwall.model.axes import capture as axes_capture
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.capture import ROTA_LEAST, Design, Inputs, State, step
from hardwall.model.axes.supervised import LET_OUT
from hardwall.model.axis import capture
from hardwall.model.axis.capture import DONE, FILLING, IDLE, RECORD_REGISTERS, SOURCES, TRIGGERED, WAITING, Record
from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED
from hardwall.testing import SAMPLES, SEED, Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of
from stimuli.specs import MHZ
from stimuli.supervised_axes_world import slow

RECORDS = 8
CLOCKS = max(SAMPLES // 2, 40_000)
"""Fewer clocks do not reach every case."""
TURNED = LET_OUT - 1
"""Clocks from a record to the turn of its sample."""
CONTACT, TRIP, RISE, FALL = (1 << bit for bit in range(len(SOURCES)))
SPECS = {
    "one": lambda: slow(1, "fdm", ROTA_LEAST - 4),
    "least": lambda: slow(3, "fdm", ROTA_LEAST - 4),
    "mhz": lambda: AxesSpec(**MHZ, axes=5, estimator="levant"),
}
"""Axes with the shortest rota that there may be, of narrow words, and some with the usual ones."""


def design_of(name: str) -> Design:
    return Design(SPECS[name](), RECORDS)


def make(name: str) -> Recorded:
    return Recorded(AxesCapture(design_of(name)))


class World:
    """What is at the inputs at every clock: samples and turns of axes in their rota, and a host.

    What is not valid is anything, and at times what is valid comes when it would not.

    Args:
        design: the memory's.
        seed: draws everything.
    """

    def __init__(self, design: Design, seed: int):
        self.design, self.random, self.clock = design, plain.Random(seed), 0
        self.axes, self.rota = design.spec.axes, design.spec.clocks_per_sample
        self.counts, self.forces = [0] * self.axes, [0] * self.axes
        self.width = AxesCapture.members(design)["magnitude"].shape.elem_shape.width
        self.magnitude = self.negative = self.stamp = 0
        self.live, self.pulsed = 1, False
        self.words = {word.name: word.reset for word in design.words}

    def _value(self, fmt) -> int:
        return self.random.choice((fmt.min, fmt.max, 0, -1, self.random.randint(fmt.min, fmt.max)))

    def _choose(self, starts: bool) -> None:
        """Change some words of the host, which may start a capture."""
        random, words, most = self.random, self.words, self.design.records - 1
        drawn = {
            "capture_axis": random.randrange(self.axes),
            "capture_sources": random.choice((0, CONTACT, TRIP, RISE, FALL, random.randrange(16))),
            "capture_level": random.choice((0, self.counts[words["capture_axis"]], self._value(self.design.count))),
            "capture_before": random.choice((0, 1, most, random.randint(0, most))),
        }
        words.update({name: word for name, word in drawn.items() if random.random() < 0.6})
        # A record that is many samples away would never come.
        words["capture_decimation"] = random.choice((1, random.randint(1, 3 if starts else 4095)))

    def _record(self) -> dict[str, int]:
        """Return what the axes show of a sample."""
        random, design, axis = self.random, self.design, self.clock % self.rota
        valid = axis < self.axes
        if random.random() < 0.01:
            valid = not valid
        axis = axis if axis < self.axes else random.randrange(self.axes)
        if valid:
            count = self.counts[axis] + random.choice((-1, 0, 1))
            count = count if random.random() < 0.9 else self._value(design.count)
            self.counts[axis] = min(max(count, design.count.min), design.count.max)
            self.forces[axis] = random.choice((0, self.forces[axis], self._value(design.force)))
        shown = valid or random.random() < 0.5
        return {
            "record_valid": int(valid),
            "record_axis": axis,
            "record_count": self.counts[axis] if shown else self._value(design.count),
            "record_wall_force": self.forces[axis] if shown else self._value(design.force),
            "record_velocity": self._value(design.spec.design.estimator.velocity),
            "record_flags": random.getrandbits(len(design.spec.design.flags)),
        }

    def _turn(self) -> dict[str, int]:
        """Return what the axes show of a turn, and the drives that are let out, of which any may become 0 at once."""
        random, axis = self.random, (self.clock - TURNED) % self.rota
        valid = axis < self.axes
        if random.random() < 0.01:
            valid = not valid
        axis = axis if axis < self.axes else random.randrange(self.axes)
        mask = (1 << self.width) - 1
        for other in {axis} if valid else {random.randrange(self.axes)} if random.random() < 0.1 else ():
            word = random.choice((0, mask, random.getrandbits(self.width))) if valid else 0
            self.magnitude = self.magnitude & ~(mask << self.width * other) | word << self.width * other
            self.negative = self.negative & ~(1 << other) | random.getrandbits(1) << other
        state = random.choice((DISARMED, TRIPPED)) if random.random() < 0.1 else ARMED
        turn = {"turn_valid": int(valid), "turn_axis": axis, "turn_state": state}
        return turn | {"magnitude": self.magnitude, "negative": self.negative}

    def act(self, state: int) -> dict[str, int]:
        """Return the inputs at the next clock, for a capture in a state."""
        random, samples = self.random, 1 / self.rota
        self.clock += 1
        pulses = {"capture_start": 0, "capture_trigger": 0}
        starts = {IDLE: 0.1, DONE: 0.2, WAITING: 0.02}.get(state, 0.01) * samples
        if random.random() < starts:
            self._choose(True)
            pulses["capture_start"] = 1
        if random.random() < (0.4 if pulses["capture_start"] else 0.03 * samples):
            pulses["capture_trigger"] = 1
        if random.random() < 0.02 * samples:
            # What a host writes meanwhile is taken by the next start, the axis among it.
            self._choose(state not in (IDLE, DONE))
        width = self.design.spec.stamp_width
        self.stamp = random.getrandbits(width) if random.random() < 0.01 else (self.stamp + 1) % (1 << width)
        self.live ^= int(random.random() < 0.01)
        address = random.randrange(RECORD_REGISTERS * self.design.records)
        given = {**self._record(), **self._turn(), **self.words, **pulses, "live": self.live, "stamp": self.stamp}
        # What is on its way is lost.
        resets, self.pulsed = 0.1 if self.pulsed else 0.0003, any(pulses.values()) or random.random() < samples / 10
        return given | {"capture_address": address, "reset": int(random.random() < resets)}


def inputs_of(design: Design, width: int, given: dict[str, int]) -> Inputs:
    """Return the inputs of the twin from those of the hardware, whose magnitudes have so many bits each."""
    mask = (1 << width) - 1
    magnitudes = [given["magnitude"] >> width * axis & mask for axis in range(design.spec.axes)]
    driven = tuple(-word if given["negative"] >> axis & 1 else word for axis, word in enumerate(magnitudes))
    return Inputs(**{name: given[name] for name in Inputs._fields if name != "driven"}, driven=driven)


def after(design: Design, memory: np.ndarray, state: State, inputs: Inputs, reset: int) -> State:
    """Return the state after an edge; a reset leaves the memory as it is, and where in it the next record is."""
    now = step(design, memory, state, inputs)
    if not reset:
        return now
    kept = now.captured
    return design.start._replace(captured=capture.START._replace(data=kept.data, ring=kept.ring, upper=kept.upper))


WAYS = {
    *((IDLE, FILLING), (FILLING, WAITING), (FILLING, TRIGGERED), (WAITING, TRIGGERED), (TRIGGERED, DONE)),
    *((DONE, FILLING), (DONE, TRIGGERED), (TRIGGERED, FILLING)),
}
"""Changes of the state that must happen."""


def campaign(design: Design, clocks: int, seed: int = SEED) -> tuple[dict[str, np.ndarray], Counter]:
    """Return the inputs at every clock, how often every change of the state happened, and what axes were captured."""
    world, state, memory, rows, happened = World(design, seed), design.start, design.memory(), [], Counter()
    for _ in range(clocks):
        given = world.act(state.captured.capture_state)
        rows.append(given)
        before, inputs = state, inputs_of(design, world.width, given)
        state = after(design, memory, state, inputs, given["reset"])
        was, now = before.captured.capture_state, state.captured.capture_state
        if was != now and not given["reset"]:
            happened[was, now] += 1
            happened["done", state.axis] += now == DONE
        happened["moved"] += state.axis != given["capture_axis"] and now == TRIGGERED
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, happened


@cocotb.test()
async def follows_model(dut):
    recorded = make(**parameters())
    design = recorded.component.design
    stimuli, happened = campaign(design, CLOCKS)
    inputs, outputs = await play(dut, recorded, stimuli)
    width = recorded.stimuli.shapes["magnitude"].width // design.spec.axes
    state, memory, expected, known = design.start, design.memory(), [], False
    for row in inputs.rows:
        given = dict(zip(inputs.names, row, strict=True))
        known |= state.captured.capture_state == DONE
        state = after(design, memory, state, inputs_of(design, width, given), given["reset"])
        # What the memory shows before its first read is left open.
        shown = state.captured
        expected.append((shown.data if known else None, *shown[1:4], int(shown.capture_state == DONE)))
    names = ("capture_data", "capture_state", "capture_place", "capture_stamp", "capture_done")
    columns = dict(zip(names, map(list, zip(*expected, strict=True)), strict=True))
    first = next(k for k, data in enumerate(columns["capture_data"]) if data is not None)
    columns["capture_data"][:first] = outputs.column("capture_data")[:first]
    check(inputs, outputs, columns)
    assert len(expected) - first > len(expected) // 2
    assert {way for way in WAYS if not happened[way]} == set()
    assert all(happened["done", axis] for axis in range(design.spec.axes))
    assert happened["moved"] or design.spec.axes == 1


@pytest.mark.parametrize("name", some_of(SPECS, 1))
def test_rtl(name):
    simulate(__file__, make, name=name)


class Axes:
    """Axes and their capture memory in the model alone, whose samples have numbers of which all that is shown is made.

    Args:
        axes: the number of axes.
        rota: the clocks of a rota, fewer than there may be if that is wanted.
    """

    def __init__(self, axes: int, rota: int = ROTA_LEAST, **words: int):
        self.design, self.rota = Design(slow(axes, "fdm", max(ROTA_LEAST, axes) - max(4, axes)), RECORDS), rota
        self.state, self.memory, self.clock, self.axes = self.design.start, self.design.memory(), 0, axes
        self.words = {"capture_decimation": 1, **words}
        self.tripped: set[int] = set()
        self.driven = [0] * axes

    def clocks(self, count: int, **pulses: int) -> None:
        """Let clocks pass, the first of them with pulses."""
        for _ in range(count):
            (number, axis), (turned, of_turn) = (divmod(self.clock - late, self.rota) for late in (0, TURNED))
            shown = self.shown(axis, number)
            if turns := of_turn < self.axes and turned >= 0:
                self.driven[of_turn] = self.shown(of_turn, turned).driven
            inputs = Inputs(
                record_valid=int(axis < self.axes), record_axis=axis, record_count=shown.count,
                record_velocity=shown.velocity, record_flags=shown.flags >> 4, record_wall_force=shown.flags >> 2 & 1,
                turn_valid=int(turns), turn_axis=of_turn % self.axes, driven=tuple(self.driven), stamp=self.clock,
                turn_state=TRIPPED if of_turn in self.tripped else ARMED, **{**self.words, **pulses},
            )  # fmt: skip
            self.state = step(self.design, self.memory, self.state, inputs)
            self.clock, pulses = self.clock + 1, {}

    def shown(self, axis: int, number: int) -> Record:
        """Return what the record of a sample must be, but for its stamp; only samples of odd numbers touch the wall."""
        velocity = self.design.velocity.max - number % 4
        state = TRIPPED if axis in self.tripped else ARMED
        flags = state | number % 2 << 2 | number % 8 << 4
        return Record(100 * axis + number % 100, velocity, number % 7 - 3 * axis, flags, 0)

    def take(self, samples: int) -> None:
        self.clocks(self.rota * samples)

    def records(self) -> list[Record]:
        """Return what a host reads."""
        assert self.state.captured.capture_state == DONE
        cells = np.roll(self.memory, -self.state.captured.ring, axis=0).tolist()
        return [self.design.record(tuple(registers)) for registers in cells]

    def whole(self, axis: int, record: Record) -> bool:
        """Return whether all of a record is of the sample of an axis whose count it has."""
        number = record.count - 100 * axis
        # The axes show it `axis` clocks behind the beginning of its rota.
        stamp = axis + self.rota * number + axes_capture.SAMPLED + capture.TAKEN_AT["flags"]
        return record == self.shown(axis, number)._replace(stamp=stamp)

    def numbers(self, axis: int) -> list[int]:
        """Return the numbers of the samples of an axis that were captured, each whole."""
        assert all(self.whole(axis, record) for record in self.records())
        return [record.count - 100 * axis for record in self.records()]


@pytest.mark.parametrize("decimation", [1, 3])
@pytest.mark.parametrize("axes", [1, 2, 9])
def test_every_record_is_of_one_sample_of_the_axis_that_was_taken(axes, decimation):
    for axis in range(axes):
        found = Axes(axes, capture_axis=axis, capture_decimation=decimation, capture_before=3)
        found.take(5)
        found.clocks(1, capture_start=1)
        # What the word says afterwards has no effect.
        found.words["capture_axis"] = axes - 1 - axis
        found.take(5 * decimation)
        found.clocks(1, capture_trigger=1)
        found.take((RECORDS + 1) * decimation)
        numbers = found.numbers(axis)
        assert {behind - before for before, behind in pairwise(numbers)} == {decimation}
        assert found.state.captured.capture_place == 3


def test_one_clock_less_would_be_too_few():
    for rota in (ROTA_LEAST, ROTA_LEAST - 1):
        found = Axes(1, rota)
        found.clocks(1, capture_start=1, capture_trigger=1)
        found.take(2 * RECORDS + 2)
        assert all(found.whole(0, record) for record in found.records()) == (rota == ROTA_LEAST)


@pytest.mark.parametrize("late", range(2 * ROTA_LEAST))
def test_a_start_leaves_nothing_of_the_axis_before(late):
    found = Axes(2, capture_axis=0)
    found.clocks(1, capture_start=1, capture_trigger=1)
    found.take(RECORDS + 4)
    found.numbers(0)
    found.clocks(late)
    found.words["capture_axis"] = 1
    begun = found.clock
    found.clocks(1, capture_start=1, capture_trigger=1)
    found.take(RECORDS + 2)
    numbers = found.numbers(1)
    assert [b - a for a, b in pairwise(numbers)] == [1] * (RECORDS - 1)
    # The first sample behind the start.
    assert 0 <= 1 + found.rota * numbers[0] - begun <= found.rota


def test_an_axis_that_is_tripped_when_it_is_taken_is_no_trip():
    found = Axes(2, capture_axis=0, capture_sources=TRIP)
    found.tripped = {1}
    for axis, state in ((0, WAITING), (1, WAITING), (0, WAITING)):
        found.words["capture_axis"] = axis
        found.clocks(1, capture_start=1)
        found.take(3)
        assert found.state.captured.capture_state == state
    # That of the other one is none either, and its own is.
    found.tripped = set()
    found.take(2)
    found.tripped = {1}
    found.take(2)
    assert found.state.captured.capture_state == WAITING
    found.tripped = {0}
    found.take(2)
    assert found.state.captured.capture_state == TRIGGERED


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"^design must be a capture.Design, not 3$"):
        AxesCapture(3)
    with pytest.raises(ValueError, match=r"^records must be a power of two, not 12$"):
        Design(slow(2, "fdm", 5), 12)
    with pytest.raises(ValueError, match=r"^sample_hz must leave 9 clocks .*, so at most 888 at .* 8000, not 1000$"):
        Design(slow(2, "fdm", 4), RECORDS)
