"""The registers of an axis, described once: the hardware, the host's map and every text about it are made from here.

Addresses are Modbus addresses: a register has 16 bits. A value of 32 bits has two registers, the high one first, at an
even address; a value that has fewer bits is extended, by its sign if it has one. Pulses and counters have one register.

    0x0000 to 0x001F  constants: what the device is
    0x0020 to 0x003F  telemetry of the axis
    0x0040 to 0x005F  status of the supervisor, and of the capture memory if there is one
    0x0060 to 0x0067  counters of the link, one register each
    0x0070 to 0x007F  pulses, one register each, assigned downwards from 0x007F
    0x0080 to 0x009F  words as written
    0x00A0 to 0x00BF  words as active, each 0x20 above its written one
    0x00C0 to 0x00FF  live words, which act at the next clock
    0x4000 to 0x7FFF  the window to the compressed map, two bytes a register, the first one high; behind the map, the
                      ends of the answers of the identification
    0x8000 to 0xFFFF  the window to the capture memory, eight registers a record, the oldest first

The rule is stable. Within a block registers follow in the order of their description, so an addition at the end of a
block moves nothing. Only the words and the active words move with the estimator. `commit` is the last pulse and ends
where the written words begin: one frame can carry words and their commit.

What is not assigned in the first 256 registers reads 0 and cannot be written.
"""

import dataclasses
import hashlib
import json
import zlib
from collections.abc import Iterable, Sequence
from typing import ClassVar

from ..arithmetic.fixed import SQ, UQ, Format
from ..checks import check_int, shown
from ..estimators.acceleration import Accelerated
from ..register import COUNTER_BITS, VALUE_BITS, Kind, Register, narrowed, word_register
from ..spec import AxisSpec
from ..words import Word
from . import capture
from .design import ILLEGAL_WIDTH
from .designed import DesignedAxis
from .supervised import Design

LAYOUT = 1
"""The version of the rule above, the first constant: a host that does not know it must stop."""
CONSTANTS, TELEMETRY, SUPERVISOR, COUNTERS, PULSES, WRITTEN, ACTIVE, LIVE = 0, 0x20, 0x40, 0x60, 0x70, 0x80, 0xA0, 0xC0
"""The first address of every block."""
END = 0x100
"""The address behind the last block."""
MAP, CAPTURE, SPACE = 0x4000, 0x8000, 0x10000
"""The first address of each window, and the address behind the last."""
CAPTURE_REGISTERS = capture.RECORD_REGISTERS * capture.RECORDS
"""The registers of the capture memory of a board, unless it is told otherwise."""
EDGE_STAMPS = ("stamp_a_rise", "stamp_b_rise", "stamp_a_fall", "stamp_b_fall")
"""The stamps of edges, in the order of the edges' kinds."""
COUNTS = "counts_"
"""How the names of the status begin that count the causes."""
EVENTS = ("illegal_count", "index_count", "latched", "first", "first_stamp")
"""The other status that only events change."""
CONFORMITY = 0x81
"""The identification is basic, and can be had as a stream or object by object."""


def _telemetry(spec: DesignedAxis) -> tuple[Register, ...]:
    """Return the telemetry of an axis, in the order of its addresses.

    Some estimators have a velocity of more than 32 bits: its register has the upper ones, rounded down.
    """
    count, force, estimator = SQ(spec.count_width, 0), spec.force, spec.design.estimator
    flags = ", ".join(f"bit {bit} {name}" for bit, name in enumerate(spec.design.flags))
    rows: list[tuple[str, Format, float, str, str]] = [
        ("drive", force, spec.force_resolution_n, "N", "The force on the handle that the axis asks for."),
        ("count", count, spec.count_m, "m", "The position of the encoder."),
        (
            "velocity",
            narrowed(estimator.velocity),
            spec.velocity_unit_m_per_s,
            "m/s",
            "The velocity estimated at the last sample.",
        ),
        ("wall_force", force, spec.force_resolution_n, "N", "The wall's force on the handle at the last sample."),
        ("flags", UQ(len(spec.design.flags), 0), 1.0, "", f"The sticky flags are {flags}."),
        ("illegal_count", UQ(ILLEGAL_WIDTH, 0), 1.0, "", "The illegal transitions since the last clear, saturated."),
        ("index_count", count, spec.count_m, "m", "The position at the index, once it is latched."),
        ("index_armed", UQ(1, 0), 1.0, "", "An index is waited for."),
        ("index_latched", UQ(1, 0), 1.0, "", "The position at the index is valid."),
    ]
    stamp, second = UQ(spec.stamp_width, 0), 1 / spec.clock_hz
    rows.append(("stamp", stamp, second, "s", "The number of the clock at which the values were taken."))
    for pin in ("a", "b"):
        for edge in ("rise", "fall"):
            meaning = f"The stamp of the last {edge} of the encoder's pin {pin.upper()}."
            rows.append((f"stamp_{pin}_{edge}", stamp, second, "s", meaning))
    if isinstance(estimator, Accelerated):
        meaning = "The acceleration estimated at the last sample."
        unit = spec.velocity_unit_m_per_s * spec.sample_hz
        rows.append(("acceleration", estimator.acceleration, unit, "m/s^2", meaning))
    return tuple(Register(name, Kind.STATUS, fmt, said, si, unit) for name, fmt, si, unit, said in rows)


