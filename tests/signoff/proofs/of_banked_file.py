"""What the registers of several axes promise: words and pulses go to the axis whose bank they were written to."""

from amaranth.hdl import Cat, Mux, Signal, Value
from amaranth.lib.wiring import PureInterface

from hardwall.hdl.axes.commit_walk import CommitWalk
from hardwall.hdl.axes.register_file import BankedFile
from hardwall.hdl.link.checks import Pulses
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.register_file import Design
from hardwall.model.axes.registers import BANK, AxesMap, is_shared
from hardwall.model.axis.register_file import EXCLUSIVE, Operation
from stimuli.specs import NARROW

from .bench import Bench
from .bugs import Bug
from .of_register_file import a_frame_does_one, each_takes, only_checks_find
from .property import Property

WHERE = "banked file narrow, 3 axes"
WALK = "WALK", "WALKED", "WALK_STORE"


def banked_file(bench: Bench) -> BankedFile:
    """Return a banked file whose host keeps what it asks for until it is done, and writes only what there is."""
    axes = AxesSpec(**{**NARROW, "actuation_hz": NARROW["sample_hz"]}, axes=3, estimator="fdm")
    block = bench.block(BankedFile(Design(AxesMap(axes))))
    host = block.host
    bench.assume(bench.kept((host.start, host.operation, host.address, host.value), host.start & ~host.done))
    # Only what was checked is written, and a check refuses what is beyond the banks, or in bank 0 alone.
    place, there = _at(host)
    own = Cat(place == each for each in sorted(block.design.own_places)).any()
    within = (host.address < BANK * block.design.banks) & (~own | (there == 0))
    bench.assume(~_begins(host, Operation.WRITE) | within)
    return block


def _begins(host: PureInterface, operation: Operation) -> Value:
    """Return whether the host asks for an operation."""
    return host.start & (host.operation == operation)


def _at(host: PureInterface) -> tuple[Value, Value]:
    """Return the place within a bank at the host's address, and the bank."""
    return host.address[: (BANK - 1).bit_length()], host.address[(BANK - 1).bit_length() :]


def _bank_written_to(bench: Bench, host: PureInterface) -> Signal:
    """Return the bank of the last write that was begun; promise that the block knows it a clock later."""
    bank, (_, there) = Signal.like(bench.inner["to"]), _at(host)
    writes = _begins(host, Operation.WRITE)
    with bench.m.If(bench.state("IDLE") & writes):
        bench.m.d.sync += bank.eq(there)
    bench.promise(~bench.state("TAKE", "KEEP") | writes & (bank == there))
    bench.promise(bench.state("TAKE") | (bank == bench.inner["to"]))
    bench.promise(~bench.state(*WALK, "PULSE", "SETTLE") | _begins(host, Operation.FINISH))
    return bank


def pulses_are_asked_for(bench: Bench) -> None:
    block = banked_file(bench)
    host, m, marks, banks = block.host, bench.m, bench.inner["marks"], block.design.banks
    bank, (place, there) = _bank_written_to(bench, host), _at(host)
    writing = bench.state("IDLE") & _begins(host, Operation.WRITE)
    # Between two banks lies what cannot be written, so no frame writes to two.
    bench.assume(~writing | ~marks.any() | (bank == there))
    for number, pulse in enumerate(block.design.registers.pulses):
        asked, sent = Signal(banks, name=f"asked_{pulse.name}"), getattr(block, pulse.name)
        with m.If(writing & (place == pulse.address) & host.value[0]):
            m.d.sync += asked.bit_select(there, 1).eq(1)
        with m.Elif(bench.state("PULSE")):
            m.d.sync += asked.eq(0)
        bench.promise(~marks[number] | asked.bit_select(bank, 1))
        finishing = bench.past(bench.state("PULSE") & _begins(host, Operation.FINISH) & ~bench.reset)
        # One of all axes has a single bit, and is written to in the bank of axis 0.
        for axis in range(len(sent)):
            bench.promise(~sent[axis] | finishing & bench.past(asked[axis]) & ~bench.past(sent[axis]))


