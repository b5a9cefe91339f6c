"""The capture memory: RTL against model at every clock, and the promises about what a host finds in it."""

import dataclasses
import random as plain
from collections import Counter
from contextlib import suppress
from itertools import count, pairwise, product

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axis.capture import Capture
from hardwall.hdl.export import to_verilog
from hardwall.model.axis import capture
from hardwall.model.axis.capture import (
    DONE,
    FILLING,
    IDLE,
    RECORD_REGISTERS,
    SOURCES,
    START,
    TRIGGERED,
    WAITING,
    Design,
    Inputs,
    Record,
)
from hardwall.model.axis.supervisor import ARMED, DISARMED, TRIPPED
from hardwall.model.checks import FieldError
from hardwall.testing import SAMPLES, SEED, Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of
from stimuli.specs import spec

RECORDS = 8
CLOCKS = max(SAMPLES // 2, 40_000)
"""Fewer clocks do not reach every case."""
CONTACT, TRIP, RISE, FALL = (1 << bit for bit in range(len(SOURCES)))


def design_of(name: str, estimator: str, records: int = RECORDS) -> Design:
    return Design(spec(name, estimator), records)


def names_of(design: Design) -> list[str]:
    """Return the inputs that the hardware has: those of an acceleration only with an estimator that has one."""
    return [name for name in Inputs._fields if design.acceleration or "acceleration" not in name]


def make(name: str, estimator: str) -> Recorded:
    return Recorded(Capture(design_of(name, estimator)))


class World:
    """What is at the inputs of a capture memory at every clock: an axis and a host.

    An axis has 11 clocks or more a sample. Some samples come sooner, for the memory to do what its twin does even then.

    Args:
        design: the memory's.
        seed: draws everything.
    """

    def __init__(self, design: Design, seed: int):
        self.design, self.random = design, plain.Random(seed)
        self.until = 0
        self.held = dict.fromkeys(names_of(design), 0) | {"capture_decimation": 1}

    def _value(self, fmt) -> int:
        return self.random.choice((fmt.min, fmt.max, 0, -1, self.random.randint(fmt.min, fmt.max)))

    def _words(self) -> None:
        """Change some words of the host."""
        random, held, most = self.random, self.held, self.design.records - 1
        if random.random() < 0.5:
            held["capture_sources"] = random.choice((0, CONTACT, TRIP, RISE, FALL, random.randrange(16)))
        if random.random() < 0.5:
            held["capture_level"] = random.choice((held["count"], held["count"] + 1, self._value(self.design.count)))
            held["capture_level"] = min(held["capture_level"], self.design.count.max)
        if random.random() < 0.5:
            held["capture_before"] = random.choice((0, 1, most, random.randint(0, most)))
        if self.design.acceleration:
            held["capture_acceleration"] = random.getrandbits(1)
        if random.random() < 0.3:
            held["capture_decimation"] = random.choice((1, 1, 2, random.randint(1, 5), random.randint(6, 255), 4095))
        elif held["capture_decimation"] > 5:
            held["capture_decimation"] = 1

    def act(self, state: int) -> dict[str, int]:
        """Return the inputs at the next clock, for a capture in a state."""
        random, held, design = self.random, self.held, self.design
        self.until -= 1
        held["sampled"] = int(self.until <= 0)
        if held["sampled"]:
            self.until = random.choice((11, 11, 12, random.randint(11, 60)))
            if random.random() < 0.2:
                self.until = random.choice((RECORD_REGISTERS, random.randint(1, RECORD_REGISTERS)))
            # Else a record that is many samples away would never come.
            if held["capture_decimation"] > 5 and random.random() < 0.9:
                self.until = 1
            held["velocity"] = self._value(design.velocity)
            if design.acceleration:
                held["acceleration"] = self._value(design.acceleration)
            held["flags"] = random.getrandbits(len(design.spec.design.flags))
        if self.until == random.choice((1, 1, 1, 3)):
            count = held["count"] + random.choice((-1, 0, 1))
            held["count"] = count if random.random() < 0.9 else self._value(design.count)
            held["count"] = min(max(held["count"], design.count.min), design.count.max)
            held["wall_force"] = random.choice((0, held["wall_force"], self._value(design.force)))
        if random.random() < 0.02:
            held["state"] = random.choice((DISARMED, ARMED, TRIPPED))
            held["live"] = random.getrandbits(1)
        if random.random() < 0.2:
            held["driven"] = self._value(design.force)
        # One act in the time of some records, and reads where there is something to read.
        pulses = {"capture_start": 0, "capture_trigger": 0}
        if random.random() < {IDLE: 0.01, DONE: 0.01, WAITING: 0.002}.get(state, 0.0005):
            self._words()
            pulses["capture_start"] = 1
        if random.random() < (0.4 if pulses["capture_start"] else 0.0015):
            pulses["capture_trigger"] = 1
        if random.random() < 0.0005:
            self._words()
        width = design.spec.stamp_width
        held["stamp"] = random.getrandbits(width) if random.random() < 0.01 else (held["stamp"] + 1) % (1 << width)
        held["address"] = random.randrange(RECORD_REGISTERS * design.records)
        return {**held, **pulses, "reset": int(random.random() < 0.0006)}


WAYS = {
    *(
        (IDLE, FILLING, 1),
        (FILLING, WAITING, 0),
        (FILLING, TRIGGERED, 0),
        (WAITING, TRIGGERED, 0),
        (TRIGGERED, DONE, 0),
    ),
    *((IDLE, TRIGGERED, 1), (DONE, FILLING, 1), (DONE, TRIGGERED, 1), (WAITING, FILLING, 1), (TRIGGERED, FILLING, 1)),
    *("wraps", "early"),
}
"""What must happen: changes of the state, each with whether there was a start, and other things."""


def campaign(design: Design, clocks: int, seed: int = SEED) -> tuple[dict[str, np.ndarray], Counter]:
    """Return the inputs at every clock, and how often every change of the state and other things happened."""
    world, state, memory, rows, happened = World(design, seed), START, design.memory(), [], Counter()
    for _ in range(clocks):
        given = world.act(state.capture_state)
        rows.append(given)
        inputs = Inputs(**{name: given[name] for name in names_of(design)})
        after = capture.step(design.params, memory, state, inputs)
        if after.capture_state != state.capture_state:
            happened[state.capture_state, after.capture_state, given["capture_start"]] += 1
        happened["wraps"] += after.ring < state.ring
        happened["early"] += after.capture_state == DONE and after.capture_place < given["capture_before"]
        state = START._replace(data=after.data, ring=after.ring, upper=after.upper) if given["reset"] else after
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}, happened