LINK_COUNTERS = (
    ("link_naks", "The device never refuses a frame for lack of time, so this is 0."),
    ("link_busy", "The device never answers that it is busy, so this is 0."),
    ("link_overruns", "Frames during which bytes arrived that were dropped because an answer was under way."),
    ("link_messages", "Frames heard with a good CRC, to whatever unit."),
    ("link_errors", "Frames that were dropped because of a bad CRC, a bad stop bit or a missing end."),
    ("link_exceptions", "Exceptions answered."),
    ("link_requests", "Frames to this unit, each of which was answered."),
    ("link_unanswered", "Broadcasts heard, which the device ignores."),
)
"""The counters, in the order of the three lowest bits of the diagnostic sub-function that returns each."""
AXIS_PULSES = (
    ("commit", "Every word that was written becomes active at the axis's next sample, all together."),
    ("clear_flags", "The sticky flags and the count of illegal transitions are cleared."),
    ("preload", "The count is set to the active word preload_count, and the estimator starts afresh."),
    ("index_arm", "The place of the next index is latched."),
)
"""The axis's pulses, in the order of their addresses downwards."""
LAST_PULSES = (
    (
        "origin_shift",
        "The active word preload_count is added to the count and to index_count at one clock, and the estimator starts "
        "afresh.",
    ),
)
"""The axis's pulses whose addresses are below all others."""


def _words(spec: DesignedAxis, committed: Iterable[Word]) -> tuple[Register, ...]:
    """Return the committed words of an axis as written: the preload's count first, for every axis has it."""
    meaning = "The pulse preload sets the count to this word once it is active, and the pulse origin_shift adds it."
    preload = Register("preload_count", Kind.WORD, SQ(spec.count_width, 0), meaning, spec.count_m, "m")
    return preload, *map(word_register, committed)


def _placed(base: int, room: int, registers: tuple[Register, ...]) -> tuple[Register, ...]:
    """Return registers at successive addresses from `base` on; there is room for `room` addresses."""
    size = sum(register.size for register in registers)
    if size > room:
        raise ValueError(f"the block at {base:#06x} must have at most {room} registers, not {size}")
    places, address = [], base
    for register in registers:
        places.append(dataclasses.replace(register, address=address))
        address += register.size
    return tuple(places)


def records_in(capture_registers: int) -> int:
    """Return the records of a capture memory of so many registers.

    Raises:
        ValueError: if there can be none of so many.
    """
    check_int("capture_registers", capture_registers, 0, SPACE - CAPTURE)
    records, more = divmod(capture_registers, capture.RECORD_REGISTERS)
    if more or records == 1 or records & (records - 1):
        raise ValueError(
            f"capture_registers must be 0, or {capture.RECORD_REGISTERS} times a power of two from 2 on, "
            f"not {capture_registers}"
        )
    return records


