"""The registers of an axis: shadowed words, pulses, counters, a snapshot of every status, and windows to memories."""

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.register_file import CELL_BITS, WITH_WORDS, Area, Design, Operation
from hardwall.model.axis.registers import CAPTURE, COUNTERS, EDGE_STAMPS, END, LIVE, MAP, PULSES

from ..arithmetic.fixed import less, shape
from ..link.checks import Bounds, Pulses, check_read
from ..link.requests import Requests
from ..wires import port, ports
from .register_cells import Cells
from .register_transfers import Transfers

SWEPT = CELL_BITS + 4
"""Clocks that a snapshot takes for a cell."""


class At(NamedTuple):
    """The register at the host's address.

    Attributes:
        below: its lowest bits.
        in_book, in_map, in_capture: whether it is a register of the book, of the window, of the capture memory.
        wide: it is one of two of a value.
        is_pulse: the register is a pulse.
        half: a frame begins or ends with it, and has half of a value.
    """

    below: Value
    in_book: Value
    in_map: Value
    in_capture: Value
    wide: Value
    is_pulse: Value
    half: Value


class RegisterFile(wiring.Component):
    """A memory of cells of 16 bits, and what joins it to the axis.

    Operations, by `host.operation`:

    - CHECK_READ, CHECK_WRITE: raise `absent`, `outside` or `refused` if the register cannot be read, or written with
      `host.value`, or not now. The halves of a value are checked in the order of their addresses, one after the other.
      A pulse is refused beside one of `EXCLUSIVE` that was checked since `clear`.
    - READ: give the register.
    - WRITE: keep the value of a word, or of a counter; mark a pulse if the value is 1. A live word is at its port with
      `done` of its lower half, which is written after the upper one. Only what was checked is written.
    - COUNT: add 1 to a counter, which wraps.
    - FINISH: if `commit` is marked, copy every written word to its active one; if a pulse of `WITH_WORDS` is, shift the
      active words to their ports. Then all marked pulses are high for the same one clock. The words have been at their
      ports for a clock or more, and stay until `done`. `done` comes when `commit_pending` has fallen, so words that are
      read back as active are in use.
    - SNAPSHOT: take the status for the following reads, in the turns of `design.turns`. The values of one turn are of
      one clock, and every value is whole. `taken_clocks` has the clock of each.

    Latency, in clocks from the first of `start` to `done`: 1 for CHECK_READ; 2 for READ, 3 of the capture memory; 3 for
    WRITE and COUNT; 4 for CHECK_WRITE; `snapshot_clocks` for SNAPSHOT. FINISH takes 3; if a pulse of `WITH_WORDS` is
    marked, `shift_clocks` and the wait for the sample come on top. After a reset the first `start` may come at once; it
    waits up to `boot_clocks`.

    Rounding and overflow: a value of fewer bits than its registers is extended by its sign or by zeros.

    Reset: every cell and live word is as after a reset when the first operation is done, and no edge has been seen.

    Parameters
    ----------
    design : hardwall.model.axis.register_file.Design
        The registers.

    Members
    -------
    host : In(Requests)
        The operations.
    one input for each status of the map, but for the stamps of edges : In
        Live.
    stepped, edge_kind : In
        High for one clock with the stamp behind an edge's; with it, the kind of the edge.
    one output for each word of the map : Out
        The active word while a FINISH needs it: from a clock before a pulse of `WITH_WORDS` until `done`. At other
        times it is anything.
    one output for each live word of the map : Out
        The word as written.
    one output for each pulse of the map : Out(1)
        High for one clock.
    refuse : In
        Bit k: the device now refuses pulse k of `design.registers.pulses`.
    commit_pending : In(1)
        A pulse of `WITH_WORDS` waits for its sample.
    capture_address : Out(15)
        The register of the capture memory that is read; there is none if the map has no capture memory.
    capture_data : In(16)
        That register, one clock later.
    capture_done : In(1)
        The capture memory can be read; otherwise a check that it can is `refused`, and it reads 0.

    Raises
    ------
    TypeError
        If `design` is not a Design.
    """

    def __init__(self, design: Design):
        if not isinstance(design, Design):
            raise TypeError(f"design must be a register_file.Design, not {design!r}")
        self._design = design
        registers = design.registers
        super().__init__(
            {
                "host": In(Requests()),
                **{each.name: In(shape(each.format)) for each in registers.status if each.name not in EDGE_STAMPS},
                "stepped": In(1),
                "edge_kind": In(range(len(EDGE_STAMPS))),
                **{word.name: Out(shape(word.format)) for word in registers.words},
                **{word.name: Out(shape(word.format), init=word.reset) for word in registers.live},
                **{pulse.name: Out(1) for pulse in registers.pulses},
                "refuse": In(len(registers.pulses)),
                "commit_pending": In(1),
                **(
                    {"capture_address": Out(15), "capture_data": In(CELL_BITS), "capture_done": In(1)}
                    if registers.capture
                    else {}
                ),
            }
        )

    @property
    def design(self) -> Design:
        return self._design

    @property
    def ports(self) -> dict[str, Member]:
        """The members to the axis: all but `host`."""
        return {name: member for name, member in self.signature.members.items() if name != "host"}

    @property
    def boot_clocks(self) -> int:
        """Clocks after a reset until an operation begins."""
        return 3 * END

    @property
    def shift_clocks(self) -> int:
        """Additional clocks of a FINISH that shifts words, without the wait for the sample."""
        return 2 * len(self._design.registers.words) * (CELL_BITS + 6)

    @property
    def snapshot_clocks(self) -> int:
        """Clocks from `start` of a SNAPSHOT to `done`."""
        return 2 * len(self._design.registers.status) * SWEPT + 1

    @property
    def taken_clocks(self) -> dict[str, int]:
        """Clocks from `start` of a SNAPSHOT to the clock whose status is taken, by name.

        Of an edge it is the stamp as the axis shows it then, with `stepped`.
        """
        taken, begun = {}, 0
        for _, turn in self._design.turns:
            taken |= {each.name: SWEPT * begun + 3 - 2 * (each.name in EDGE_STAMPS) for each in turn}
            begun += 2 * len(turn)
        return taken

    def elaborate(self, platform):
        m = Module()
        host, at = self.host, self._at()
        pulses = Pulses(m, host, self._design.registers, at.is_pulse, at.below)
        cells = Cells(m, self._design, host)
        if self._design.registers.capture:
            self._capture(m, cells)
        pulses.begin(m, host)
        bounds = self._bounds(m, at, cells.shift)
        transfers = Transfers(m, self, cells)
        cells.take(m, host.value, transfers.turned)
        with m.FSM():
            self._boot(m, cells)
            self._begin(m, at, cells, pulses, transfers)
            self._read(m, cells)
            most = [cells.place.eq(at.below), cells.area.eq(Area.MOST), cells.fetched.eq(1)]
            bounds.add_states(m, host, most, [cells.fetched.eq(1)])
            self._write(m, at, cells)
            self._give_pulses(m, pulses)
            transfers.add_states(m, pulses.marked("commit"))
            with m.State("DONE"):
                m.d.comb += host.done.eq(1)
                m.next = "IDLE"
        return m

    def _at(self) -> At:
        """Return what there is at the host's address."""
        host, registers = self.host, self._design.registers
        address = host.address
        below = address[: END.bit_length() - 1]
        in_book, in_capture = address[len(below) :] == 0, Const(0)
        # Counters and pulses have one register.
        wide = in_book & (below[5:] != COUNTERS >> 5)
        if registers.capture:
            in_capture = (address[15:] == CAPTURE >> 15) & less(address[:15], registers.capture_registers)
        return At(
            below=below,
            in_book=in_book,
            in_map=(address[14:] == MAP >> 14) & less(address[:14], len(self._design.map_cells)),
            in_capture=in_capture,
            wide=wide,
            is_pulse=in_book & (below[4:] == PULSES >> 4),
            half=wide & ((host.first & address[0]) | (host.last & ~address[0])),
        )

    def _capture(self, m: Module, cells: Cells) -> None:
        """Let the capture memory be found in the place of the cells."""
        m.d.comb += self.capture_address.eq(self.host.address)
        # That memory is large and far away: its output has its own register first.
        arrived = Signal(CELL_BITS)
        m.d.sync += arrived.eq(self.capture_data & self.capture_done.replicate(CELL_BITS))
        with m.If(cells.captured):
            m.d.comb += cells.found.eq(arrived)

    def _bounds(self, m: Module, at: At, shift: Signal) -> Bounds:
        """Return the comparison of a bound, which is fetched, with the host's value."""
        host = self.host
        top, tied = ~at.wide | ~host.address[0], Signal(2, init=3)
        bound, value = Signal(CELL_BITS), Signal(CELL_BITS)
        difference = Signal(CELL_BITS + 1)
        m.d.comb += [
            bound.eq(Cat(shift[:-1], shift[-1] ^ top)),
            value.eq(Cat(host.value[:-1], host.value[-1] ^ top)),
            difference.eq(bound - value),
        ]
        return Bounds(top, tied, difference)

    def _boot(self, m: Module, cells: Cells) -> None:
        """Add the states that write every cell after a reset."""
        step = cells.step
        with m.State("BOOT"):
            m.d.comb += [cells.place.eq(step), cells.area.eq(Area.RESET)]
            m.next = "BOOT_TAKE"
        with m.State("BOOT_TAKE"):
            m.d.comb += cells.fetched.eq(1)
            m.next = "BOOT_WRITE"
        with m.State("BOOT_WRITE"):
            m.d.comb += [cells.place.eq(step), cells.write.en.eq(1)]
            m.d.sync += step.eq(step + 1)
            m.next = "BOOT"
            with m.If(step.all()):
                m.next = "IDLE"

    def _begin(self, m: Module, at: At, cells: Cells, pulses: Pulses, transfers: Transfers) -> None:
        """Add the state that begins an operation."""
        design, host, below = self._design, self.host, at.below
        with m.State("IDLE"):
            m.d.comb += [cells.place.eq(below), cells.window.eq(host.address[14])]
            m.d.sync += transfers.committing.eq(0)
            with m.If(host.start), m.Switch(host.operation):
                with m.Case(Operation.CHECK_READ):
                    check_read(m, self, ~(at.in_book | at.in_map | at.in_capture) | at.half, at.in_capture)
                    m.next = "DONE"
                with m.Case(Operation.CHECK_WRITE):
                    m.d.comb += [cells.area.eq(Area.LEAST), cells.window.eq(0)]
                    word = ~less(below, design.first_pulse) & less(below, design.last_word)
                    live = ~less(below, LIVE) & less(below, design.last_live)
                    refused = (pulses.wanted & self.refuse).any() | pulses.several
                    pulses.check(m, host, ~at.in_book | ~(word | live) | at.half, refused)
                    m.next = "LEAST"
                with m.Case(Operation.READ):
                    m.next = "READ"
                with m.Case(Operation.WRITE):
                    m.next = "TAKE"
                    m.d.sync += pulses.marks.eq(pulses.marks | pulses.wanted)
                with m.Case(Operation.COUNT):
                    m.next = "COUNT"
                with m.Case(Operation.FINISH):
                    m.d.sync += cells.step.eq(design.registers.active[0].address + 1)
                    m.next = "PULSE"
                    with m.If(Cat(pulses.marked(name) for name in WITH_WORDS).any()):
                        m.d.sync += transfers.committing.eq(1)
                        m.next = "COPY"
                with m.Case(Operation.SNAPSHOT):
                    m.d.sync += cells.step.eq(design.turns[0][1][0].address + 1)
                    m.next = "SWEEP"

    def _read(self, m: Module, cells: Cells) -> None:
        """Add the states of a READ."""
        captures = self._design.registers.capture
        with m.State("READ"):
            m.d.comb += cells.fetched.eq(1)
            m.next = "DONE"
            if captures:
                with m.If(self.host.address[15]):
                    m.next = "READ_CAPTURE"
        if captures:
            with m.State("READ_CAPTURE"):
                m.d.comb += [cells.fetched.eq(1), cells.captured.eq(1)]
                m.next = "DONE"

    def _write(self, m: Module, at: At, cells: Cells) -> None:
        """Add the states of a WRITE and of a COUNT."""
        host, below = self.host, at.below
        with m.State("TAKE"):
            m.d.comb += cells.given.eq(1)
            # The upper half has been written just before, and is still there.
            with m.If(below[6:] == LIVE >> 6), m.Switch(below[:6]):
                for word in self._design.registers.live:
                    with m.Case(word.address - LIVE + 1):
                        m.d.sync += port(self, word.name).eq(Cat(host.value, cells.shift))
            m.next = "KEEP"
        with m.State("KEEP"):
            m.d.comb += [cells.place.eq(below), cells.write.en.eq(~at.is_pulse)]
            m.next = "DONE"
        with m.State("COUNT"):
            m.d.comb += cells.fetched.eq(1)
            m.next = "COUNTED"
        with m.State("COUNTED"):
            m.d.comb += [cells.place.eq(below), cells.counting.eq(1), cells.write.en.eq(1)]
            m.next = "DONE"

    def _give_pulses(self, m: Module, pulses: Pulses) -> None:
        """Add the states that send the pulses and wait for the sample that takes the words."""
        with m.State("PULSE"):
            m.d.comb += Cat(ports(self, pulses.names).values()).eq(pulses.marks)
            m.d.sync += pulses.marks.eq(0)
            m.next = "WAIT"
        with m.State("WAIT"), m.If(~self.commit_pending):
            m.next = "DONE"
