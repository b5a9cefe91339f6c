"""The registers of several axes: a bank of cells an axis, words that go out by number, and a snapshot of one axis."""

from amaranth.hdl import Cat, Const, Module, Mux, Shape, ShapeLike, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axes.register_file import Design
from hardwall.model.axes.registers import BANK, is_shared
from hardwall.model.axis.register_file import CELL_BITS, Area, Operation
from hardwall.model.axis.registers import (
    ACTIVE,
    CAPTURE,
    COUNTERS,
    END,
    LIVE,
    MAP,
    PULSES,
    SUPERVISOR,
    TELEMETRY,
    WRITTEN,
)
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.register import Kind, Register

from ..arithmetic.fixed import less, shape
from ..axis.register_file import exclusive_of
from ..link.axis_status import Moments, held_status, shown, word_of
from ..link.line import UNMIXED
from ..link.requests import Requests


def _given(design: Design) -> dict[str, ShapeLike]:
    """Return the shapes of what comes out beside the answers, by the names of the members."""
    registers, words = design.registers, design.axes.words
    return {
        "word_write": 1,
        "word_axis": range(max(design.banks, 2)),
        "word_number": range(len(words)),
        "word_value": max(word.format.width for word in words),
        **{name: shape(registers[name].format) for name in ("preload_count", "acknowledged")},
        **{word.name: shape(word.format) for word in registers.shared if word.kind is Kind.LIVE},
        **{pulse.name: 1 if is_shared(pulse) else design.banks for pulse in registers.pulses},
        **({"capture_address": 15} if registers.capture else {}),
    }


