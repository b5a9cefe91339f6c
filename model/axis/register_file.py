"""The registers of an axis as hardware holds them: written words, active words, pulses, counters and a snapshot.

A book of 16-bit cells has four areas of 256, which one port of a memory reads and one writes:

- LIVE is what the host reads, by the address of the register.
- RESET is what LIVE is set to by a reset: constants, and words as after a reset.
- LEAST and MOST are the bounds of what may be written. For a status or an active word, LEAST says how it
  comes from a snapshot's chain, or goes there for its port (`_moves`).

A written word stays in LIVE until a commit. The commit copies every word to its active cell and to the port that the
axis reads. Then the pulses of the frame go out, all at one clock, and the axis takes the words at its next sample. A
live word is at its port as soon as its lower half is written.

A snapshot takes the status in turns. The first turn takes, at one clock, everything that moves with every clock or
sample. The later ones take the values that only events change. What is taken in one turn is of one clock, and every
value is whole. The stamps of edges are remembered here, from the axis's pulse at every edge, each 0 until there was
one.
"""

from collections.abc import Sequence
from enum import IntEnum

from ..register import Register
from .registers import (
    ACTIVE,
    CAPTURE,
    COUNTERS,
    COUNTS,
    EDGE_STAMPS,
    END,
    EVENTS,
    LIVE,
    MAP,
    PULSES,
    WRITTEN,
    RegisterMap,
)

EXCLUSIVE = {
    "arm": ("commit", "preload", "origin_shift"),
    "commit": ("arm",),
    "preload": ("arm", "origin_shift"),
    "origin_shift": ("arm", "preload"),
}
"""The pulses that exclude each other in one frame: an axis that is armed while its words or its count change would
drive for the old wall or the old place."""
WITH_WORDS = "commit", "preload", "origin_shift"
"""Pulses that need the active words at their ports."""
CELL_BITS = 16
CELL = (1 << CELL_BITS) - 1
EXTENDED = 1 << CELL_BITS - 1
"""In a LEAST cell of a status: bits beyond the snapshot's repeat its last bit."""
NEXT, SOURCE = 5, 12
"""In a LEAST cell of a status or an active word: the lowest bits of half the next cell's address and of
the source."""

ANSWERS, ANSWER = 4, 32
"""Identifying answers of a kind that there is room for, and registers for each."""


class Area(IntEnum):
    """An area of the book."""

    LIVE = 0
    RESET = 1
    LEAST = 2
    MOST = 3


class Operation(IntEnum):
    """The operations of a register file; the first four are the phases of a frame, in their order."""

    CHECK_READ = 0
    CHECK_WRITE = 1
    WRITE = 2
    READ = 3
    COUNT = 4
    FINISH = 5
    SNAPSHOT = 6


class Source(IntEnum):
    """The source that loads the chain before a status's cell; the chain's lowest bits are taken first.

    The numbers suit the chain's logic. The two upper bits are alike and choose between the lower two and the upper two
    sources; the lowest bit chooses one of the two.
    """

    NOTHING = 0
    MOMENT = 1  # what moves with every clock or sample
    EDGE = 6  # the stamp of a kind of edge, and behind it the counts of the causes
    EVENTS = 7


