"""The registers of an axis: shadowed words, pulses, counters, a snapshot of every status, and windows to memories."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis.register_file import (
    CELL_BITS,
    EXCLUSIVE,
    NEXT,
    SOURCE,
    WITH_WORDS,
    Area,
    Design,
    Operation,
    Source,
)
from hardwall.model.axis.registers import ACTIVE, CAPTURE, COUNTERS, EDGE_STAMPS, END, LIVE, MAP, PULSES, WRITTEN

from ..arithmetic.fixed import less, shape
from ..link.line import UNMIXED
from ..link.requests import Requests

SWEPT = CELL_BITS + 4
"""Clocks that a snapshot takes for a cell."""


def exclusive_of(wanted: Value, names: list[str], clear: Value) -> tuple[Signal, Value, Value]:
    """Return the means to refuse a pulse beside another one of its frame, in the order of `EXCLUSIVE`.

    Args:
        wanted: the pulses that are asked for, a bit for each name.
        names: the names of all pulses.
        clear: whether a frame begins, perhaps in the clock of its first check.

    Returns:
        A register for the exclusive pulses of the frame until now, what it has after those that are asked for, and
        whether one of these is refused.
    """
    exclusive, asked = Signal(len(EXCLUSIVE)), Cat(wanted[names.index(name)] for name in EXCLUSIVE)
    before = Mux(clear, 0, exclusive)
    beside = {name: before[bit] for bit, name in enumerate(EXCLUSIVE)}
    refused = (asked[bit] & Cat(beside[other] for other in EXCLUSIVE[name]).any() for bit, name in enumerate(EXCLUSIVE))
    return exclusive, before | asked, Cat(refused).any()


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
      active words to their ports. Then all marked pulses are high for one clock, the same one; the words have been at
      their ports for a clock or more, and stay until `done`, which comes when `commit_pending` has fallen: so what is
      read back as active is in use.
    - SNAPSHOT: take the status for what is read from then on, in the turns of `design.turns`: what is taken in one turn
      is of one clock, and every value is whole. `taken_clocks` has the clock of each.

    Latency, in clocks from the first of `start` to `done`: 1 for CHECK_READ; 2 for READ, 3 of the capture memory; 3 for
    WRITE and COUNT; 4 for CHECK_WRITE; `snapshot_clocks` for SNAPSHOT; for FINISH 3 and, if a pulse of `WITH_WORDS` is
    marked, `shift_clocks` and the wait for the sample. After a reset the first `start` may come at once; it waits up to
    `boot_clocks`.

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
        """Clocks by which words that are shifted make a FINISH longer, without the wait for the sample."""
        return 2 * len(self._design.registers.words) * (CELL_BITS + 6)

    @property
    def snapshot_clocks(self) -> int:
        """Clocks from `start` of a SNAPSHOT to `done`."""
        return 2 * len(self._design.registers.status) * SWEPT + 1

    @property
    def taken_clocks(self) -> dict[str, int]:
        """Clocks from `start` of a SNAPSHOT to the one whose status is taken, by name.

        Of an edge it is the stamp as the axis shows it then, with `stepped`.
        """
        taken, begun = {}, 0
        for _, turn in self._design.turns:
            taken |= {each.name: SWEPT * begun + 3 - 2 * (each.name in EDGE_STAMPS) for each in turn}
            begun += 2 * len(turn)
        return taken

    def _edges(self, m: Module, place: Signal) -> tuple[Signal, Signal]:
        """Return one more than the stamp of the last edge of a kind, a clock after its place, and whether it has none.

        A kind's place is the address of its status, halved; four in a row differ in the two lowest bits. A place that
        is written is not read: what was read before holds, for which a place must be asked for at two clocks. Edges
        of one kind are two clocks apart, for one of another kind is between them.
        """
        places = [self._design.registers[name].address >> 1 & 3 for name in EDGE_STAMPS]
        # A memory is no logic: without the attribute so small a one would be made of flip-flops.
        of_kind = {"shape": len(self.stamp), "depth": len(places), "init": []}
        m.submodules.edges = edges = Memory(**of_kind, attrs=UNMIXED | {"ram_style": "block"})
        write, read = edges.write_port(), edges.read_port()
        stamped = Signal(len(places))
        with m.Switch(self.edge_kind):
            for kind, place_of_kind in enumerate(places):
                with m.Case(kind):
                    m.d.comb += write.addr.eq(place_of_kind)
        m.d.comb += [write.data.eq(self.stamp), write.en.eq(self.stepped), read.addr.eq(place)]
        m.d.comb += read.en.eq(~self.stepped | (write.addr != place))
        with m.If(self.stepped):
            m.d.sync += stamped.bit_select(write.addr, 1).eq(1)
        return read.data, ~stamped.bit_select(place, 1)

    def elaborate(self, platform):
        m = Module()
        design, registers, host = self._design, self._design.registers, self.host
        # The window lies behind the book, at a power of two. A depth that is one too needs no logic between the blocks
        # that the memory is made of.
        within = (max(len(design.book), len(design.map_cells)) - 1).bit_length()
        cells = design.book + [0] * ((1 << within) - len(design.book)) + design.map_cells
        m.submodules.cells = memory = Memory(shape=CELL_BITS, depth=2 << within, init=cells, attrs=UNMIXED)
        read, write = memory.read_port(), memory.write_port()

        # What there is at the address.
        address = host.address
        below = address[: END.bit_length() - 1]
        in_book, in_map, in_capture = address[len(below) :] == 0, address[14:] == MAP >> 14, Const(0)
        # Counters and pulses have one register.
        wide = in_book & (below[5:] != COUNTERS >> 5)
        in_map &= less(address[:14], len(design.map_cells))
        is_pulse = in_book & (below[4:] == PULSES >> 4)
        half = wide & ((host.first & address[0]) | (host.last & ~address[0]))
        marks = Signal(len(registers.pulses))
        wanted = Signal.like(marks)
        for bit, pulse in enumerate(registers.pulses):
            m.d.comb += wanted[bit].eq(is_pulse & (below[:4] == pulse.address % 16) & host.value[0])
        names = [pulse.name for pulse in registers.pulses]
        commit, with_words = marks[names.index("commit")], Cat(marks[names.index(name)] for name in WITH_WORDS).any()
        exclusive, after, several = exclusive_of(wanted, names, host.clear)

        # The lowest bits of the address, an area, and whether it is in the window.
        step, shift = Signal(range(END)), Signal(CELL_BITS)
        place, area, window, counting = Signal(range(END)), Signal(Area), Signal(), Signal()
        m.d.comb += [
            read.addr.eq(Cat(place, Mux(window, address[len(place) : within], area), window)),
            write.addr.eq(place),
            write.data.eq(shift + counting),
            host.data.eq(shift),
        ]
        # A memory is slow: what it gives goes to a register, and from there to the host.
        found, captured = Signal(CELL_BITS), Signal()
        m.d.comb += found.eq(read.data)
        if registers.capture:
            in_capture = (address[15:] == CAPTURE >> 15) & less(address[:15], registers.capture_registers)
            m.d.comb += self.capture_address.eq(address)
            # That memory is large, and far away: what it gives has a register of its own first.
            arrived = Signal(CELL_BITS)
            m.d.sync += arrived.eq(self.capture_data & self.capture_done.replicate(CELL_BITS))
            with m.If(captured):
                m.d.comb += found.eq(arrived)
        with m.If(host.clear):
            m.d.sync += [host.absent.eq(0), host.outside.eq(0), host.refused.eq(0), exclusive.eq(0)]

        # One subtraction compares a bound with a value: signed at the top of a value, and only as long as all above
        # it was equal.
        top, tied = ~wide | ~address[0], Signal(2, init=3)
        bound, value = Signal(CELL_BITS), Signal(CELL_BITS)
        difference = Signal(CELL_BITS + 1)
        m.d.comb += [
            bound.eq(Cat(shift[:-1], shift[-1] ^ top)),
            value.eq(Cat(host.value[:-1], host.value[-1] ^ top)),
            difference.eq(bound - value),
        ]
        equal = ~difference.any()

        # The chain: the bits of status that wait for their cells, or the words at their ports. The bits of a stamp
        # are those of a number that is 1 too high: `borrow` takes it off, bit by bit.
        stamp, unseen = self._edges(m, step[1:3])
        by_source = {source: [] for source in Source}
        for source, turn in design.turns:
            by_source[source] += [getattr(self, each.name) for each in turn if each.name not in EDGE_STAMPS]
        by_source[Source.EDGE].insert(0, stamp)
        loads = {source: Cat(values) for source, values in by_source.items()}
        ports = Cat(getattr(self, word.name) for word in registers.words)
        chain = Signal(max(len(ports), *map(len, loads.values())), reset_less=True)
        shifted = Cat(chain[1:], shift[0])
        source, left, bit = Signal(3), Signal(range(CELL_BITS + 1)), Signal(range(CELL_BITS))
        extended, borrow, hidden, last, committing = Signal(), Signal(), Signal(), Signal(), Signal()
        fresh, moving = left != 0, Signal()
        taken = (chain[0] ^ borrow) & ~hidden
        m.d.comb += ports.eq(chain[-len(ports) :])
        head = max(len(loads[each]) for each in (Source.EDGE, Source.EVENTS))
        shifted, moment, edge, events = (Cat(load, shifted[len(load) :]) for load in loads.values())
        # Two cells of four inputs a bit: the first gives one of two, or which of the two others it is. The bits of
        # `source` are three, or the one that both cells have would be one signal, which takes three cells. They are
        # words, so that a simulator has a few operations for all the bits.
        first = Mux(source[0], moment, shifted)
        which = Mux(source[1], source[0].replicate(head), first[:head])
        one_of_two = (which & events[:head]) | (~which & edge[:head])
        with m.If(moving):
            m.d.sync += chain.eq(Cat(Mux(source[2], one_of_two, which), first[head:]))

        # What `shift` takes: a cell, the host's value, or a bit of the chain.
        fetched, given, turning = Signal(), Signal(), Signal()
        turned = Cat(shift[1:], Mux(fresh, taken, extended & shift[-1]))
        with m.If(fetched | given | turning):
            m.d.sync += shift.eq(Mux(turning, turned, Mux(given, host.value, found)))

        with m.FSM():
            with m.State("BOOT"):
                m.d.comb += [place.eq(step), area.eq(Area.RESET)]
                m.next = "BOOT_TAKE"
            with m.State("BOOT_TAKE"):
                m.d.comb += fetched.eq(1)
                m.next = "BOOT_WRITE"
            with m.State("BOOT_WRITE"):
                m.d.comb += [place.eq(step), write.en.eq(1)]
                m.d.sync += step.eq(step + 1)
                m.next = "BOOT"
                with m.If(step.all()):
                    m.next = "IDLE"
            with m.State("IDLE"):
                m.d.comb += [place.eq(below), window.eq(address[14])]
                m.d.sync += committing.eq(0)
                with m.If(host.start), m.Switch(host.operation):
                    with m.Case(Operation.CHECK_READ):
                        with m.If(~(in_book | in_map | in_capture) | half):
                            m.d.sync += host.absent.eq(1)
                        if registers.capture:
                            with m.If(in_capture & ~self.capture_done):
                                m.d.sync += host.refused.eq(1)
                        m.next = "DONE"
                    with m.Case(Operation.CHECK_WRITE):
                        m.d.comb += [area.eq(Area.LEAST), window.eq(0)]
                        word = ~less(below, design.first_pulse) & less(below, design.last_word)
                        live = ~less(below, LIVE) & less(below, design.last_live)
                        with m.If(~in_book | ~(word | live) | half):
                            m.d.sync += host.absent.eq(1)
                        with m.If((wanted & self.refuse).any() | several):
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
                        m.d.sync += step.eq(registers.active[0].address + 1)
                        m.next = "PULSE"
                        with m.If(with_words):
                            m.d.sync += committing.eq(1)
                            m.next = "COPY"
                    with m.Case(Operation.SNAPSHOT):
                        m.d.sync += step.eq(design.turns[0][1][0].address + 1)
                        m.next = "SWEEP"
            with m.State("READ"):
                m.d.comb += fetched.eq(1)
                m.next = "DONE"
                if registers.capture:
                    with m.If(address[15]):
                        m.next = "READ_CAPTURE"
            if registers.capture:
                with m.State("READ_CAPTURE"):
                    m.d.comb += [fetched.eq(1), captured.eq(1)]
                    m.next = "DONE"
            with m.State("LEAST"):
                m.d.comb += [place.eq(below), area.eq(Area.MOST), fetched.eq(1)]
                m.next = "ABOVE"
            with m.State("ABOVE"):
                m.d.comb += fetched.eq(1)
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
                m.d.comb += given.eq(1)
                # The upper half has been written just before, and is still there.
                with m.If(below[6:] == LIVE >> 6), m.Switch(below[:6]):
                    for word in registers.live:
                        with m.Case(word.address - LIVE + 1):
                            m.d.sync += getattr(self, word.name).eq(Cat(host.value, shift))
                m.next = "KEEP"
            with m.State("KEEP"):
                m.d.comb += [place.eq(below), write.en.eq(~is_pulse)]
                m.next = "DONE"
            with m.State("COUNT"):
                m.d.comb += fetched.eq(1)
                m.next = "COUNTED"
            with m.State("COUNTED"):
                m.d.comb += [place.eq(below), counting.eq(1), write.en.eq(1)]
                m.next = "DONE"
            with m.State("PULSE"):
                m.d.comb += Cat(getattr(self, name) for name in names).eq(marks)
                m.d.sync += marks.eq(0)
                m.next = "WAIT"
            with m.State("WAIT"), m.If(~self.commit_pending):
                m.next = "DONE"

            # A register from the chain to its cell, or from a written cell to the active one and to its port: bit by
            # bit, and the low half of a value first.
            with m.State("COPY"):
                m.d.comb += place.eq(step)
                with m.If(commit):
                    m.d.comb += place.eq(step & ~(ACTIVE ^ WRITTEN))
                m.next = "COPIED"
            with m.State("COPIED"):
                m.d.comb += fetched.eq(1)
                m.next = "SWEEP"
            with m.State("SWEEP"):
                m.d.comb += [place.eq(step), area.eq(Area.LEAST)]
                m.next = "LOOK"
            with m.State("LOOK"):
                m.d.comb += [place.eq(step), area.eq(Area.LEAST), write.en.eq(committing)]
                m.d.sync += [left.eq(read.data), source.eq(read.data[SOURCE:]), extended.eq(read.data[-1])]
                # The block of a cell that follows has no zero address.
                m.d.sync += last.eq(~read.data[NEXT + 4 : SOURCE].any())
                with m.If(step[0]):
                    stamped = read.data[SOURCE : SOURCE + 3] == Source.EDGE
                    m.d.sync += [borrow.eq(stamped), hidden.eq(stamped & unseen)]
                m.next = "LOAD"
            with m.State("LOAD"):
                m.d.comb += [place.eq(step), area.eq(Area.LEAST), moving.eq(source != Source.NOTHING)]
                m.d.sync += [source.eq(Source.NOTHING), bit.eq(0)]
                m.next = "SHIFT"
            with m.State("SHIFT"):
                m.d.comb += [place.eq(step), area.eq(Area.LEAST), moving.eq(fresh)]
                m.d.comb += turning.eq(1)
                m.d.sync += bit.eq(bit + 1)
                with m.If(fresh):
                    m.d.sync += [left.eq(left - 1), borrow.eq(borrow & ~chain[0])]
                with m.If(bit.all()):
                    m.next = "STORE"
            with m.State("STORE"):
                m.d.comb += [place.eq(step), write.en.eq(~committing)]
                m.d.sync += step.eq(Cat(~step[0], read.data[NEXT:SOURCE]))
                m.next = "SWEEP"
                with m.If(committing):
                    m.next = "COPY"
                with m.If(last):
                    m.next = "DONE"
                    with m.If(committing):
                        m.next = "PULSE"
            with m.State("DONE"):
                m.d.comb += host.done.eq(1)
                m.next = "IDLE"
        return m