class BankedFile(wiring.Component):
    """A memory of cells of 16 bits, a bank for each axis, and what joins it to `SupervisedAxes`.

    Equation: the model's, word for word. Operations, by `host.operation`:

    - CHECK_READ, CHECK_WRITE: raise `absent`, `outside` or `refused` if the register cannot be read, or written with
      `host.value`, or not now. The halves of a value are checked in the order of their addresses, one after the other.
      `arm` is refused unless the last turn of its axis was `ready`, `preload` and `origin_shift` if it was ARMED, and
      a pulse beside one of `EXCLUSIVE` since `clear`; the capture memory, unless it is done. A CHECK_READ of a status
      lets the next SNAPSHOT take that axis's.
    - READ: give the register; of a status, in whichever bank, that of the last snapshot.
    - WRITE: keep the value of a word, or of a counter; mark a pulse if the value is 1. A live word goes to its axis
      with its lower half, which is written after the upper one. Only what was checked is written.
    - COUNT: add 1 to a counter, which wraps.
    - FINISH: if `commit` is marked, copy every written word of the bank of the last WRITE to its active one, and write
      it to that axis. Then all marked pulses are high for one clock, the same one, with `preload_count` and
      `acknowledged`, which stay. `done` comes when every axis has had an actuation and a turn since: so what is read
      back as active is in use, what is read of a status is of a sample behind the pulses, what is refused is known, the
      drive of a moved count is that of its new place, and no acknowledgement takes another one's place.
    - SNAPSHOT: take the status of the axis that CHECK_READ was asked for, if any: all of one sample, the next one, with
      the stamp of the clock of its record. The stamps of edges are those of the last edges in that sample's count, each
      0 until there was one: they are remembered here, for every axis.

    Latency, in clocks from the first of `start` to `done`: 1 for CHECK_READ; 2 for READ, 3 of the capture memory; 3 for
    WRITE and COUNT; 4 for CHECK_WRITE; for SNAPSHOT 1, or 1 more than it takes until the axis's next strobe, the record
    of that sample and the turn behind that; for FINISH 1, or `finish_clocks` if anything is marked. After a reset the
    first `start` may come at once; it waits for `boot_clocks`, and for `word_ready`.

    Rounding and overflow: a value of fewer bits than its registers is extended by its sign or by zeros; one of more
    bits, a velocity, gives its upper ones.

    Reset: every cell is as after a reset when the first operation is done, and no pulse is marked.

    Parameters
    ----------
    design : hardwall.model.axes.register_file.Design
        The registers.

    Members
    -------
    host : In(Requests)
        The operations.
    the outputs of `SupervisedAxes` that show samples, turns, and what else is status of an axis : In
        As there.
    its inputs but for the pins : Out
        As there: those to write words, the host's own, and a pulse for each axis.
    the inputs and outputs of `AxesCapture` that begin with `capture_`, if there is a capture memory : In and Out
        As there.

    Raises
    ------
    TypeError
        If `design` is not a Design.
    """

    def __init__(self, design: Design):
        if not isinstance(design, Design):
            raise TypeError(f"design must be a banked_file.Design, not {design!r}")
        self._design = design
        registers = design.registers
        first = {word.name: word.reset for word in registers.shared}
        super().__init__(
            {
                "host": In(Requests()),
                **{name: In(each) for name, each in shown(design).items()},
                **({"capture_data": In(CELL_BITS), "capture_done": In(1)} if registers.capture else {}),
                **{name: Out(each, init=first.get(name, 0)) for name, each in _given(design).items()},
            }
        )

    @property
    def design(self) -> Design:
        return self._design

    @property
    def ports(self) -> dict[str, Member]:
        """The members to the axes: all but `host`."""
        return {name: member for name, member in self.signature.members.items() if name != "host"}

    @property
    def boot_clocks(self) -> int:
        """Clocks after a reset until an operation begins, if words can be written by then."""
        return 3 * BANK * self._design.banks + 1

    @property
    def finish_clocks(self) -> dict[bool, int]:
        """Clocks from `start` of a FINISH with marks to `done`, by whether `commit` is marked."""
        walked = {True: len(self._design.registers.words) + 2, False: 2}
        return {commits: 2 * 3 * words + 3 + self._design.settle_clocks for commits, words in walked.items()}

    def _refused(self, m: Module, wanted: Value, asking: Value) -> Value:
        """Return whether a pulse that is wanted of an axis is refused, after what its last turn has shown."""
        banks = self._design.banks
        ready, armed = Signal(banks), Signal(banks)
        for axis in range(banks):
            with m.If(self.turn_valid & (self.turn_axis == axis)):
                m.d.sync += [ready[axis].eq(self.turn_ready), armed[axis].eq(self.turn_state == ARMED)]
        moving = word_of(armed, asking, banks)
        refusing = {"arm": ~word_of(ready, asking, banks), "preload": moving, "origin_shift": moving}
        names = [pulse.name for pulse in self._design.registers.pulses]
        return Cat(wanted[bit] & refusing[name] for bit, name in enumerate(names) if name in refusing).any()

    def elaborate(self, platform):
        m = Module()
        design, registers, host = self._design, self._design.registers, self.host
        banks = design.banks
        # Cells of all banks; and what never changes: the areas of one bank, and behind them the window to the map.
        within = (max(len(design.book), len(design.map_cells)) - 1).bit_length()
        book = design.book + [0] * ((1 << within) - len(design.book)) + design.map_cells
        depth = 1 << (BANK * banks - 1).bit_length()
        m.submodules.cells = cells = Memory(shape=CELL_BITS, depth=depth, init=[], attrs=UNMIXED)
        m.submodules.book = fixed = Memory(shape=CELL_BITS, depth=2 << within, init=book, attrs=UNMIXED)
        cell, write, text = cells.read_port(), cells.write_port(), fixed.read_port()

        # What there is at the address.
        address = host.address
        place, bank = address[: (END - 1).bit_length()], address[(END - 1).bit_length() : (depth - 1).bit_length()]
        in_map, in_capture = (address[14:] == MAP >> 14) & less(address[:14], len(design.map_cells)), Const(0)
        # Each is a signal of its own: an expression would be written out wherever it is asked for.
        in_banks, wide, is_pulse, is_status = Signal(), Signal(), Signal(), Signal()
        status_places = Cat(place[5:] == block >> 5 for block in (TELEMETRY, SUPERVISOR)).any()
        m.d.comb += [
            in_banks.eq(less(address, BANK * banks)),
            # Counters and pulses have one register.
            wide.eq(in_banks & (place[5:] != COUNTERS >> 5)),
            is_pulse.eq(in_banks & (place[4:] == PULSES >> 4)),
            is_status.eq(in_banks & status_places),
        ]
        half = wide & ((host.first & place[0]) | (host.last & ~place[0]))
        marks = Signal(len(registers.pulses))
        wanted = Signal.like(marks)
        for bit, pulse in enumerate(registers.pulses):
            m.d.comb += wanted[bit].eq(is_pulse & (place[:4] == pulse.address % 16) & host.value[0])

        # The axis at the address, the one that a frame writes to, and the one whose status it reads, if any.
        here, to, asked = (Signal(range(max(banks, 2)), name=name) for name in ("here", "to", "asked"))
        asks = Signal()
        m.d.comb += here.eq(bank)
        names = [pulse.name for pulse in registers.pulses]
        exclusive, after, several = exclusive_of(wanted, names, host.clear)
        refused = self._refused(m, wanted, here) | several
        with m.If(host.clear):
            m.d.sync += [host.absent.eq(0), host.outside.eq(0), host.refused.eq(0), asks.eq(0), exclusive.eq(0)]

        # What `shift` takes: a cell, a text, a status, or the host's value. What it had goes to `upper`.
        shift, upper = Signal(CELL_BITS), Signal(CELL_BITS)
        moments = Moments(*(Signal(name=name) for name in Moments._fields))
        status = held_status(m, self, asked, moments)
        takes = {"value": host.value, "status": status}
        if registers.capture:
            in_capture = (address[15:] == CAPTURE >> 15) & less(address[:15], registers.capture_registers)
            # That memory is large, and far away: what it gives has a register of its own first.
            takes["capture"] = arrived = Signal(CELL_BITS)
            m.d.comb += self.capture_address.eq(address)
            m.d.sync += arrived.eq(self.capture_data & self.capture_done.replicate(CELL_BITS))
        # A memory is slow, and the last of these has the shortest way.
        takes |= {"text": text.data, "cell": cell.data}
        taking = {name: Signal(name=f"taking_{name}") for name in takes}
        for name, taken in taking.items():
            with m.If(taken):
                m.d.sync += [shift.eq(takes[name]), upper.eq(shift)]

        # One subtraction compares a bound with a value: signed at the top of a value, and only as long as all above
        # it was equal.
        top, tied, difference = ~wide | ~place[0], Signal(2, init=3), Signal(CELL_BITS + 1)
        bound, value = (Cat(each[:-1], each[-1] ^ top) for each in (shift, host.value))
        m.d.comb += [difference.eq(bound - value), host.data.eq(shift)]
        equal = ~difference.any()

        # A walk through cells: all of them after a reset; and at a FINISH the words of a bank, and behind them the
        # count of a preload and the causes that the host has read.
        words, commit = len(registers.words), marks[names.index("commit")]
        step, low, settling = Signal(range(BANK * banks)), Signal(), Signal(range(design.settle_clocks + 1))
        count, causes = registers["active_preload_count"].address, registers["acknowledged"].address
        copies, halfway = Signal(), Signal(range(END - WRITTEN))
        m.d.comb += copies.eq(less(step, words))
        beside = Mux(step == words, count - WRITTEN, causes - WRITTEN)
        m.d.comb += halfway.eq(Mux(copies, Cat(low, step[:4]), beside | low))
        walked = halfway | WRITTEN

        area, window = Signal(Area), Signal()
        m.d.comb += [
            text.addr.eq(Cat(place, Mux(window, address[len(place) : within], area), window)),
            cell.addr.eq(Cat(place, bank)),
            write.addr.eq(Cat(place, bank)),
            write.data.eq(shift),
        ]
        m.d.sync += [self.word_write.eq(0), *(getattr(self, pulse.name).eq(0) for pulse in registers.pulses)]

        def give(word: Register, axis: Value, value: Value):
            """Give a word that is whole to its port, or to the axis."""
            if is_shared(word):
                m.d.sync += getattr(self, word.name).eq(value)
            elif (number := design.numbers.get(word.address + 1)) is not None:
                m.d.sync += [self.word_write.eq(1), self.word_axis.eq(axis), self.word_number.eq(number)]
                m.d.sync += self.word_value.eq(value)

        with m.FSM():
            with m.State("BOOT"):
                m.d.comb += text.addr.eq(Cat(step[: len(place)], Const(Area.RESET, Shape.cast(Area))))
                m.next = "BOOT_TAKE"
            with m.State("BOOT_TAKE"):
                m.d.comb += taking["text"].eq(1)
                m.next = "BOOT_STORE"
            with m.State("BOOT_STORE"):
                begun = step[: len(place)]
                once = less(begun, TELEMETRY) | Cat(begun == own for own in sorted(design.own_places)).any()
                m.d.comb += [write.addr.eq(step), write.en.eq(1)]
                with m.If(once & step[len(place) :].any()):
                    m.d.comb += write.data.eq(0)
                m.d.sync += step.eq(step + 1)
                m.next = "BOOT"
                with m.If(step == BANK * banks - 1):
                    m.next = "BEGIN"
            with m.State("BEGIN"), m.If(self.word_ready):
                m.next = "IDLE"
            with m.State("IDLE"):
                m.d.comb += window.eq(address[14])
                m.d.sync += low.eq(0)
                with m.If(host.start), m.Switch(host.operation):
                    with m.Case(Operation.CHECK_READ):
                        with m.If(~(in_banks | in_map | in_capture) | half):
                            m.d.sync += host.absent.eq(1)
                        if registers.capture:
                            with m.If(in_capture & ~self.capture_done):
                                m.d.sync += host.refused.eq(1)
                        with m.If(is_status):
                            m.d.sync += [asks.eq(1), asked.eq(here)]
                        m.next = "DONE"
                    with m.Case(Operation.CHECK_WRITE):
                        m.d.comb += [area.eq(Area.LEAST), window.eq(0)]
                        word = ~less(place, design.first_pulse) & less(place, design.last_word)
                        live = ~less(place, LIVE) & less(place, design.last_live)
                        own = Cat(place == each for each in sorted(design.own_places)).any() & bank.any()
                        with m.If(~in_banks | ~(word | live) | own | half):
                            m.d.sync += host.absent.eq(1)
                        with m.If(refused):
                            m.d.sync += host.refused.eq(1)
                        m.d.sync += exclusive.eq(after)
                        m.next = "LEAST"
                    with m.Case(Operation.READ):
                        m.next = "READ"
                    with m.Case(Operation.WRITE):
                        m.next = "TAKE"
                        m.d.sync += marks.eq(marks | wanted)
                    with m.Case(Operation.COUNT):
                        m.next = "COUNT"
                    with m.Case(Operation.FINISH):
                        m.d.sync += step.eq(Mux(commit, 0, words))
                        m.next = "DONE"
                        with m.If(marks.any()):
                            m.next = "WALK"
                    with m.Case(Operation.SNAPSHOT):
                        m.next = "DONE"
                        with m.If(asks):
                            m.next = "STROBE"
            with m.State("READ"):
                m.d.comb += [
                    taking["status"].eq(is_status),
                    taking["cell"].eq(in_banks & ~is_status),
                    taking["text"].eq(~in_banks),
                ]
                m.next = "DONE"
                if registers.capture:
                    with m.If(address[15]):
                        m.next = "READ_CAPTURE"
            if registers.capture:
                with m.State("READ_CAPTURE"):
                    m.d.comb += taking["capture"].eq(1)
                    m.next = "DONE"
            with m.State("LEAST"):
                m.d.comb += [area.eq(Area.MOST), taking["text"].eq(1)]
                m.next = "ABOVE"
            with m.State("ABOVE"):
                m.d.comb += taking["text"].eq(1)
                m.d.sync += tied[0].eq((top | tied[0]) & equal)
                with m.If((top | tied[0]) & ~difference[-1] & ~equal):
                    m.d.sync += host.outside.eq(1)
                m.next = "BELOW"
            with m.State("BELOW"):
                m.d.sync += tied[1].eq((top | tied[1]) & equal)
                with m.If((top | tied[1]) & difference[-1]):
                    m.d.sync += host.outside.eq(1)
                m.next = "DONE"
            with m.State("TAKE"):
                m.d.comb += taking["value"].eq(1)
                m.d.sync += to.eq(here)
                # The upper half has been written just before, and is still there.
                with m.Switch(place):
                    for word in registers.live:
                        with m.Case(word.address + 1):
                            give(word, here, Cat(host.value, shift))
                m.next = "KEEP"
            with m.State("KEEP"):
                m.d.comb += write.en.eq(~is_pulse)
                m.next = "DONE"
            with m.State("COUNT"):
                m.d.comb += taking["cell"].eq(1)
                m.next = "COUNTED"
            with m.State("COUNTED"):
                m.d.comb += [write.data.eq(shift + 1), write.en.eq(1)]
                m.next = "DONE"

            # The high half of a value first, and then both are there.
            with m.State("WALK"):
                m.d.comb += cell.addr.eq(Cat(walked, to))
                m.next = "WALKED"
            with m.State("WALKED"):
                m.d.comb += taking["cell"].eq(1)
                m.next = "WALK_STORE"
            with m.State("WALK_STORE"):
                m.d.comb += [write.addr.eq(Cat(walked ^ (ACTIVE ^ WRITTEN), to)), write.en.eq(copies)]
                m.d.sync += [low.eq(~low), step.eq(step + low)]
                m.next = "WALK"
                with m.If(low), m.Switch(step):
                    for at, word in enumerate(registers.words):
                        with m.Case(at):
                            give(word, to, Cat(shift, upper))
                    with m.Case(words):
                        m.d.sync += self.preload_count.eq(Cat(shift, upper))
                    with m.Case(words + 1):
                        m.d.sync += [self.acknowledged.eq(Cat(shift, upper)), step.eq(0)]
                        m.next = "PULSE"
            with m.State("PULSE"):
                for bit, pulse in enumerate(registers.pulses):
                    # One of all axes has a single bit, which is that of the only bank that it is written to in.
                    m.d.sync += getattr(self, pulse.name).eq(Mux(marks[bit], Const(1) << to, 0))
                m.d.sync += [marks.eq(0), settling.eq(design.settle_clocks)]
                m.next = "SETTLE"
            with m.State("SETTLE"):
                m.d.sync += settling.eq(settling - 1)
                with m.If(settling == 0):
                    m.next = "DONE"

            # Samples of the axis may be under way already: the record that counts comes as late as it takes.
            with m.State("STROBE"), m.If(self.strobe & (self.strobe_axis == asked)):
                m.next = "STROBED"
            with m.State("STROBED"):
                m.d.comb += moments.strobed.eq(1)
                m.d.sync += settling.eq(design.axes.spec.latency - 1)
                m.next = "RECORD"
            with m.State("RECORD"):
                m.d.sync += settling.eq(settling - settling.any())
                shows = self.record_valid & (self.record_axis == asked)
                m.d.comb += moments.recorded.eq(shows & (settling == 0))
                with m.If(moments.recorded):
                    m.next = "TURN"
            with m.State("TURN"):
                m.d.comb += moments.turned.eq(self.turn_valid & (self.turn_axis == asked))
                m.d.sync += asks.eq(0)
                with m.If(moments.turned):
                    m.next = "DONE"
            with m.State("DONE"):
                m.d.comb += host.done.eq(1)
                m.next = "IDLE"
        return m
