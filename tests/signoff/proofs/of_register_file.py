"""What the register file promises: no pulse and no live word without a write to it, and an end to every operation."""

from amaranth.hdl import Cat, Mux, Signal, Value
from amaranth.lib.wiring import PureInterface

from hardwall.hdl.axes.register_file import BankedFile
from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.hdl.link.checks import Pulses
from hardwall.model.axis.register_file import CELL_BITS, EXCLUSIVE, WITH_WORDS, Area, Design, Operation
from hardwall.model.axis.registers import END, RegisterMap
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property

WHERE = "register file mhz fdm"


def register_file(bench: Bench) -> RegisterFile:
    """Return a register file whose host keeps what it asks for until it is done."""
    block = bench.block(RegisterFile(Design(RegisterMap(spec("mhz", "fdm")))))
    host = block.host
    bench.assume(bench.kept((host.start, host.operation, host.address, host.value), host.start & ~host.done))
    return block


def pulses_are_asked_for(bench: Bench) -> None:
    block = register_file(bench)
    host, writes, finishes = block.host, Signal(), Signal()
    bench.m.d.comb += [
        writes.eq(host.start & (host.operation == Operation.WRITE)),
        finishes.eq(host.start & (host.operation == Operation.FINISH)),
    ]
    sending = bench.state("PULSE")
    bench.promise(~sending | finishes)
    moving = bench.state("SWEEP", "LOOK", "LOAD", "SHIFT", "STORE")
    bench.promise(~(moving & bench.inner["committing"] | bench.state("COPY", "COPIED")) | finishes)
    bench.promise(~bench.state("COPY", "COPIED") | bench.inner["committing"])
    for number, pulse in enumerate(block.design.registers.pulses):
        asked, sent = Signal(name=f"asked_{pulse.name}"), getattr(block, pulse.name)
        with bench.m.If(writes & (host.address == pulse.address) & host.value[0]):
            bench.m.d.sync += asked.eq(1)
        with bench.m.Elif(sending):
            bench.m.d.sync += asked.eq(0)
        bench.promise(~bench.inner["marks"][number] | asked)
        bench.promise(~sent | asked & finishes)
        bench.promise(~sent | ~bench.past(sent))


def a_frame_does_one(bench: Bench, block: RegisterFile | BankedFile, asks: list[Value]) -> None:
    """Promise that of pulses that exclude each other one frame does one at most.

    What is written was checked since the last clear, and no check has found anything. A clear is before the writes.

    Args:
        bench: the bench.
        block: the register file, or that of several axes.
        asks: for every one of `EXCLUSIVE`, whether the host's address and value ask for it.
    """
    host, checked, names = block.host, Signal(len(EXCLUSIVE)), [each.name for each in block.design.registers.pulses]
    marks = Cat(bench.inner["marks"][names.index(name)] for name in EXCLUSIVE)
    checks = bench.state("IDLE") & host.start & (host.operation == Operation.CHECK_WRITE)
    bench.m.d.sync += checked.eq(Mux(host.clear, 0, checked) | Mux(checks, Cat(asks), 0))
    for bit, asked in enumerate(asks):
        writes = host.start & (host.operation == Operation.WRITE) & asked
        bench.assume(~writes | checked[bit] & ~host.refused)
    bench.assume(~host.clear | ~marks.any())
    bench.promise(bench.inner["exclusive"] == checked)
    bench.promise((marks & ~checked) == 0)
    sent = Cat(getattr(block, name).any() for name in EXCLUSIVE)
    for pulses in (Mux(host.refused, 0, checked), marks, sent):
        of = dict(zip(EXCLUSIVE, pulses, strict=True))
        for name, others in EXCLUSIVE.items():
            bench.promise(~(of[name] & Cat(of[other] for other in others).any()))


def one_frame_arms_or_moves(bench: Bench) -> None:
    block = register_file(bench)
    host, registers = block.host, block.design.registers
    a_frame_does_one(bench, block, [(host.address == registers[name].address) & host.value[0] for name in EXCLUSIVE])


def only_checks_find(bench: Bench, host: PureInterface) -> Value:
    """Return whether what is found rises only with a check, and falls only with a clear, which leaves nothing."""
    checks = host.start & ((host.operation == Operation.CHECK_READ) | (host.operation == Operation.CHECK_WRITE))
    found = Cat(host.absent, host.outside, host.refused)
    before, checked, cleared = bench.past(found), bench.past(checks), bench.past(host.clear)
    rises, falls = (found & ~before).any(), (before & ~found).any()
    forgotten = bench.past(host.clear & ~checks) & found.any()
    return bench.past(bench.reset) | ~(rises & ~checked | falls & ~cleared | forgotten)