def one_frame_arms_or_moves(bench: Bench) -> None:
    block = banked_file(bench)
    host, registers = block.host, block.design.registers
    place, _ = _at(host)
    within = (host.address < BANK * block.design.banks) & host.value[0]
    a_frame_does_one(bench, block, [within & (place == registers[name].address) for name in EXCLUSIVE])


def words_go_where_they_were_written(bench: Bench) -> None:
    block = banked_file(bench)
    host, registers = block.host, block.design.registers
    committing = bench.inner["marks"][[pulse.name for pulse in registers.pulses].index("commit")]
    bank, (place, there) = _bank_written_to(bench, host), _at(host)
    step, words = bench.inner["step"], len(registers.words)
    bench.promise(~bench.state(*WALK) | (step < words + 2) & (committing | (step >= words)))
    live, before = Signal(), bench.past(place)
    told = bench.past(bench.state("TAKE") & _begins(host, Operation.WRITE) & ~bench.reset)
    with bench.m.Switch(block.word_number):
        for address, number in block.design.numbers.items():
            with bench.m.Case(number):
                bench.m.d.comb += live.eq(told & (before == address))
    walked = bench.past(bench.state("WALK_STORE") & committing & _begins(host, Operation.FINISH) & ~bench.reset)
    by_write = live & (block.word_axis == bench.past(there))
    bench.promise(~block.word_write | by_write | walked & (block.word_axis == bench.past(bank)))
    for word in filter(is_shared, registers.live):
        port = getattr(block, word.name)
        written = told & (before == word.address + 1) | bench.past(bench.reset)
        bench.promise(written | (port == bench.past(port, init=word.reset)))


def checks_alone_find(bench: Bench) -> None:
    host = banked_file(bench).host
    checks = _begins(host, Operation.CHECK_READ) | _begins(host, Operation.CHECK_WRITE)
    bench.promise(only_checks_find(bench, host))
    bench.promise(~bench.state("LEAST", "ABOVE", "BELOW") | checks)


def every_operation_ends(bench: Bench) -> None:
    block = banked_file(bench)
    host, inner, design = block.host, bench.inner, block.design
    step, low, walks, cells = inner["step"], inner["low"], len(design.registers.words) + 2, BANK * design.banks
    bench.promise(~bench.state("BOOT", "BOOT_TAKE", "BOOT_STORE") | (step < cells))
    bench.promise(~bench.state(*WALK) | (step < walks))
    # The high half of a word's place is walked first, and then the low one.
    bench.promise(bench.state(*WALK, "READ", "READ_CAPTURE", "DONE", "IDLE") | ~low)
    captured = host.address[15]
    boot, walk = (cells - 1 - step)[: len(step)] * 3, ((walks - 1 - step)[: len(step)] * 2 + ~low) * 3
    sends, latency = 3 + design.settle_clocks, design.axes.spec.latency
    left_in = {
        "BOOT": boot + 4,
        "BOOT_TAKE": boot + 3,
        "BOOT_STORE": boot + 2,
        "BEGIN": 1,
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
        "WALK": walk + 3 + sends,
        "WALKED": walk + 2 + sends,
        "WALK_STORE": walk + 1 + sends,
        "PULSE": sends,
        "SETTLE": inner["settling"] + 2,
        "STROBE": latency + 4,
        "STROBED": latency + 3,
        "RECORD": inner["settling"] + 3,
        "TURN": 2,
        "DONE": 1,
    }
    left = Signal(16)
    for name, clocks in left_in.items():
        with bench.m.If(bench.state(name)):
            bench.m.d.comb += left.eq(clocks)
    bench.promise(~bench.state("SETTLE") | (inner["settling"] <= design.settle_clocks))
    bench.promise(~bench.state("RECORD") | (inner["settling"] < latency))
    waits = bench.state("BEGIN") & ~block.word_ready
    waits |= bench.state("STROBE") & ~(block.strobe & (block.strobe_axis == inner["asked"]))
    recorded = block.record_valid & (block.record_axis == inner["asked"])
    waits |= bench.state("RECORD") & (inner["settling"] == 0) & ~recorded
    waits |= bench.state("TURN") & ~(block.turn_valid & (block.turn_axis == inner["asked"]))
    idle = bench.state("IDLE")
    bench.falls(
        left,
        most=max(block.boot_clocks, *block.finish_clocks.values()),
        free=idle,
        waits=waits,
        begins=idle & host.start,
    )
    # At the clock behind the beginning of an operation exactly its latency is left; a SNAPSHOT waits on the way.
    marks = inner["marks"]
    commits = marks[[pulse.name for pulse in design.registers.pulses].index("commit")]
    finish = Mux(commits, *(block.finish_clocks[commits] for commits in (True, False)))
    latencies = {
        Operation.CHECK_READ: 1,
        Operation.READ: 2 + captured,
        Operation.WRITE: 3,
        Operation.COUNT: 3,
        Operation.CHECK_WRITE: 4,
        Operation.SNAPSHOT: Mux(inner["asks"], latency + 4, 1),
        Operation.FINISH: Mux(marks.any(), finish, 1),
    }
    each_takes(bench, host, left, latencies)
    bench.promise(~bench.past(bench.reset, init=1) | bench.state("BOOT") & (left == block.boot_clocks))


