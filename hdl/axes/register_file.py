"""The registers of several axes: a bank of cells an axis, words that go out by number, and a snapshot of one axis."""

from amaranth.hdl import Cat, Const, Module, Mux, Shape, ShapeLike, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axes.register_file import Design
from hardwall.model.axes.registers import BANK, is_shared
from hardwall.model.axis.register_file import CELL_BITS, Area, Operation
from hardwall.model.axis.registers import ACTIVE, END, LIVE, TELEMETRY, WRITTEN
from hardwall.model.register import Kind, Register

from ..arithmetic.fixed import less, shape
from ..link.axis_status import shown
from ..link.checks import Bounds, Pulses, check_read
from ..link.requests import Requests
from ..wires import given, port
from .at_address import At, Axes, at_address, refused
from .commit_walk import CommitWalk
from .register_cells import Cells


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
      `arm` is refused unless the last turn of its axis was `ready`. `preload` and `origin_shift` are refused if the
      axis was ARMED. A pulse is refused beside one of `EXCLUSIVE` since `clear`. The capture memory is refused unless
      it is done. A CHECK_READ of a status lets the next SNAPSHOT take that axis's.
    - READ: give the register; a status of any bank comes from the last snapshot.
    - WRITE: keep the value of a word, or of a counter; mark a pulse if the value is 1. A live word goes to its axis
      with its lower half, which is written after the upper one. Only what was checked is written.
    - COUNT: add 1 to a counter, which wraps.
    - FINISH: if `commit` is marked, copy every written word of the bank of the last WRITE to its active one, and write
      it to that axis. Then all marked pulses are high for one clock, the same one, with `preload_count` and
      `acknowledged`, which stay. `done` comes when every axis has had an actuation and a turn since. So words that are
      read back as active are in use. A status read then is of a sample after the pulses. Refusals are known. The drive
      of a moved count belongs to its new place. No acknowledgement takes another one's place.
    - SNAPSHOT: take the status of the axis that CHECK_READ was asked for, if any: all of one sample, the next one, with
      the stamp of the clock of its record. The stamps of the last edges in that sample's count are remembered here for
      every axis, each 0 until there is one.

    Latency, in clocks from the first of `start` to `done`: 1 for CHECK_READ; 2 for READ, 3 of the capture memory; 3 for
    WRITE and COUNT; 4 for CHECK_WRITE. SNAPSHOT takes 1, or 1 more than the time until the axis's next strobe, the
    record of that sample and the turn behind it. FINISH takes 1, or `finish_clocks` if anything is marked. After a
    reset the first `start` may come at once; it waits for `boot_clocks`, and for `word_ready`.

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

    def elaborate(self, platform):
        m = Module()
        design, host = self._design, self.host
        cells = Cells(m, design)
        at = at_address(m, self, cells.depth)
        pulses = Pulses(m, host, design.registers, at.is_pulse, at.place)
        here, to, asked = (Signal(range(max(design.banks, 2)), name=name) for name in ("here", "to", "asked"))
        asks = Signal()
        m.d.comb += here.eq(at.bank)
        axes = Axes(here, to, asked, asks)
        refuses = refused(m, self, pulses.wanted, here) | pulses.several
        pulses.begin(m, host, asks.eq(0))
        cells.take(m, self, asked)
        bounds = self._bounds(m, at, cells.shift)
        walk = CommitWalk(m, design, pulses.marked("commit"))
        cells.address(m, host.address, at.place, at.bank)
        m.d.sync += [self.word_write.eq(0), *given(self, dict.fromkeys(pulses.names, 0))]
        with m.FSM():
            self._boot(m, cells, walk)
            with m.State("IDLE"):
                m.d.comb += cells.window.eq(host.address[14])
                m.d.sync += walk.low.eq(0)
                with m.If(host.start), m.Switch(host.operation):
                    self._check(m, at, axes, pulses, refuses, cells)
                    self._begin(m, pulses, axes, walk)
            self._read(m, at, cells)
            text = cells.taking["text"]
            bounds.add_states(m, host, [cells.area.eq(Area.MOST), text.eq(1)], [text.eq(1)])
            self._write(m, at, axes, cells)
            self._walk(m, axes, walk, cells)
            self._give_pulses(m, axes, pulses, walk)
            self._snapshot(m, axes, walk, cells)
            with m.State("DONE"):
                m.d.comb += host.done.eq(1)
                m.next = "IDLE"
        return m

    def _bounds(self, m: Module, at: At, shift: Signal) -> Bounds:
        """Return the comparison of a bound, which is fetched, with the host's value."""
        top, tied, difference = ~at.wide | ~at.place[0], Signal(2, init=3), Signal(CELL_BITS + 1)
        bound, value = (Cat(each[:-1], each[-1] ^ top) for each in (shift, self.host.value))
        m.d.comb += [difference.eq(bound - value), self.host.data.eq(shift)]
        return Bounds(top, tied, difference)

    def _give(self, m: Module, word: Register, axis: Value, value: Value) -> None:
        """Give a word that is whole to its port, or to the axis."""
        if is_shared(word):
            m.d.sync += port(self, word.name).eq(value)
        elif (number := self._design.numbers.get(word.address + 1)) is not None:
            m.d.sync += [self.word_write.eq(1), self.word_axis.eq(axis), self.word_number.eq(number)]
            m.d.sync += self.word_value.eq(value)

    def _boot(self, m: Module, cells: Cells, walk: CommitWalk) -> None:
        """Add the states that write every cell after a reset."""
        design, step = self._design, walk.step
        bits = (END - 1).bit_length()
        with m.State("BOOT"):
            m.d.comb += cells.text.addr.eq(Cat(step[:bits], Const(Area.RESET, Shape.cast(Area))))
            m.next = "BOOT_TAKE"
        with m.State("BOOT_TAKE"):
            m.d.comb += cells.taking["text"].eq(1)
            m.next = "BOOT_STORE"
        with m.State("BOOT_STORE"):
            begun = step[:bits]
            once = less(begun, TELEMETRY) | Cat(begun == own for own in sorted(design.own_places)).any()
            m.d.comb += [cells.write.addr.eq(step), cells.write.en.eq(1)]
            with m.If(once & step[bits:].any()):
                m.d.comb += cells.write.data.eq(0)
            m.d.sync += step.eq(step + 1)
            m.next = "BOOT"
            with m.If(step == BANK * design.banks - 1):
                m.next = "BEGIN"
        with m.State("BEGIN"), m.If(self.word_ready):
            m.next = "IDLE"

    def _check(self, m: Module, at: At, axes: Axes, pulses: Pulses, refused: Value, cells: Cells) -> None:
        """Add the cases of the operations that check."""
        design, place = self._design, at.place
        with m.Case(Operation.CHECK_READ):
            check_read(m, self, ~(at.in_banks | at.in_map | at.in_capture) | at.half, at.in_capture)
            with m.If(at.is_status):
                m.d.sync += [axes.asks.eq(1), axes.asked.eq(axes.here)]
            m.next = "DONE"
        with m.Case(Operation.CHECK_WRITE):
            m.d.comb += [cells.area.eq(Area.LEAST), cells.window.eq(0)]
            word = ~less(place, design.first_pulse) & less(place, design.last_word)
            live = ~less(place, LIVE) & less(place, design.last_live)
            own = Cat(place == each for each in sorted(design.own_places)).any() & at.bank.any()
            pulses.check(m, self.host, ~at.in_banks | ~(word | live) | own | at.half, refused)
            m.next = "LEAST"

    def _begin(self, m: Module, pulses: Pulses, axes: Axes, walk: CommitWalk) -> None:
        """Add the cases of the other operations."""
        with m.Case(Operation.READ):
            m.next = "READ"
        with m.Case(Operation.WRITE):
            m.next = "TAKE"
            m.d.sync += pulses.marks.eq(pulses.marks | pulses.wanted)
        with m.Case(Operation.COUNT):
            m.next = "COUNT"
        with m.Case(Operation.FINISH):
            m.d.sync += walk.step.eq(walk.begin)
            m.next = "DONE"
            with m.If(pulses.marks.any()):
                m.next = "WALK"
        with m.Case(Operation.SNAPSHOT):
            m.next = "DONE"
            with m.If(axes.asks):
                m.next = "STROBE"

    def _read(self, m: Module, at: At, cells: Cells) -> None:
        """Add the states of a READ."""
        taking, captures = cells.taking, self._design.registers.capture
        with m.State("READ"):
            m.d.comb += [
                taking["status"].eq(at.is_status),
                taking["cell"].eq(at.in_banks & ~at.is_status),
                taking["text"].eq(~at.in_banks),
            ]
            m.next = "DONE"
            if captures:
                with m.If(self.host.address[15]):
                    m.next = "READ_CAPTURE"
        if captures:
            with m.State("READ_CAPTURE"):
                m.d.comb += taking["capture"].eq(1)
                m.next = "DONE"

    def _write(self, m: Module, at: At, axes: Axes, cells: Cells) -> None:
        """Add the states of a WRITE and of a COUNT."""
        with m.State("TAKE"):
            m.d.comb += cells.taking["value"].eq(1)
            m.d.sync += axes.to.eq(axes.here)
            # The upper half has been written just before, and is still there.
            with m.Switch(at.place):
                for word in self._design.registers.live:
                    with m.Case(word.address + 1):
                        self._give(m, word, axes.here, Cat(self.host.value, cells.shift))
            m.next = "KEEP"
        with m.State("KEEP"):
            m.d.comb += cells.write.en.eq(~at.is_pulse)
            m.next = "DONE"
        with m.State("COUNT"):
            m.d.comb += cells.taking["cell"].eq(1)
            m.next = "COUNTED"
        with m.State("COUNTED"):
            m.d.comb += [cells.write.data.eq(cells.shift + 1), cells.write.en.eq(1)]
            m.next = "DONE"

    def _walk(self, m: Module, axes: Axes, walk: CommitWalk, cells: Cells) -> None:
        """Add the states of a walk. The high half of a value comes first, and then both are there."""
        shift, upper, words = cells.shift, cells.upper, self._design.registers.words
        with m.State("WALK"):
            m.d.comb += cells.cell.addr.eq(Cat(walk.place, axes.to))
            m.next = "WALKED"
        with m.State("WALKED"):
            m.d.comb += cells.taking["cell"].eq(1)
            m.next = "WALK_STORE"
        with m.State("WALK_STORE"):
            m.d.comb += [cells.write.addr.eq(Cat(walk.place ^ (ACTIVE ^ WRITTEN), axes.to))]
            m.d.comb += cells.write.en.eq(walk.copies)
            m.d.sync += [walk.low.eq(~walk.low), walk.step.eq(walk.step + walk.low)]
            m.next = "WALK"
            with m.If(walk.low), m.Switch(walk.step):
                for number, word in enumerate(words):
                    with m.Case(number):
                        self._give(m, word, axes.to, Cat(shift, upper))
                with m.Case(len(words)):
                    m.d.sync += self.preload_count.eq(Cat(shift, upper))
                with m.Case(len(words) + 1):
                    m.d.sync += [self.acknowledged.eq(Cat(shift, upper)), walk.step.eq(0)]
                    m.next = "PULSE"

    def _give_pulses(self, m: Module, axes: Axes, pulses: Pulses, walk: CommitWalk) -> None:
        """Add the states that give the pulses, and wait until they have acted."""
        with m.State("PULSE"):
            # A pulse for all axes has a single bit: the bit of the only bank in which it is written.
            for bit, name in enumerate(pulses.names):
                m.d.sync += port(self, name).eq(Mux(pulses.marks[bit], Const(1) << axes.to, 0))
            m.d.sync += [pulses.marks.eq(0), walk.settling.eq(self._design.settle_clocks)]
            m.next = "SETTLE"
        with m.State("SETTLE"):
            m.d.sync += walk.settling.eq(walk.settling - 1)
            with m.If(walk.settling == 0):
                m.next = "DONE"

    def _snapshot(self, m: Module, axes: Axes, walk: CommitWalk, cells: Cells) -> None:
        """Add the states of a SNAPSHOT.

        Samples of the axis may be under way already: the record that counts comes as late as it takes.
        """
        asked, moments, settling = axes.asked, cells.moments, walk.settling
        with m.State("STROBE"), m.If(self.strobe & (self.strobe_axis == asked)):
            m.next = "STROBED"
        with m.State("STROBED"):
            m.d.comb += moments.strobed.eq(1)
            m.d.sync += settling.eq(self._design.axes.spec.latency - 1)
            m.next = "RECORD"
        with m.State("RECORD"):
            m.d.sync += settling.eq(settling - settling.any())
            shows = self.record_valid & (self.record_axis == asked)
            m.d.comb += moments.recorded.eq(shows & (settling == 0))
            with m.If(moments.recorded):
                m.next = "TURN"
        with m.State("TURN"):
            m.d.comb += moments.turned.eq(self.turn_valid & (self.turn_axis == asked))
            m.d.sync += axes.asks.eq(0)
            with m.If(moments.turned):
                m.next = "DONE"