def each_takes(bench: Bench, host: PureInterface, left: Value, latencies: dict[Operation, Value | int]) -> None:
    """Promise that behind the beginning of an operation as many clocks are left as its latency was then."""
    for operation, latency in latencies.items():
        begun = bench.past(bench.state("IDLE") & host.start & (host.operation == operation) & ~bench.reset)
        bench.promise(~begun | (left == bench.past(latency)))


def checks_alone_find(bench: Bench) -> None:
    host = register_file(bench).host
    checks = (host.operation == Operation.CHECK_READ) | (host.operation == Operation.CHECK_WRITE)
    bench.promise(only_checks_find(bench, host))
    bench.promise(~bench.state("LEAST", "ABOVE", "BELOW") | host.start & checks)


def live_words_are_written(bench: Bench) -> None:
    block = register_file(bench)
    host = block.host
    written = host.start & (host.operation == Operation.WRITE)
    # Only what was checked is written, and a check refuses what is beyond the book.
    bench.assume(~written | (host.address < END))
    bench.promise(~bench.state("TAKE") | written)
    for word in block.design.registers.live:
        port = getattr(block, word.name)
        told = bench.past(written & (host.address == word.address + 1)) | bench.past(bench.reset)
        bench.promise(told | (port == bench.past(port, init=word.reset)))


def every_operation_ends(bench: Bench) -> None:
    block = register_file(bench)
    design, host, inner, m = block.design, block.host, bench.inner, bench.m
    step, committing, last = inner["step"], inner["committing"], inner["last"]

    # The moves of a snapshot and of a commit, register by register, in cells that nothing writes: the only part of the
    # book that is written is the first, and what is read of them is what the book has.
    bench.promise(~inner["write__en"] | (inner["write__addr"] < END))
    place, read = Signal(range(END)), Signal()
    m.d.sync += [place.eq(inner["place"]), read.eq((inner["area"] == Area.LEAST) & ~inner["window"])]
    snapshot = [each.address + half for _, turn in design.turns for each in turn for half in (1, 0)]
    commit = [each.address + half for each in design.registers.active for half in (1, 0)]
    to_come, known = Signal(range(END)), Signal()
    with m.Switch(place):
        for at in (*snapshot, *commit):
            with m.Case(at):
                bench.m.d.comb += known.eq(inner["found"] == design.book[Area.LEAST * END + at])
    cells = Signal()
    for one, moves in ((0, snapshot), (1, commit)):
        for index, at in enumerate(moves):
            with m.If((committing == one) & (step == at)):
                m.d.comb += [to_come.eq(len(moves) - index), cells.eq(1)]
    listed = Signal()
    with m.Switch(place):
        for at in (*snapshot, *commit):
            with m.Case(at):
                m.d.comb += listed.eq(1)
    bench.assume(~(read & listed) | known)
    sweeping = bench.state("SWEEP", "LOOK", "LOAD", "SHIFT", "STORE", "COPY", "COPIED")
    bench.promise(~sweeping | cells)
    bench.promise(~bench.state("COPY", "COPIED") | committing)
    bench.promise(~bench.state("LOAD", "SHIFT", "STORE") | (last == (to_come == 1)))
    bench.promise(~bench.state("LOOK", "LOAD", "SHIFT", "STORE") | read & (place == step))

    sends, captured = 3, host.address[15]
    per_cell = CELL_BITS + 4 + Mux(committing, 2, 0)
    others = (to_come - 1)[: len(to_come)] * per_cell + Mux(committing, sends, 1)
    boot = (END - 1 - step)[: len(step)] * 3
    left_in = {
        "BOOT": boot + 3,
        "BOOT_TAKE": boot + 2,
        "BOOT_WRITE": boot + 1,
        "IDLE": 0,
        "READ": 2 + captured,
        "READ_CAPTURE": 2,
        "LEAST": 4,
        "ABOVE": 3,
        "BELOW": 2,
        "TAKE": 3,
        "KEEP": 2,
        "COUNT": 3,
        "COUNTED": 2,
        "PULSE": sends,
        "WAIT": 2,
        "DONE": 1,
        "COPY": others + CELL_BITS + 6,
        "COPIED": others + CELL_BITS + 5,
        "SWEEP": others + CELL_BITS + 4,
        "LOOK": others + CELL_BITS + 3,
        "LOAD": others + CELL_BITS + 2,
        "SHIFT": others + CELL_BITS - inner["bit"] + 1,
        "STORE": others + 1,
    }
    left = Signal(16)
    for name, clocks in left_in.items():
        with m.If(bench.state(name)):
            m.d.comb += left.eq(clocks)
    idle, boots = bench.state("IDLE"), bench.state("BOOT", "BOOT_TAKE", "BOOT_WRITE")
    bench.falls(
        left,
        most=max(block.boot_clocks, block.snapshot_clocks, block.shift_clocks + sends),
        free=idle,
        waits=bench.state("WAIT") & block.commit_pending,
        begins=idle & host.start,
    )
    # At the clock behind the beginning of an operation exactly its latency is left, and it is over only with `done`.
    names = [pulse.name for pulse in design.registers.pulses]
    shifts = Cat(inner["marks"][names.index(name)] for name in WITH_WORDS).any()
    latencies = {
        Operation.CHECK_READ: 1,
        Operation.READ: 2 + captured,
        Operation.WRITE: 3,
        Operation.COUNT: 3,
        Operation.CHECK_WRITE: 4,
        Operation.SNAPSHOT: block.snapshot_clocks,
        Operation.FINISH: Mux(shifts, block.shift_clocks, 0) + sends,
    }
    each_takes(bench, host, left, latencies)
    bench.promise(~idle | bench.past(idle | boots | host.done | bench.reset))
    bench.promise(~bench.past(bench.reset, init=1) | boots & (left == block.boot_clocks))