OUTPUTS = ("data", "capture_state", "capture_place", "capture_stamp")


@cocotb.test()
async def follows_model(dut):
    recorded = make(**parameters())
    design = recorded.component.design
    stimuli, happened = campaign(design, CLOCKS)
    inputs, outputs = await play(dut, recorded, stimuli)
    state, memory, expected, known = START, design.memory(), [], False
    names = inputs.names
    for row in inputs.rows:
        given = dict(zip(names, row, strict=True))
        read = state.capture_state == DONE
        seen = Inputs(**{name: given[name] for name in names_of(design)})
        state = capture.step(design.params, memory, state, seen)
        if given["reset"]:
            state = START._replace(data=state.data, ring=state.ring, upper=state.upper)
        # What the memory shows before its first read is left open.
        known |= read
        expected.append((state.data if known else None, *state[1:4], int(state.capture_state == DONE)))
    columns = dict(zip((*OUTPUTS, "done"), map(list, zip(*expected, strict=True)), strict=True))
    first = next(k for k, data in enumerate(columns["data"]) if data is not None)
    columns["data"][:first] = outputs.column("data")[:first]
    check(inputs, outputs, columns)
    assert len(expected) - first > len(expected) // 2
    assert {way for way in WAYS if not happened[way]} == set()


SIZES = [("mhz", "levant"), ("mhz", "kalman"), ("wide", "levant-adaptive"), ("narrow", "fdm"), ("paper", "levant-3")]