class Design:
    """The content of a map's register file.

    Attributes:
        registers: the map.
        turns: what a snapshot takes at one clock each, in its order: the source, and the registers.
        book: the cells of every area at configuration.
        map_cells: the cells of the window to the compressed map, and behind them the answers of the identification.
        answers_at: the address of each of those answers, and how many registers it has, by their keys in the map.
        first_pulse: the address of the first pulse.
        last_word, last_live: the addresses behind the last of each kind.
    """

    def __init__(self, registers: RegisterMap):
        if not isinstance(registers, RegisterMap):
            raise TypeError(f"registers must be a RegisterMap, not {registers!r}")
        self.registers = registers
        self.turns = self._turns()
        self.first_pulse = WRITTEN - len(registers.pulses)
        self.last_word = WRITTEN + 2 * len(registers.words)
        self.last_live = LIVE + 2 * len(registers.live)
        self.book = self._book()
        # An answer begins where its number, and whether it is of one object, are bits of its address.
        text = registers.compressed + bytes(-len(registers.compressed) % (2 * 2 * ANSWERS * ANSWER))
        self.answers_at: dict[tuple[bool, int], tuple[int, int]] = {}
        begun = len(text) // 2
        for (one, number), answer in sorted(registers.identification.items()):
            at = begun + (one * ANSWERS + number) * ANSWER
            text += bytes(2 * at - len(text)) + answer
            self.answers_at[one, number] = MAP + at, len(answer) // 2
        self.map_cells = [int.from_bytes(text[k : k + 2], "big") for k in range(0, len(text), 2)]

    def _turns(self) -> tuple[tuple[Source, tuple[Register, ...]], ...]:
        status = self.registers.status
        edges = [each for each in status if each.name in EDGE_STAMPS]
        events = tuple(each for each in status if each.name in EVENTS)
        counts = tuple(each for each in status if each.name.startswith(COUNTS))
        moment = tuple(each for each in status if each not in (*edges, *events, *counts))
        alone = tuple((Source.EDGE, (edge,)) for edge in edges[:-1])
        return (Source.MOMENT, moment), *alone, (Source.EDGE, (edges[-1], *counts)), (Source.EVENTS, events)

    def _book(self) -> list[int]:
        book = [0] * (END * len(Area))
        for register in self.registers.registers:
            places = range(register.address, register.address + register.size)
            for area, word in ((Area.RESET, register.reset), (Area.LEAST, register.low), (Area.MOST, register.high)):
                for place in places:
                    shift = CELL_BITS * (places[-1] - place)
                    book[area * END + place] = word >> shift & CELL
        status = [(register, int(source) * (not k)) for source, turn in self.turns for k, register in enumerate(turn)]
        for moved in (status, [(word, int(Source.NOTHING)) for word in self.registers.active]):
            for place, cell in self._moves(moved).items():
                book[Area.LEAST * END + place] = cell
        return book

    @staticmethod
    def _moves(moved: list[tuple[Register, int]]) -> dict[int, int]:
        """Return the LEAST cells of values that pass through the chain one after the other, with their sources.

        A cell has four parts: the bits of its register; half the address of the next cell, or 0 after the last; the
        source that loads the chain before; and `EXTENDED`. The low half of a value comes first, so that odd and even
        addresses take turns.
        """
        cells, following = {}, 0
        for register, source in reversed(moved):
            extended, width = EXTENDED * register.format.signed, register.format.width
            for half, place in ((1, register.address), (0, register.address + 1)):
                bits = min(max(width - CELL_BITS * half, 0), CELL_BITS)
                cells[place] = extended | source * (not half) << SOURCE | following // 2 << NEXT | bits
                following = place
        return cells

    def wide(self, address: int) -> bool:
        """Return whether a register is half of a value."""
        return address < COUNTERS or WRITTEN <= address < END

    def readable(self, address: int) -> bool:
        """Return whether there is a register at an address."""
        capture = self.registers.capture_registers
        return address < END or MAP <= address < MAP + len(self.map_cells) or CAPTURE <= address < CAPTURE + capture

    def writable(self, address: int) -> bool:
        """Return whether the register at an address can be written."""
        return self.first_pulse <= address < self.last_word or LIVE <= address < self.last_live


