"""The registers of several axes as hardware holds them: a bank of cells an axis, and one snapshot for whoever reads.

A bank has the same cells as the `register_file` of a single axis, except the areas with the accepted ranges: these
exist once, because all banks have the same words. A written word stays in its cell until a commit in its bank. Then
every written word of the bank becomes active and goes, by its number, to the axis. The pulses of the frame go out at
one clock. A live word goes to its axis as soon as its lower half is written.

The status of the axes is not in cells. A snapshot takes the status of one axis: of its next sample, and of its
supervisor at that sample. The stamps of edges are remembered here: the stamps of the last edges in the sample's count,
each 0 until there is one. So every value of a frame is of one sample. The sample comes after the pulses of all frames
before, and of the frame itself, have acted.

No frame can write to two banks, and none can read the status of two: between them lies what cannot be written, and more
than a frame can read.
"""

from ..axis import register_file
from ..axis.registers import ACTIVE, COUNTERS, END, PULSES, TELEMETRY, WRITTEN
from ..register import Register
from .registers import BANK, AxesMap, is_shared
from .supervised import Design as Axes


def _half(place: int) -> int:
    """Return the address of the other half of a value."""
    return place ^ 1


class Design(register_file.Design):
    """The content of the register file for a map of several axes. The attributes are as of `register_file.Design`, and:

    Attributes:
        registers: the map.
        axes: the design of the axes.
        numbers: the number by which an axis knows a word, by the address of its lower half in a bank.
        own_places: addresses of live words and pulses that only the bank of axis 0 has.
        settle_clocks: clocks from pulses until an actuation of every axis, and a turn of its supervisor, has seen them.

    Raises:
        TypeError: if `registers` is not an AxesMap.
    """

    registers: AxesMap

    def __init__(self, registers: AxesMap):
        if not isinstance(registers, AxesMap):
            raise TypeError(f"registers must be an AxesMap, not {registers!r}")
        super().__init__(registers)
        self.axes = Axes(registers.spec)
        known = {word.name: number for number, word in enumerate(self.axes.words)}
        words = (*registers.words, *registers.live)
        self.numbers = {word.address + 1: known[word.name] for word in words if word.name in known}
        self.own_places = frozenset(each.address + half for each in registers.shared for half in range(each.size))
        spec = registers.spec
        self.settle_clocks = spec.samples_per_actuation * spec.clocks_per_sample + self.axes.latency

    @property
    def banks(self) -> int:
        """The number of banks."""
        return self.registers.banks

    def in_banks(self, address: int) -> bool:
        """Return whether an address is one of a bank."""
        return address < BANK * self.banks

    def wide(self, address: int) -> bool:
        return self.in_banks(address) and super().wide(address % BANK)

    def readable(self, address: int) -> bool:
        return self.in_banks(address) or (address >= END and super().readable(address))

    def writable(self, address: int) -> bool:
        place = address % BANK
        return self.in_banks(address) and super().writable(place) and (address < BANK or place not in self.own_places)

    def shows(self, address: int) -> bool:
        """Return whether the register at an address is one of an axis's status."""
        return self.in_banks(address) and TELEMETRY <= address % BANK < COUNTERS

    def reset_of(self, bank: int, place: int) -> int:
        """Return the value of a bank's cell after a reset; registers that exist once are in the bank of axis 0."""
        once = place < TELEMETRY or place in self.own_places
        return 0 if bank and once else self.book[register_file.Area.RESET * END + place]


class BankedFile(register_file.RegisterFile):
    """The banked file's twin: a method for every operation, and what comes out at its ports.

    Attributes:
        live: the cells, a bank behind the other.
        pulses: names of the pulses that went out at the last FINISH; `bank`: the axis to which they went.
        writes: every word that was written to an axis since the list was emptied: axis, number, word.
        preload_count, acknowledged: what came with the last pulses.
        active: the live words that there are once for all axes, as the host wrote them last, by name.
        statuses: for every axis the word of every status now, by name.
        refused_of: for every axis the names of the pulses that the device refuses now.
    """

    design: Design

    def __init__(self, design: Design):
        super().__init__(design)
        self.live = [design.reset_of(bank, place) for bank in range(design.banks) for place in range(BANK)]
        self.bank, self.writes = 0, list[tuple[int, int, int]]()
        self.preload_count = self.acknowledged = 0
        self.active = {word.name: word.reset for word in design.registers.live if is_shared(word)}
        self.statuses = [dict(self.status) for _ in range(design.banks)]
        self.refused_of: list[frozenset[str]] = [frozenset()] * design.banks
        self._shown = [0] * BANK

    def clear(self) -> None:
        """Forget the results of the checks, and the axis whose status was asked for."""
        super().clear()
        self.asked: int | None = None

    def check_read(self, address: int, first: bool, last: bool) -> None:
        super().check_read(address, first, last)
        if self.design.shows(address):
            self.asked = address // BANK

    def _pulse(self, address: int) -> str:
        bank, place = divmod(address, BANK)
        if not self.design.in_banks(address):
            return ""
        self.refusing = self.refused_of[bank]
        return super()._pulse(place)

    def read(self, address: int) -> int:
        """Return the register at an address that can be read; a status as the last snapshot has it, in any bank."""
        if self.design.shows(address):
            return self._shown[address % BANK]
        return self.live[address] if self.design.in_banks(address) else super().read(address)

    def write(self, address: int, value: int) -> None:
        """Write a register that can be written, or a counter."""
        self.bank, place = divmod(address, BANK)
        if PULSES <= place < WRITTEN:
            super().write(place, value)
            return
        self.live[address] = value
        for word in self.design.registers.live:
            if place == word.address + 1:
                self._give(word, word.from_registers((self.live[_half(address)], value)))

    def _give(self, word: Register, value: int) -> None:
        """Give a word to its port, or to the axis of the bank."""
        if is_shared(word):
            self.active[word.name] = value
        elif (number := self.design.numbers.get(word.address + 1)) is not None:
            self.writes.append((self.bank, number, value))

    def _word(self, name: str) -> int:
        """Return a word of the bank of the last write."""
        register = self.design.registers.of_axis(name, self.bank)
        return register.from_registers(tuple(self.live[register.address : register.address + 2]))

    def finish(self) -> None:
        """Commit the words of the bank if that is marked, and let the marked pulses go out together."""
        if "commit" in self.marked:
            base = BANK * self.bank
            for word in self.design.registers.words:
                written, active = base + word.address, base + word.address + ACTIVE - WRITTEN
                self.live[active : active + 2] = self.live[written : written + 2]
                self._give(word, self._word(word.name))
        if self.marked:
            self.preload_count, self.acknowledged = self._word("active_preload_count"), self._word("acknowledged")
        self.pulses, self.marked = tuple(self.marked), []

    def snapshot(self) -> None:
        """Take the status of the axis that was asked for, from the words now."""
        if self.asked is None:
            return
        for register in self.design.registers.status:
            halves = register.to_registers(self.statuses[self.asked][register.name])
            self._shown[register.address : register.address + 2] = halves
        self.asked = None
