"""A ring of records of an axis, one a sample, that freezes behind a trigger; twin of `hardwall.hdl.axis.capture`.

A record has 8 registers of 16 bits: three values of 32 bits with the formats of the status of the same names, each the
high register first, and two single registers.

    0, 1  count     the count that the sample took
    2, 3  velocity  the velocity estimated from it; or the acceleration, with the word `capture_acceleration`
    4, 5  driven    the drive that the supervisor lets out for it
    6     flags     bits as in `Design.flags`
    7     stamp     the low bits of the number of the clock at which the flags were taken, `Design.stamp_clocks`
                    behind the sample

The registers are written by one a clock, and a value as it is when its low register is: no value is torn. They are
in the order of time when they are read: the window begins with the oldest record, wherever in the ring that is.

The states; all but the first and the last take a record of every `capture_decimation`-th sample:

    IDLE       until the first start
    FILLING    fewer records are kept than are wanted before the trigger
    WAITING    as many as are wanted are kept, the last ones
    TRIGGERED  all records are kept until the ring is full
    DONE       the ring is full, and frozen until the next start

A trigger is taken in FILLING too, so that an early one is not lost: then fewer records are before it, and more behind
it. When the capture is DONE every record of the ring belongs to it, `capture_place` of them before the trigger. The
record at that place is the one taken at the trigger, or else the next.

The triggers are the host's `capture_trigger`, and the `SOURCES` whose bits are set in `capture_sources`. A trip counts
at its clock. The other triggers are found by comparing one sample with the next. Both samples come after the start;
count, force and level are taken a clock before a sample's changed drive. What comes with the start belongs to the new
capture. Samples that follow each other too closely are refused: a value would be the next sample's before it is
written.
"""

from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import SQ, UQ
from ..checks import FieldError, check_int
from ..estimators.acceleration import Accelerated
from ..register import Kind, Register, narrowed, word_register
from ..runtime.compiled import compiled
from ..words import Word
from .designed import DesignedAxis
from .supervisor import TRIPPED

RECORD_REGISTERS = 8
REGISTER_BITS = 16
RECORDS_MAX = 4096
"""The records that the window has room for."""
RECORDS = 2048
"""The records of a board, unless it is told otherwise: 16 K registers, which are a single memory of an iCE40UP5K."""
IDLE, FILLING, WAITING, TRIGGERED, DONE = range(5)
STATES = ("IDLE", "FILLING", "WAITING", "TRIGGERED", "DONE")
SOURCES = ("contact", "trip", "rise", "fall")
"""The triggers: the wall's force becomes non-zero, the supervisor trips, the count passes the level up, or down."""
STATE_FLAGS = ("armed", "tripped", "contact", "live")
"""The lowest flags of a record: the state of the supervisor, a force of the wall, a heartbeat that is not overdue."""
DECIMATION_BITS = 12
TAKEN_AT = {"count": 0, "velocity": 2, "driven": 4, "flags": 6}
"""Clocks from the changed drive to the clock at which a record's value is taken and its low register written."""


class Params(NamedTuple):
    """The constants of a design: the records of the ring."""

    records: int


class Inputs(NamedTuple):
    """The inputs of the hardware just before a clock edge, by the same names."""

    sampled: int = 0
    count: int = 0  # type: ignore[assignment]  # a tuple has a method of this name
    velocity: int = 0
    acceleration: int = 0
    driven: int = 0
    wall_force: int = 0
    state: int = 0
    live: int = 0
    flags: int = 0
    stamp: int = 0
    address: int = 0
    capture_start: int = 0
    capture_trigger: int = 0
    capture_sources: int = 0
    capture_level: int = 0
    capture_before: int = 0
    capture_decimation: int = 1
    capture_acceleration: int = 0


class State(NamedTuple):
    """Every register; the first four are also outputs of the hardware, by the same names."""

    data: int  # the register that was read at the last clock while the capture was done
    capture_state: int
    capture_place: int  # records before the trigger
    capture_stamp: int  # the number of the trigger's clock
    kept: int  # records that will not be overwritten before the capture is done
    ring: int  # the place of the record that is being written, or of the next
    step: int  # registers of it that are written
    upper: int  # the high register of the value whose low one is written
    left: int  # samples until the next record; it is due at 1 or 0
    seen: int  # a sample has come since the start
    contact: int  # at the last clock the wall had a force
    below: int  # at the last clock the count was less than the level
    was_in_contact: int  # the same of the clock before the last sample
    was_below: int
    tripped: int  # at the last clock the supervisor was TRIPPED