@pytest.mark.parametrize(("name", "estimator"), some_of(SIZES, 2))
def test_rtl(name, estimator):
    simulate(__file__, make, name=name, estimator=estimator)


class Axis:
    """An axis and its capture memory in the model alone: a sample every 11 clocks, whose number is its count."""

    def __init__(self, records: int = RECORDS, estimator: str = "levant", **words: int):
        self.design, self.state = design_of("mhz", estimator, records), START
        self.memory, self.clock, self.samples = self.design.memory(), 0, 0
        self.words = {"capture_decimation": 1, **words}
        self.shown = {"state": ARMED, "wall_force": 0}

    def clocks(self, count: int, **pulses: int) -> None:
        """Let clocks pass, the first of them with pulses."""
        for _ in range(count):
            sampled = self.clock % 11 == 0
            self.samples += sampled
            values = {"count": self.samples, "velocity": -3 * self.samples, "driven": self.samples << 4}
            values["acceleration"] = 5 - self.samples
            given = {**values, **self.shown, **self.words, **pulses, "sampled": int(sampled), "stamp": self.clock}
            self.state = capture.step(self.design.params, self.memory, self.state, Inputs(**given))
            self.clock, pulses = self.clock + 1, {}

    def take(self, samples: int) -> None:
        self.clocks(11 * samples)

    def records(self) -> list[Record]:
        """Return what a host reads: every register of the window, in its order."""
        assert self.state.capture_state == DONE
        registers = []
        for address in range(RECORD_REGISTERS * self.design.records):
            inputs = Inputs(address=address, **self.words)
            registers.append(int(capture.step(self.design.params, self.memory, self.state, inputs).data))
        grouped = zip(*[iter(registers)] * RECORD_REGISTERS, strict=True)
        return [self.design.record(each) for each in grouped]


@pytest.mark.parametrize("before", [0, 1, 5, RECORDS - 1])
@pytest.mark.parametrize("decimation", [1, 2, 9])
def test_records_are_whole_in_order_and_around_the_trigger(before, decimation):
    axis = Axis(capture_before=before, capture_decimation=decimation)
    axis.take(5)
    axis.clocks(1, capture_start=1)
    axis.take(40 * decimation)
    assert axis.state.capture_state == WAITING
    axis.clocks(3, capture_trigger=1)
    samples, place = axis.samples, axis.state.capture_place
    axis.take(RECORDS * decimation)
    records = axis.records()
    assert place == before
    for record in records:
        assert (record.velocity, record.driven) == (-3 * record.count, record.count << 4)
    assert {after.count - count.count for count, after in pairwise(records)} == {decimation}
    assert {(after.stamp - stamp.stamp) % 65536 for stamp, after in pairwise(records)} == {11 * decimation}
    # The record at the trigger's place was being taken then, or is the first one behind it.
    assert samples <= records[before].count < samples + decimation
    assert axis.state.capture_stamp == axis.clock - 11 * RECORDS * decimation - 3


@pytest.mark.parametrize("accelerations", [0, 1])
def test_records_have_the_acceleration_in_place_of_the_velocity(accelerations):
    axis = Axis(estimator="kalman", capture_acceleration=accelerations)
    axis.clocks(1, capture_start=1, capture_trigger=1)
    axis.take(RECORDS + 1)
    for record in axis.records():
        motion = 5 - record.count if accelerations else -3 * record.count
        assert (record.velocity, record.driven) == (motion, record.count << 4)


