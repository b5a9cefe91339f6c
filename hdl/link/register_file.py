"""The registers of an axis: shadowed words, pulses, counters, a snapshot of every status, and windows to memories."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.link.register_file import CELL_BITS, Area, Design, Operation
from hardwall.model.registers import ACTIVE, CAPTURE, COUNTERS, END, LIVE, MAP, PULSES, SPACE, TELEMETRY, WRITTEN

from ..arithmetic.fixed import shape

ADDRESS_BITS = SPACE.bit_length()


class Requests(wiring.Signature):
    """The way from a server to a register file, as the server sees it.

    Members
    -------
    start : Out(1)
        High until `done`: do `operation`. What follows holds as long.
    operation : Out(range(7))
        A `model.link.register_file.Operation`.
    address : Out(17)
        The register; 65536 and above is none.
    first, last : Out(1)
        For a check: the register is the first, the last of a frame.
    value : Out(16)
        For a write and its check: the register's new value.
    clear : Out(1)
        Pulse: `absent`, `outside` and `refused` fall.
    done : In(1)
        High for one clock.
    data : In(16)
        With `done` of a READ: the register.
    absent, outside, refused : In(1)
        A check since `clear` has found no register or half of a value, a value out of its range, a pulse that the
        device refuses.
    """

    def __init__(self):
        super().__init__(
            {
                "start": Out(1),
                "operation": Out(range(len(Operation))),
                "address": Out(ADDRESS_BITS),
                "first": Out(1),
                "last": Out(1),
                "value": Out(CELL_BITS),
                "clear": Out(1),
                "done": In(1),
                "data": In(CELL_BITS),
                "absent": In(1),
                "outside": In(1),
                "refused": In(1),
            }
        )


class RegisterFile(wiring.Component):
    """A memory of cells of 16 bits, and what joins it to the axis.

    Operations, by `host.operation`:

    - CHECK_READ, CHECK_WRITE: raise `absent`, `outside` or `refused` if the register cannot be read, or written with
      `host.value`. The halves of a value are checked in the order of their addresses, one after the other.
    - READ: give the register.
    - WRITE: keep the value of a word, or of a counter; mark a pulse if the value is 1. A live word is at its port with
      `done` of its lower half, which is written after the upper one. Only what was checked is written.
    - COUNT: add 1 to a counter, which wraps.
    - FINISH: if `commit` is marked, copy every written word to its active one and shift it to its port. Then all marked
      pulses are high for one clock, the same one; the words have been at their ports for a clock or more, and stay
      until the next commit. `done` comes when `commit_pending` has fallen, so what is read back as active is in use.
    - SNAPSHOT: take every status, all at the clock of `start`, for what is read from then on.

    Latency, in clocks from the first of `start` to `done`: 1 for CHECK_READ and READ; 2 for WRITE and COUNT; 4 for
    CHECK_WRITE; `snapshot_clocks` for SNAPSHOT; for FINISH 3 and, if `commit` is marked, `commit_clocks` and the wait
    for the sample. After a reset the first `start` may come at once; it waits up to `boot_clocks`.

    Rounding and overflow: a value of fewer bits than its registers is extended by its sign or by zeros.

    Reset: every word, port and counter is as after a reset when the first operation is done.

    Parameters
    ----------
    design : hardwall.model.link.register_file.Design
        The registers.

    Members
    -------
    host : In(Requests)
        The operations.
    one input for each status of the map : In
        Live.
    one output for each word of the map : Out
        The active word; it moves while a commit copies the words, up to the clock of the pulse.
    one output for each live word of the map : Out
        The word as written.
    one output for each pulse of the map : Out(1)
        High for one clock.
    refuse : In
        Bit k: the device now refuses pulse k of `design.registers.pulses`.
    commit_pending : In(1)
        A commit waits for its sample.
    capture_address : Out(15)
        The register of the capture memory that is read; there is none if the map has no capture memory.
    capture_data : In(16)
        That register, one clock later.

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
                **{status.name: In(shape(status.format)) for status in registers.status},
                **{word.name: Out(shape(word.format), init=word.reset) for word in (*registers.words, *registers.live)},
                **{pulse.name: Out(1) for pulse in registers.pulses},
                "refuse": In(len(registers.pulses)),
                "commit_pending": In(1),
                **({"capture_address": Out(15), "capture_data": In(CELL_BITS)} if registers.capture_registers else {}),
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
        return 2 * END

    @property
    def commit_clocks(self) -> int:
        """Clocks by which a commit makes a FINISH longer, without the wait for the sample."""
        return 2 * len(self._design.registers.words) * (CELL_BITS + 5)

    @property
    def snapshot_clocks(self) -> int:
        """Clocks from `start` of a SNAPSHOT to `done`."""
        return (self._design.last_status - TELEMETRY) * (CELL_BITS + 3) + 1

    def elaborate(self, platform):
        m = Module()
        design, registers, host = self._design, self._design.registers, self.host
        m.submodules.book = book = Memory(shape=CELL_BITS, depth=len(design.book), init=design.book)
        m.submodules.map = window = Memory(shape=CELL_BITS, depth=len(design.map_cells), init=design.map_cells)
        read, write, map_read = book.read_port(), book.write_port(), window.read_port()

        # What there is at the address.
        address = host.address
        below = address[: END.bit_length() - 1]
        in_book, in_map, in_capture = address < END, address[14:] == MAP >> 14, Const(0)
        wide = in_book & ((address < COUNTERS) | (address >= WRITTEN))
        in_map &= address[:14] < len(design.map_cells)
        is_pulse = in_book & (below[4:] == PULSES >> 4)
        half = wide & ((host.first & address[0]) | (host.last & ~address[0]))
        marks = Signal(len(registers.pulses))
        wanted = Signal.like(marks)
        for bit, pulse in enumerate(registers.pulses):
            m.d.comb += wanted[bit].eq(is_pulse & (below[:4] == pulse.address % 16) & host.value[0])

        step = Signal(range(END))
        place, area = Signal(range(END)), Signal(Area)
        shift, status = Signal(CELL_BITS), Signal(sum(each.format.width for each in registers.status))
        left, extended, bit = Signal(range(CELL_BITS + 1)), Signal(), Signal(range(CELL_BITS))
        ports, committing = Cat(getattr(self, word.name) for word in registers.words), Signal()
        counting, storing, high = Signal(), Signal(), Signal(CELL_BITS)
        m.d.comb += [
            read.addr.eq(Cat(place, area)),
            write.addr.eq(place),
            write.data.eq(Mux(storing, shift, read.data + counting)),
            map_read.addr.eq(address),
            host.data.eq(Mux(address[14], map_read.data, read.data)),
        ]
        if registers.capture_registers:
            in_capture = (address[15:] == CAPTURE >> 15) & (address[:15] < registers.capture_registers)
            m.d.comb += self.capture_address.eq(address)
            with m.If(address[15]):
                m.d.comb += host.data.eq(self.capture_data)
        with m.If(host.clear):
            m.d.sync += [host.absent.eq(0), host.outside.eq(0), host.refused.eq(0)]

        # One subtraction compares a bound with a value: signed at the top of a value, and only as long as all above
        # it was equal.
        top, tied = ~wide | ~address[0], Signal(2, init=3)
        bound, value = Signal(CELL_BITS), Signal(CELL_BITS)
        difference = Signal(CELL_BITS + 1)
        # The memory's answer comes late in a clock, so it waits for the next one.
        m.d.sync += bound.eq(Cat(read.data[:-1], read.data[-1] ^ top))
        m.d.comb += [
            value.eq(Cat(host.value[:-1], host.value[-1] ^ top)),
            difference.eq(bound - value),
        ]
        equal = ~difference.any()

        with m.FSM():
            with m.State("BOOT"):
                m.d.comb += [place.eq(step), area.eq(Area.RESET)]
                m.next = "BOOT_WRITE"
            with m.State("BOOT_WRITE"):
                m.d.comb += [place.eq(step), write.en.eq(1)]
                m.d.sync += step.eq(step + 1)
                m.next = "BOOT"
                with m.If(step.all()):
                    m.next = "IDLE"
            with m.State("IDLE"):
                m.d.comb += place.eq(below)
                m.d.sync += bit.eq(0)
                with m.If(host.start), m.Switch(host.operation):
                    with m.Case(Operation.CHECK_READ):
                        with m.If(~(in_book | in_map | in_capture) | half):
                            m.d.sync += host.absent.eq(1)
                        m.next = "DONE"
                    with m.Case(Operation.CHECK_WRITE):
                        m.d.comb += area.eq(Area.LEAST)
                        word = (below >= design.first_pulse) & (below < design.last_word)
                        live = (below >= LIVE) & (below < design.last_live)
                        with m.If(~in_book | ~(word | live) | half):
                            m.d.sync += host.absent.eq(1)
                        with m.If((wanted & self.refuse).any()):
                            m.d.sync += host.refused.eq(1)
                        m.next = "LEAST"
                    with m.Case(Operation.READ):
                        m.next = "DONE"
                    with m.Case(Operation.WRITE):
                        m.next = "KEEP"
                        m.d.sync += [marks.eq(marks | wanted), shift.eq(host.value)]
                    with m.Case(Operation.COUNT):
                        m.next = "COUNT"
                    with m.Case(Operation.FINISH):
                        m.d.sync += [step.eq(ACTIVE), committing.eq(marks[0])]
                        m.next = "PULSE"
                        with m.If(marks[0]):
                            m.next = "COPY"
                    with m.Case(Operation.SNAPSHOT):
                        live = Cat(getattr(self, each.name) for each in registers.status)
                        m.d.sync += [step.eq(TELEMETRY), status.eq(live)]
                        m.next = "SWEEP"
            with m.State("LEAST"):
                m.d.comb += [place.eq(below), area.eq(Area.MOST)]
                m.next = "ABOVE"
            with m.State("ABOVE"):
                m.d.sync += tied[0].eq((top | tied[0]) & equal)
                with m.If((top | tied[0]) & ~difference[-1] & ~equal):
                    m.d.sync += host.outside.eq(1)
                m.next = "BELOW"
            with m.State("BELOW"):
                m.d.sync += tied[1].eq((top | tied[1]) & equal)
                with m.If((top | tied[1]) & difference[-1]):
                    m.d.sync += host.outside.eq(1)
                m.next = "DONE"
            with m.State("KEEP"):
                m.d.comb += [place.eq(below), storing.eq(1), write.en.eq(~is_pulse)]
                m.d.sync += high.eq(shift)
                for word in registers.live:
                    with m.If(below == word.address + 1):
                        m.d.sync += getattr(self, word.name).eq(Cat(shift, high))
                m.next = "DONE"
            with m.State("COUNT"):
                m.d.comb += [place.eq(below), counting.eq(1), write.en.eq(1)]
                m.next = "DONE"
            with m.State("PULSE"):
                m.d.comb += Cat(getattr(self, pulse.name) for pulse in registers.pulses).eq(marks)
                m.d.sync += marks.eq(0)
                m.next = "WAIT"
            with m.State("WAIT"), m.If(~self.commit_pending):
                m.next = "DONE"

            # A register from the snapshot to its cell, or from a written cell to the active one and to its port: bit by
            # bit, and the low half of a value first.
            with m.State("COPY"):
                m.d.comb += place.eq((step ^ 1) & ~(ACTIVE ^ WRITTEN))
                m.next = "COPIED"
            with m.State("COPIED"):
                m.d.sync += shift.eq(read.data)
                m.next = "SWEEP"
            with m.State("SWEEP"):
                m.d.comb += [place.eq(step ^ 1), area.eq(Area.LEAST)]
                m.next = "BITS"
            with m.State("BITS"):
                m.d.comb += [place.eq(step ^ 1), storing.eq(1), write.en.eq(committing)]
                m.d.sync += [left.eq(read.data), extended.eq(read.data[-1])]
                m.next = "SHIFT"
            with m.State("SHIFT"):
                fresh = left != 0
                m.d.sync += [shift.eq(Cat(shift[1:], Mux(fresh, status[0], extended & shift[-1]))), bit.eq(bit + 1)]
                with m.If(fresh):
                    m.d.sync += left.eq(left - 1)
                    with m.If(committing):
                        m.d.sync += ports.eq(Cat(ports[1:], shift[0]))
                    with m.Else():
                        m.d.sync += status.eq(status[1:])
                with m.If(bit.all()):
                    m.next = "STORE"
            with m.State("STORE"):
                m.d.comb += [place.eq(step ^ 1), storing.eq(1), write.en.eq(~committing)]
                m.d.sync += step.eq(step + 1)
                m.next = "SWEEP"
                with m.If(step == design.last_status - 1):
                    m.next = "DONE"
                with m.If(committing):
                    m.next = "COPY"
                    with m.If(step == design.last_active - 1):
                        m.d.sync += committing.eq(0)
                        m.next = "PULSE"
            with m.State("DONE"):
                m.d.comb += [host.done.eq(1), place.eq(below)]
                m.next = "IDLE"
        return m