class RegisterFile:
    """The register file's twin: a method for every operation, and what comes out at its ports.

    Attributes:
        live: the cells that the host reads.
        active: the words in use, by name. A live word is in use at its port. Another word is in use while a pulse of
            `WITH_WORDS` is high, and after a commit until the axis has taken it.
        pulses: names of the pulses that went out at the last FINISH; `marked`: the pulses for the next one.
        status: the word of every status now.
        refusing: names of the pulses that the device refuses now.
        capture: the registers of the capture memory, or None while they cannot be read.
        absent, outside, refused: what the checks have found since `clear`.
    """

    def __init__(self, design: Design):
        self.design = design
        self.live = design.book[Area.RESET * END : (Area.RESET + 1) * END]
        self.active = {word.name: word.reset for word in (*design.registers.words, *design.registers.live)}
        self.pulses: tuple[str, ...] = ()
        self.marked: list[str] = []
        self.status = {status.name: 0 for status in design.registers.status}
        self.refusing: frozenset[str] = frozenset()
        self.capture: Sequence[int] | None = None
        self._tied = [True, True]
        self.clear()

    @property
    def ports(self) -> dict[str, int]:
        """The words at their ports together with `pulses`, by name: live words, and words that a pulse needs."""
        shifted = set(WITH_WORDS) & set(self.pulses)
        kept = (*self.design.registers.words, *self.design.registers.live) if shifted else self.design.registers.live
        return {word.name: self.active[word.name] for word in kept}

    def clear(self) -> None:
        """Forget what the checks have found."""
        self.absent = self.outside = self.refused = False
        self._exclusive: set[str] = set()

    def _half(self, address: int, first: bool, last: bool) -> bool:
        """Return whether the other half of a value is missing: it begins at an even address and ends at an odd one."""
        return self.design.wide(address) and ((first and address % 2 == 1) or (last and address % 2 == 0))

    def _pulse(self, address: int) -> str:
        """Return the name of the pulse at an address, or nothing."""
        is_pulse = self.design.first_pulse <= address < WRITTEN
        return self.design.registers.pulses[WRITTEN - 1 - address].name if is_pulse else ""

    def check_read(self, address: int, first: bool, last: bool) -> None:
        """Find out whether a register can be read, as the first or the last of a frame or neither.

        A capture memory's register is refused while the memory cannot be read.
        """
        captured = CAPTURE <= address < CAPTURE + self.design.registers.capture_registers
        self.refused |= captured and self.capture is None
        self.absent |= not self.design.readable(address) or self._half(address, first, last)

    def check_write(self, address: int, first: bool, last: bool, value: int) -> None:
        """Find out whether a register can be written with `value`.

        The halves of a value must come in order. A word is compared with its bounds from the top: the next half counts
        only while all halves above it equal the bound's.
        """
        self.absent |= not self.design.writable(address) or self._half(address, first, last)
        pulse = self._pulse(address) if value & 1 else ""
        self.refused |= pulse in self.refusing
        if pulse in EXCLUSIVE:
            self.refused |= not self._exclusive.isdisjoint(EXCLUSIVE[pulse])
            self._exclusive.add(pulse)
        top = not self.design.wide(address) or address % 2 == 0
        flip = EXTENDED if top else 0
        for k, area in enumerate((Area.LEAST, Area.MOST)):
            bound = self.design.book[area * END + address % END] ^ flip
            tied, word = top or self._tied[k], value ^ flip
            self.outside |= tied and (word < bound if area is Area.LEAST else word > bound)
            self._tied[k] = tied and word == bound

    def read(self, address: int) -> int:
        """Return the register at a readable address; 0 for a capture memory that cannot be read now."""
        if address < END:
            return self.live[address]
        if address < CAPTURE:
            return self.design.map_cells[address - MAP]
        return 0 if self.capture is None else self.capture[address - CAPTURE]

    def write(self, address: int, value: int) -> None:
        """Write a register that can be written, or a counter."""
        if PULSES <= address < WRITTEN:
            name = self.design.registers.pulses[WRITTEN - 1 - address].name
            if value & 1 and name not in self.marked:
                self.marked.append(name)
        else:
            self.live[address] = value
            for word in self.design.registers.live:
                if address == word.address + 1:
                    self.active[word.name] = word.from_registers((self.live[word.address], value))

    def count(self, address: int) -> None:
        """Count one in a counter, which wraps."""
        self.live[address] = self.live[address] + 1 & CELL

    def finish(self) -> None:
        """Make the written words active if `commit` is marked, and let the marked pulses go out together."""
        if "commit" in self.marked:
            for word in self.design.registers.words:
                place = word.address + ACTIVE - WRITTEN
                halves = self.live[word.address : word.address + 2]
                self.live[place : place + 2] = halves
                self.active[word.name] = word.from_registers(tuple(halves))
        self.pulses, self.marked = tuple(self.marked), []

    def snapshot(self) -> None:
        """Take the words of every status, all turns from the words now."""
        for _, registers in self.design.turns:
            self.take(registers)

    def take(self, registers: tuple[Register, ...]) -> None:
        """Take the words of one turn of the status."""
        for register in registers:
            halves = register.to_registers(self.status[register.name])
            self.live[register.address : register.address + 2] = halves