def test_a_trigger_before_enough_records_keeps_those_there_are():
    axis = Axis(capture_before=RECORDS - 1)
    axis.clocks(1, capture_start=1)
    axis.take(4)
    axis.clocks(RECORD_REGISTERS)
    assert axis.state.capture_state == FILLING
    axis.words["capture_sources"] = TRIP
    axis.shown["state"] = TRIPPED
    axis.take(RECORDS)
    records = axis.records()
    assert axis.state.capture_place == 4
    assert [record.flags & 3 for record in records] == [ARMED] * 4 + [TRIPPED] * (RECORDS - 4)


@pytest.mark.parametrize(
    ("source", "shown"),
    [(CONTACT, {"wall_force": -1}), (TRIP, {"state": TRIPPED}), (RISE, {"count": 50}), (FALL, {"count": -50})],
)
def test_every_source_triggers_by_a_change_alone(source, shown):
    for sources, there in ((source, 0), (source, 1), (15 - source, 0)):
        axis = Axis(capture_sources=sources, capture_before=2, capture_level=3 if source == RISE else -3)
        axis.shown |= {"count": 0, **(shown if there else {})}
        axis.take(3)
        axis.clocks(1, capture_start=1)
        axis.take(10)
        assert axis.state.capture_state == WAITING
        axis.shown |= shown
        axis.take(3)
        changed = sources == source and not there
        assert axis.state.capture_state == (TRIGGERED if changed else WAITING)


@pytest.mark.parametrize("source", [CONTACT, RISE, FALL])
def test_a_way_past_the_level_is_judged_exactly_at_the_ends_of_every_word(source):
    """Counts, levels and forces are those at the ends of their formats, and about 0, each before each."""
    design, state = design_of("narrow", "fdm"), START

    def ends(fmt) -> tuple[int, ...]:
        return fmt.min, fmt.min + 1, -1, 0, 1, fmt.max - 1, fmt.max

    counts, forces = ends(design.count), ends(design.force)
    cases = [(level, *way, force, force) for level in counts for way in product(counts, counts) for force in (0, 1)]
    cases += [(0, 5, 5, *two) for two in product(forces, forces)]
    for level, before, after, pushed, pushes in cases:
        memory = design.memory()
        words = {"capture_sources": source, "capture_level": level, "capture_before": 7, "capture_decimation": 1}
        state = capture.step(design.params, memory, state, Inputs(**words, capture_start=1))
        for place, force in ((before, pushed), (before, pushed), (after, pushes)):
            for clock in range(11):
                given = {"count": place, "wall_force": force, "sampled": int(clock == 10)}
                state = capture.step(design.params, memory, state, Inputs(**words, **given))
        passes = {
            RISE: before < level <= after,
            FALL: after < level <= before,
            CONTACT: pushed == 0 != pushes,
        }
        assert (state.capture_state == TRIGGERED) == passes[source], (level, before, after, pushed, pushes)


def test_a_level_that_moves_with_the_start_is_not_passed():
    axis = Axis(capture_sources=RISE | FALL, capture_level=-5)
    axis.shown["count"] = 0
    axis.take(4)
    axis.clocks(1, capture_start=1)
    axis.words["capture_level"] = 5
    axis.take(5)
    assert axis.state.capture_state == WAITING


def test_what_comes_with_the_start_belongs_to_the_new_capture():
    for pulses, shown in (({"capture_trigger": 1}, {}), ({}, {"state": TRIPPED})):
        axis = Axis(capture_sources=TRIP, capture_before=3)
        axis.clocks(1, capture_start=1)
        axis.take(20)
        axis.shown |= shown
        axis.clocks(1, capture_start=1, **pulses)
        assert (axis.state.capture_state, axis.state.capture_place) == (TRIGGERED, 0)
        first = axis.samples + 1
        axis.take(RECORDS + 1)
        assert [record.count for record in axis.records()] == list(range(first, first + RECORDS))