NO_BOOT = (Bug(BankedFile._boot, 'm.next = "BOOT_TAKE"', 'm.next = "IDLE"'),)
"""A reset writes no cell, so that a bug behind it shows in the first clocks."""
PROPERTIES = [
    Property(
        "no frame arms an axis beside a commit, a preload or a shift of the origin, nor has both of these",
        WHERE,
        one_frame_arms_or_moves,
        depth=2,
        bugs=(
            Bug(BankedFile.elaborate, " | pulses.several", "", NO_BOOT),
            Bug(Pulses.check, "exclusive.eq(self.after)", "exclusive.eq(0)", NO_BOOT),
        ),
        within=12,
    ),
    Property(
        "a pulse goes out for one clock, at the end of a frame, to the axis whose bank it was written to",
        WHERE,
        pulses_are_asked_for,
        depth=2,
        bugs=(
            Bug(Pulses.__init__, "& host.value[0]", "", NO_BOOT),
            Bug(
                BankedFile._give_pulses,
                "Mux(pulses.marks[bit], Const(1) << axes.to, 0)",
                "Mux(pulses.marks[bit], Const(1) << axes.here, 0)",
                NO_BOOT,
            ),
        ),
    ),
    Property(
        "a word goes to the axis whose bank it was written to, with a write of its lower half or a commit there",
        WHERE,
        words_go_where_they_were_written,
        depth=2,
        bugs=(
            Bug(
                BankedFile._walk,
                "word, axes.to, Cat(shift, upper)",
                "word, axes.asked, Cat(shift, upper)",
                NO_BOOT,
            ),
            Bug(CommitWalk.__init__, "Mux(commit, 0, words)", "0", NO_BOOT),
        ),
    ),
    Property(
        "what is found rises only with a check, and falls only with a clear, which leaves nothing",
        WHERE,
        checks_alone_find,
        depth=2,
        bugs=(Bug(Pulses.begin, "host.absent.eq(0), ", "", NO_BOOT),),
        within=12,
    ),
    Property(
        "each operation takes its own latency and the waits for a sample and a turn; one may begin after a reset",
        WHERE,
        every_operation_ends,
        depth=2,
        bugs=(
            Bug(BankedFile._walk, "walk.step.eq(walk.step + walk.low)", "walk.step.eq(walk.step)", NO_BOOT),
            Bug(BankedFile._give_pulses, "settling.eq(walk.settling - 1)", "settling.eq(walk.settling)", NO_BOOT),
            Bug(BankedFile._begin, 'm.next = "COUNT"', 'm.next = "LEAST"', NO_BOOT),
        ),
    ),
]