START = State(*(0 for _ in State._fields))


class Record(NamedTuple):
    """The words of a record."""

    count: int  # type: ignore[assignment]
    velocity: int  # or the acceleration
    driven: int
    flags: int
    stamp: int


class Design:
    """Formats and run-time words of the capture memory of an axis.

    Args:
        spec: the axis, alone or one of several.
        records: records of the ring, a power of two.

    Attributes:
        spec, records: as given.
        params: for `step`.
        count, velocity, force: the formats of a record's values.
        acceleration: the format of an acceleration in place of the velocity; None for an estimator without one.
        flags: names of a record's flags, bit 0 first.
        stamp_clocks: clocks from a sample to the stamp of its record.
        words: run-time words; all act at the next clock.
        ranges: the least and the largest value of a word whose range is smaller than its format's; None: the format's.

    Raises:
        TypeError: if `records` is not an int.
        ValueError: if there cannot be so many records, or the samples follow each other too closely.
    """

    def __init__(self, spec: DesignedAxis, records: int):
        check_int("records", records, 2, RECORDS_MAX)
        if records & (records - 1):
            raise ValueError(f"records must be a power of two, not {records}")
        self.spec, self.records, self.params = spec, records, Params(records)
        fewest = self.fewest_clocks
        if spec.clocks_per_sample < fewest:
            raise FieldError(
                "sample_hz",
                f"must leave {fewest} clocks for a sample that is captured, so at most {spec.clock_hz // fewest} at "
                f"clock_hz {spec.clock_hz}, not {spec.sample_hz!r}",
            )
        self.count, self.force = SQ(spec.count_width, 0), spec.force
        self.velocity = narrowed(spec.design.estimator.velocity)
        estimator = spec.design.estimator
        self.acceleration = estimator.acceleration if isinstance(estimator, Accelerated) else None
        self.flags = (*STATE_FLAGS, *spec.design.flags)
        self.stamp_clocks = self.sampled_clocks + TAKEN_AT["flags"]
        sources = ", ".join(f"bit {bit} {name}" for bit, name in enumerate(SOURCES))
        self.place = UQ((records - 1).bit_length(), 0)
        self.words: tuple[Word, ...] = (
            Word("capture_sources", UQ(len(SOURCES), 0), 1.0, "", 0, f"what triggers a capture: {sources}"),
            Word("capture_level", self.count, spec.count_m, "m", 0, "level of the count whose passing triggers"),
            Word("capture_before", self.place, 1.0, "", 0, "records that are wanted before the trigger"),
            Word("capture_decimation", UQ(DECIMATION_BITS, 0), 1.0, "", 1, "samples from a record to the next", 1),
        )
        if self.acceleration:
            doc = "1: records have the acceleration in place of the velocity"
            self.words = (*self.words, Word("capture_acceleration", UQ(1, 0), 1.0, "", 0, doc))

    @property
    def sampled_clocks(self) -> int:
        """Clocks from a sample to the clock of its changed drive, at which the memory takes it."""
        return self.spec.design.latency_to_drive

    @property
    def fewest_clocks(self) -> int:
        """The fewest clocks from a sample to the next with which all values of a record are of one sample."""
        axis = self.spec.design
        # The next velocity comes before the next drive, and the next force of the wall in between.
        behind = axis.latency_to_drive - axis.estimator.latency
        # The ring is frozen a clock behind its last record, before another begins.
        return max(behind + TAKEN_AT["velocity"] + 1, axis.force_to_drive + TAKEN_AT["flags"] + 1, RECORD_REGISTERS + 1)

    def registers(self) -> tuple[Register, ...]:
        """Return the host's registers of the capture memory, status and pulses, without its window."""
        states = ", ".join(f"{number} {name}" for number, name in enumerate(STATES))
        stamp = UQ(self.spec.stamp_width, 0)
        pulses = (
            ("capture_start", "A capture begins, whatever was before; its memory cannot be read until it is done."),
            ("capture_trigger", "A capture that waits for its trigger is triggered."),
        )
        return (
            Register("capture_state", Kind.STATUS, UQ(3, 0), f"The state of the capture: {states}."),
            Register("capture_place", Kind.STATUS, self.place, "The number of records before the trigger."),
            Register(
                "capture_stamp",
                Kind.STATUS,
                stamp,
                "The number of the clock of the capture's trigger.",
                1 / self.spec.clock_hz,
                "s",
            ),
            *(Register(name, Kind.PULSE, UQ(1, 0), meaning) for name, meaning in pulses),
            *(word_register(word, Kind.LIVE) for word in self.words),
        )

    def memory(self) -> np.ndarray:
        """Return the ring of a capture that has not begun, shape (records, 8), int64."""
        return np.zeros((self.records, RECORD_REGISTERS), np.int64)

    def record(self, registers: tuple[int, ...]) -> Record:
        """Return the record that 8 registers of the window hold.

        Raises:
            ValueError: if there are more or fewer registers.
        """
        if len(registers) != RECORD_REGISTERS:
            raise ValueError(f"registers must be {RECORD_REGISTERS}, not {len(registers)}")
        halves = np.array(registers, np.uint16).reshape(-1, 2)
        values = (halves[:3, 0].astype(np.int64) << REGISTER_BITS | halves[:3, 1]).astype(np.int32).tolist()
        return Record(*values, *halves[3].tolist())