def test_a_start_begins_afresh_whatever_was_before():
    axis = Axis(capture_before=4)
    for clocks in (3, 11 * 2, 11 * 8 + 4, 11 * 40):
        axis.clocks(1, capture_start=1)
        axis.clocks(clocks)
        axis.clocks(1, capture_start=1)
        assert (axis.state.capture_state, axis.state.capture_place, axis.state.kept) == (FILLING, 0, 0)
        first = axis.samples + 1
        axis.clocks(1, capture_trigger=1)
        axis.take(RECORDS + 1)
        assert axis.records()[0].count in (first, first - 1)


def test_a_frozen_ring_stays_as_it_is():
    axis = Axis()
    axis.clocks(1, capture_start=1, capture_trigger=1)
    axis.take(RECORDS + 1)
    records, state = axis.records(), axis.state
    axis.clocks(1, capture_trigger=1)
    axis.shown |= {"state": TRIPPED, "wall_force": 7}
    axis.take(50)
    assert axis.records() == records
    assert axis.state.capture_stamp == state.capture_stamp


def captured(design: Design, apart: int) -> list[Record]:
    """Return the records of an axis with so many clocks from a sample to the next, which overlap: all of sample k is k,
    but its wall has a force if k is odd."""
    memory, state, path = design.memory(), START, design.spec.design
    behind = path.wall.latency + path.force_to_drive
    for clock in range((RECORDS + 4) * apart):
        estimated, walled, drive = ((clock + ahead) // apart for ahead in (behind, path.force_to_drive, -1))
        values = {"count": estimated, "velocity": estimated, "wall_force": walled % 2, "driven": drive}
        begins = int(clock == apart // 2)
        pulses = {"sampled": int(clock % apart == 0), "capture_start": begins, "capture_trigger": begins}
        state = capture.step(design.params, memory, state, Inputs(**values, **pulses, stamp=clock))
    assert state.capture_state == DONE
    return [design.record(tuple(registers)) for registers in np.roll(memory, -state.ring, axis=0).tolist()]


@pytest.mark.parametrize("passive", [False, True])
def test_records_of_samples_that_overlap_are_of_one_sample_each(passive):
    """With the fewest clocks that are not refused; one less would be too few."""
    slow = dataclasses.replace(spec("mhz", "fdm"), passivity=passive)
    for apart in count(slow.design.interval):
        with suppress(FieldError):
            design = Design(dataclasses.replace(slow, clock_hz=apart * slow.sample_hz), RECORDS)
            break
    assert design.spec.design.interval < apart

    def whole(record: Record) -> bool:
        return record.velocity == record.driven == record.count and record.flags >> 2 & 1 == record.count % 2

    records = captured(design, apart)
    assert all(map(whole, records))
    assert {after.count - before.count for before, after in pairwise(records)} == {1}
    records = captured(design, apart - 1)
    assert not all(map(whole, records)) or {b.count - a.count for a, b in pairwise(records)} != {1}


def test_its_verilog_says_nothing_of_first_contents():
    text = to_verilog(Capture(design_of("mhz", "levant", capture.RECORDS)), "capture")
    assert f"  reg [15:0] memory [{RECORD_REGISTERS * capture.RECORDS - 1}:0];\n  always" in text
    assert text.count("memory[") == 2


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"^records must be 2 to 4096, not 8192$"):
        design_of("mhz", "levant", 8192)
    with pytest.raises(ValueError, match=r"^records must be a power of two, not 12$"):
        design_of("mhz", "levant", 12)
    with pytest.raises(TypeError, match=r"not 3$"):
        Capture(3)
    with pytest.raises(ValueError, match=r"^registers must be 8, not 7$"):
        design_of("mhz", "levant").record((0,) * 7)
    # The axis itself takes fewer clocks, and a record as many as these.
    quick = {"clock_hz": 8_000_000, "sample_hz": 1_000_000, "actuation_hz": 1_000_000}
    axis = dataclasses.replace(spec("paper", "fdm"), **quick)
    with pytest.raises(ValueError, match=r"^sample_hz must leave 9 clocks .*, so at most 888888 at .*, not 1000000$"):
        Design(axis, RECORDS)