SHORT_BOOT = (Bug(RegisterFile._boot, "step.all()", "1"),)
"""A reset writes only one cell, so that a bug behind it shows in the first clocks."""
NO_BOOT = (Bug(RegisterFile._boot, 'm.next = "BOOT_TAKE"', 'm.next = "IDLE"'),)
"""A reset writes no cell at all."""
SHORT_CHECKS = (*NO_BOOT, Bug(RegisterFile._begin, 'm.next = "LEAST"', 'm.next = "DONE"'))
"""Nor does a check compare bounds, so that what several of them do shows in the first clocks."""
PROPERTIES = [
    Property(
        "no frame arms an axis beside a commit, a preload or a shift of the origin, nor has both of these",
        WHERE,
        one_frame_arms_or_moves,
        depth=2,
        bugs=(
            Bug(RegisterFile._begin, " | pulses.several", "", SHORT_CHECKS),
            Bug(Pulses.check, "exclusive.eq(self.after)", "exclusive.eq(0)", SHORT_CHECKS),
        ),
        within=12,
    ),
    Property(
        "a pulse goes out for one clock, at the end of a frame that has written 1 to its register",
        WHERE,
        pulses_are_asked_for,
        depth=2,
        bugs=(
            Bug(Pulses.__init__, "Signal(len(registers.pulses))", "Signal(len(registers.pulses), init=1)"),
            Bug(Pulses.__init__, "& host.value[0]", "", SHORT_BOOT),
        ),
    ),
    Property(
        "what is found rises only with a check, and falls only with a clear, which leaves nothing",
        WHERE,
        checks_alone_find,
        depth=2,
        bugs=(
            Bug(RegisterFile._boot, "step.eq(step + 1)", "[step.eq(step + 1), self.host.absent.eq(1)]"),
            Bug(Pulses.begin, "host.absent.eq(0), ", "", NO_BOOT),
        ),
        within=12,
    ),
    Property(
        "a live word changes only when its lower half is written",
        WHERE,
        live_words_are_written,
        depth=2,
        bugs=(Bug(RegisterFile._write, "word.address - LIVE + 1", "word.address - LIVE", SHORT_BOOT),),
    ),
    Property(
        "each operation takes its own latency and the wait for a sample; one may begin boot_clocks after a reset",
        WHERE,
        every_operation_ends,
        depth=2,
        bugs=(
            Bug(RegisterFile._boot, "step.eq(step + 1)", "step.eq(step)"),
            Bug(RegisterFile._begin, 'm.next = "COUNT"', 'm.next = "LEAST"', NO_BOOT),
            Bug(
                RegisterFile._begin,
                "Cat(pulses.marked(name) for name in WITH_WORDS).any()",
                "~pulses.marked('commit')",
                NO_BOOT,
            ),
        ),
    ),
]