@compiled
def _value(inputs, pair):
    """Return the high and the low register of a value of a record, by its place in it."""
    top = (1 << REGISTER_BITS) - 1
    if pair == 3:
        contact = int(inputs.wall_force != 0)
        flags = inputs.state | contact << 2 | inputs.live << 3 | inputs.flags << 4
        return flags, inputs.stamp & top
    motion = inputs.acceleration if inputs.capture_acceleration else inputs.velocity
    value = inputs.count if pair == 0 else motion if pair == 1 else inputs.driven
    return value >> REGISTER_BITS & top, value & top


@compiled
def _triggered(state, inputs):
    """Return whether a trigger comes at this clock."""
    sources = inputs.capture_sources
    trips = inputs.state == TRIPPED and not state.tripped
    if inputs.capture_trigger or (sources & 2 and trips):
        return True
    if not inputs.sampled or not state.seen or inputs.capture_start:
        return False
    touches = state.contact and not state.was_in_contact
    rises, falls = state.was_below and not state.below, state.below and not state.was_below
    return bool((sources & 1 and touches) or (sources & 4 and rises) or (sources & 8 and falls))


@compiled
def _recorded(params, memory, state, inputs):
    """Write the register of a record that is due; return the number written, the waiting upper half, and the data.

    The data change where the capture is done, with every clock.
    """
    running, done = FILLING <= state.capture_state <= TRIGGERED, state.capture_state == DONE
    taken, ring, data = state.step, state.ring, state.data
    if done:
        record = (inputs.address // RECORD_REGISTERS + ring) % params.records
        data = memory[record, inputs.address % RECORD_REGISTERS]
    if not taken and not (inputs.sampled and running and state.left <= 1 and not inputs.capture_start):
        return 0, state.upper, data
    high, low = _value(inputs, taken >> 1)
    if not done:
        memory[ring, taken ^ 1] = state.upper if taken & 1 else low
    return taken + 1, state.upper if taken & 1 else high, data


@compiled
def step(params, memory, state, inputs):
    """Return the state after one clock edge, and write to the memory.

    Args:
        params: the `params` of a `Design`.
        memory: the ring, as from `Design.memory`; changed.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    now, start, sampled = state.capture_state, inputs.capture_start, inputs.sampled
    trigger = _triggered(state, inputs)
    taken, upper, data = _recorded(params, memory, state, inputs)
    ended = taken == RECORD_REGISTERS
    kept = state.kept + int(ended and (now != WAITING or trigger))
    left = state.left
    if sampled:
        left = inputs.capture_decimation if left <= 1 else left - 1

    place, stamp = state.capture_place, state.capture_stamp
    if trigger and (start or now in (FILLING, WAITING)):
        now, place, stamp = TRIGGERED, state.kept, inputs.stamp
    elif start:
        now = FILLING
    elif now == FILLING and state.kept >= inputs.capture_before:
        now = WAITING
    elif now == TRIGGERED and state.kept == params.records:
        now = DONE
    return State(
        data=data,
        capture_state=now,
        capture_place=0 if start else place,
        capture_stamp=stamp,
        kept=0 if start else kept,
        ring=(state.ring + int(ended)) % params.records,
        step=0 if start or ended else taken,
        upper=upper,
        left=0 if start else left,
        seen=int((state.seen or sampled) and not start),
        contact=int(inputs.wall_force != 0),
        below=int(inputs.count < inputs.capture_level),
        was_in_contact=state.contact if sampled else state.was_in_contact,
        was_below=state.below if sampled else state.was_below,
        tripped=int(inputs.state == TRIPPED),
    )