class RegisterMap:
    """The registers of a supervised axis, placed, with the identity of the build and the map that the device carries.

    Args:
        spec: the axis.
        capture_registers: registers of the capture memory, 8 for each of its records; 0 for none.

    Attributes:
        spec, capture_registers: as given.
        capture: the design of the capture memory, or None.
        status, pulses, words, active, live: the registers of these kinds in the order of the hardware's ports; `pulses`
            begins with `commit`, at the highest address.
        registers: every register, in the order of addresses.
        identity: the hash of the build, 16 hexadecimal digits.
        compressed: the map that the device carries, of all but the constants: zlib, JSON.

    Raises:
        TypeError: if `spec` is not an AxisSpec.
        ValueError: if `capture_registers` is none that there can be, or the samples are too close for a capture.
    """

    PRODUCT: ClassVar = b"axis"
    """The product by which the device identifies itself."""
    spec: DesignedAxis
    capture: capture.Design | None

    def __init__(self, spec: AxisSpec, capture_registers: int = CAPTURE_REGISTERS):
        if not isinstance(spec, AxisSpec):
            raise TypeError(f"spec must be an AxisSpec, not {shown(spec)}")
        records = records_in(capture_registers)
        self.spec, self.capture_registers = spec, capture_registers
        self.capture = capture.Design(spec, records) if records else None
        design = Design(spec)
        self._describe((*design.registers(), *(self.capture.registers() if self.capture else ())), design.committed)

    def _describe(self, known: Sequence[Register], committed: Sequence[Word]) -> None:
        """Place every register, and make of them what the device carries.

        Args:
            known: the registers of the supervisor and of what is beside it, not yet placed.
            committed: the words that wait for a commit.
        """
        spec = self.spec

        def own(kind: Kind) -> tuple[Register, ...]:
            return tuple(register for register in known if register.kind is kind)

        telemetry = _placed(TELEMETRY, SUPERVISOR - TELEMETRY, _telemetry(spec))
        self.status = telemetry + _placed(SUPERVISOR, COUNTERS - SUPERVISOR, own(Kind.STATUS))
        first, last = (
            tuple(Register(name, Kind.PULSE, UQ(1, 0), meaning) for name, meaning in pulses)
            for pulses in (AXIS_PULSES, LAST_PULSES)
        )
        pulses = (*first, *own(Kind.PULSE), *last)
        lowest = WRITTEN - len(pulses)
        self.pulses = _placed(lowest, WRITTEN - max(lowest, PULSES), pulses[::-1])[::-1]
        self.words = _placed(WRITTEN, ACTIVE - WRITTEN, _words(spec, committed))
        self.live = _placed(LIVE, END - LIVE, own(Kind.LIVE))
        self.active = tuple(
            dataclasses.replace(
                word,
                name=f"active_{word.name}",
                kind=Kind.ACTIVE,
                address=word.address + ACTIVE - WRITTEN,
                meaning=f"The word {word.name} that the axis uses.",
            )
            for word in self.words
        )
        counters = (Register(name, Kind.COUNTER, UQ(COUNTER_BITS, 0), meaning) for name, meaning in LINK_COUNTERS)
        rest = (*self.status, *_placed(COUNTERS, PULSES - COUNTERS, tuple(counters)), *self.pulses[::-1])
        rest += (*self.words, *self.active, *self.live)
        self.identity = self._hash(rest)
        self.compressed = self._compressed(rest)
        self.registers = self._constants() + rest

    def _hash(self, rest: tuple[Register, ...]) -> str:
        """Return the identity: 16 hexadecimal digits of the SHA-256 of the specification and of all that is placed."""
        described = repr((LAYOUT, self.capture_registers, self.spec.facts, rest))
        return hashlib.sha256(described.encode()).hexdigest()[:16]

    def _compressed(self, rest: tuple[Register, ...]) -> bytes:
        """Return the map that the device carries: JSON, compressed, without meanings and without the constants."""
        rows = []
        for r in rest:
            number = [int(r.format.signed), r.format.width, r.lsb, r.unit]
            rows.append([r.address, r.name, r.kind.value, *number, r.low, r.high, r.reset])
        columns = ["address", "name", "kind", "signed", "bits", "si_per_lsb", "unit", "least", "most", "reset"]
        described = {"layout": LAYOUT, "identity": self.identity, "columns": columns, "registers": rows}
        described |= self._more_described
        return zlib.compress(json.dumps(described, separators=(",", ":")).encode(), 9)

    def _constants(self) -> tuple[Register, ...]:
        """Return the constants, which follow from everything else."""
        rows = (
            ("layout", LAYOUT, "", "The version of the rule of addresses."),
            ("identity_high", int(self.identity[:8], 16), "", "The upper half of the hash of specification and map."),
            ("identity_low", int(self.identity[8:], 16), "", "The lower half of that hash."),
            ("clock_hz", self.spec.clock_hz, "Hz", "The clock, which numbers the stamps."),
            ("map_bytes", len(self.compressed), "", "The length of the compressed map in its window."),
            ("capture_registers", self.capture_registers, "", "The length of the capture memory in its window."),
            ("clocks_per_sample", self.spec.clocks_per_sample, "", "The clocks from a sample to the next."),
            *self._more_constants,
        )
        registers = (
            Register(name, Kind.CONSTANT, UQ(VALUE_BITS, 0), meaning, 1.0, unit, reset=value)
            for name, value, unit, meaning in rows
        )
        return _placed(CONSTANTS, TELEMETRY - CONSTANTS, tuple(registers))

    @property
    def _more_constants(self) -> tuple[tuple[str, int, str, str], ...]:
        """Constants after the ones that every device has: name, value, unit and meaning."""
        return ()

    @property
    def _more_described(self) -> dict[str, int]:
        """The part of the device's own map besides the registers."""
        return {}

    @property
    def identification(self) -> dict[tuple[bool, int], bytes]:
        """The ends of the answers that identify the device, by whether one object is asked for, and by the first one.

        An end has the conformity level, no more to follow, the number of objects, and the objects. Each object has its
        number and its length: vendor, product, and the build's identity as its revision. All have an even length.
        """
        texts = b"hardwall", self.PRODUCT, self.identity.encode()
        objects = [bytes([number, len(text)]) + text for number, text in enumerate(texts)]
        streams = {(False, first): objects[first:] for first in range(len(objects))}
        single = {(True, first): [each] for first, each in enumerate(objects)}
        return {key: bytes([CONFORMITY, 0, 0, len(some)]) + b"".join(some) for key, some in (streams | single).items()}

    def __getitem__(self, name: str) -> Register:
        """Return the register of a name.

        Raises:
            KeyError: if there is none of that name; the message has all names.
        """
        for register in self.registers:
            if register.name == name:
                return register
        raise KeyError(f"register must be one of {', '.join(each.name for each in self.registers)}, not {name!r}")
