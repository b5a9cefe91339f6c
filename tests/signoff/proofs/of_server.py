"""What the server promises: every frame comes to an end, and nothing is written but for a request that was checked."""

from amaranth.hdl import Cat, Mux, Signal, Value

from hardwall.hdl.link.server import Server
from hardwall.hdl.link.walk import ECHOED, HEAD, HEAD_OF_OTHERS, Walk
from hardwall.model.axis.register_file import Design, Operation
from hardwall.model.axis.registers import COUNTERS, RegisterMap
from hardwall.model.link import server as model
from hardwall.model.link.line import Verdict
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .of_register_file import only_checks_find
from .property import Property

WHERE = "server mhz fdm"
MOST = 256
"""Registers of a frame: the server's own counter takes any number from its frame, 0 as 256."""

# Clocks of the server's own that are left at most, from the end of a frame backwards: taking two bytes and one byte,
# a refusal, an echo, and then, for each phase, its begin and what follows its last register.
WORD, BYTE, CLOCKS_OF_A_BYTE = 4, 3, 4
PER_REGISTER = {
    Operation.CHECK_READ: 2,
    Operation.CHECK_WRITE: WORD + 2,
    Operation.WRITE: WORD + 2,
    Operation.READ: 4,
}
FINISHED = 1
REFUSED = 1 + HEAD * CLOCKS_OF_A_BYTE + 1 + FINISHED
ECHO = ECHOED * CLOCKS_OF_A_BYTE + FINISHED
READ = HEAD * CLOCKS_OF_A_BYTE + 1 + MOST * PER_REGISTER[Operation.READ] + FINISHED
BEGINS, FOLLOWS = {}, {Operation.READ: FINISHED}
BEGINS[Operation.READ] = 1 + max(ECHO, 1 + 2 * WORD + READ)
FOLLOWS[Operation.WRITE] = 1 + BEGINS[Operation.READ]
WRITES = 2 * WORD + BYTE + MOST * PER_REGISTER[Operation.WRITE]
BEGINS[Operation.WRITE] = 1 + WRITES + FOLLOWS[Operation.WRITE]
FOLLOWS[Operation.CHECK_WRITE] = BEGINS[Operation.WRITE]
BEGINS[Operation.CHECK_WRITE] = 1 + WRITES + FOLLOWS[Operation.CHECK_WRITE]
FOLLOWS[Operation.CHECK_READ] = BEGINS[Operation.CHECK_WRITE]
BEGINS[Operation.CHECK_READ] = 1 + 2 * WORD + MOST * PER_REGISTER[Operation.CHECK_READ] + FOLLOWS[Operation.CHECK_READ]
DIAGNOSES = 1 + 8 * PER_REGISTER[Operation.WRITE] + FOLLOWS[Operation.WRITE]
IDENTIFIES = HEAD_OF_OTHERS * CLOCKS_OF_A_BYTE + MOST * PER_REGISTER[Operation.READ] + FINISHED
ALL = 2 + BEGINS[Operation.CHECK_READ]

CHECKS_WRITES = "with m.Case(Operation.CHECK_WRITE):"
CLEARS_BEFORE = f"{CHECKS_WRITES}\n{12 * ' '}m.d.comb += file.clear.eq(1)"
"""What the check of the registers to read has found is forgotten before those to write are checked."""


def by_phase(phase: Value, clocks: dict[Operation, int]) -> Value:
    """Return the number of a phase."""
    chosen: Value | int = 0
    for operation, number in clocks.items():
        chosen = Mux(phase == operation, number, chosen)
    return chosen


def server_at_work(bench: Bench) -> Server:
    """Return a server of a line that keeps a frame as it is until it is finished."""
    server = bench.block(Server(Design(RegisterMap(spec("mhz", "fdm")))))
    frames = server.frames
    bench.assume(bench.kept((frames.ended, frames.verdict, frames.function), frames.ended & ~frames.finished))
    phase = bench.inner["phase"]
    values = bench.state("BYTES", "VALUE") | bench.state("ADDRESS") & bench.inner["single"]
    bench.promise(bench.state("IDLE") | frames.ended)
    bench.promise((phase <= Operation.READ) | bench.state("FINISHED", "IDLE"))
    bench.promise(~bench.state("FINISH", "SNAPSHOT") | (phase == Operation.READ))
    bench.promise(~bench.state("SNAPSHOT") | bench.inner["reads"])
    refusing = bench.inner["code"] != 0
    bench.promise(~bench.state("COUNT") | (bench.inner["address"][:3] != model.EXCEPTIONS) | refusing)
    refuses = refusing & (bench.inner["stop"] == HEAD)
    bench.promise(~bench.state("HEAD", "SEND_LAST") | (phase == Operation.READ) | refuses)
    bench.promise(~bench.state("SEND_HIGH", "SEND_LOW") | (phase == Operation.READ))
    bench.promise(~values | (phase == Operation.CHECK_WRITE) | (phase == Operation.WRITE))
    return server


def keeps_what_it_asks_for(bench: Bench) -> None:
    file = server_at_work(bench).file
    asked = (file.start, file.operation, file.address, file.value, file.first, file.last)
    bench.promise(bench.kept(asked, file.start & ~file.done))


def every_frame_ends(bench: Bench) -> None:
    server = server_at_work(bench)
    inner, frames, file = bench.inner, server.frames, server.file
    function, phase, beat, code = frames.function, inner["phase"], inner["beat"], inner["code"]
    counter = inner["address"][:3]
    for name in ("DIAGNOSE", "IDENTIFY"):
        bench.promise(~bench.state(name) | (function == getattr(model, name)))

    registers = Signal(range(MOST + 1))
    bench.m.d.comb += registers.eq(Mux(inner["left"] == 0, MOST, inner["left"]))
    follows = by_phase(phase, FOLLOWS)
    # From behind a register on, and from its beginning.
    others = (registers - 1)[: len(registers)] * by_phase(phase, PER_REGISTER) + follows
    reads = phase == Operation.READ
    register = others + Mux(reads, PER_REGISTER[Operation.READ], 2)
    two_bytes, one_byte = WORD - beat, BYTE - Mux(beat == BYTE, 0, beat)
    quantity = Mux(
        reads, READ, Mux(phase == Operation.CHECK_READ, 0, BYTE) + MOST * by_phase(phase, PER_REGISTER) + follows
    )
    quantity = Mux(function == model.DIAGNOSE, DIAGNOSES, quantity)
    address = Mux(function == model.WRITE_ONE, WORD + 2 + follows, WORD + quantity)
    address = Mux(function == model.IDENTIFY, BYTE + max(IDENTIFIES, REFUSED), address)
    head = ((inner["stop"] - inner["index"] - 1)[:3] + 1) * CLOCKS_OF_A_BYTE - beat
    behind_head = Mux(code != 0, 1 + FINISHED, 1 + register)
    behind = Mux(inner["stop"] == HEAD, behind_head, Mux(inner["stop"] == HEAD_OF_OTHERS, register, FINISHED))
    counts = Mux(
        counter == model.MESSAGES,
        ALL,
        Mux(counter == model.REQUESTS, ALL - 1, Mux(counter == model.EXCEPTIONS, REFUSED, 1 + FINISHED)),
    )
    left_in = {
        "FINISHED": FINISHED,
        "COUNT": counts,
        "PHASE": by_phase(phase, BEGINS),
        "SNAPSHOT": 1 + 2 * WORD + READ,
        "ADDRESS": two_bytes + address,
        "QUANTITY": two_bytes + quantity,
        "BYTES": one_byte + WORD + register,
        "VALUE": two_bytes + register,
        "ASK": register,
        "SEND_HIGH": 3 + others,
        "SEND_LOW": 2 + others,
        "NEXT": 1 + others,
        "FINISH": FOLLOWS[Operation.WRITE],
        "DIAGNOSE": DIAGNOSES,
        "IDENTIFY": one_byte + max(IDENTIFIES, REFUSED),
        "HEAD": head + behind,
        "SEND_LAST": behind_head,
    }
    left = Signal(16)
    for name, clocks in left_in.items():
        with bench.m.If(bench.state(name)):
            bench.m.d.comb += left.eq(clocks)
    answer = frames.answer
    bench.falls(
        left,
        most=ALL,
        free=bench.state("IDLE"),
        waits=(file.start & ~file.done) | (answer.valid & ~answer.ready),
        begins=bench.state("IDLE") & frames.ended,
    )


def writes_what_was_checked(bench: Bench) -> None:
    server = server_at_work(bench)
    inner, frames, file = bench.inner, server.frames, server.file
    bench.assume(only_checks_find(bench, file))
    writes, clearing, phase = inner["writes"], inner["clearing"], inner["phase"]
    counting, counter = bench.state("COUNT"), inner["address"][:3]
    # What a check of this frame has found is kept beside the server until the next frame, whatever the server clears.
    finds, since = Signal(), Signal()
    bench.m.d.comb += finds.eq(Cat(file.absent, file.outside, file.refused).any() & ~counting)
    bench.m.d.sync += since.eq((since | finds) & ~bench.state("IDLE"))
    found, excepts = since | finds, inner["code"] != 0
    refused = counting & (counter == model.EXCEPTIONS) | bench.state("HEAD", "SEND_LAST") & (inner["stop"] == HEAD)
    bench.promise(~file.clear | counting)
    bench.promise(~excepts | refused | bench.state("FINISHED", "IDLE"))
    bench.promise(~since | finds | excepts | bench.state("FINISHED", "IDLE"))
    requested = counting & ((counter == model.REQUESTS) | (counter == model.EXCEPTIONS))
    heard = counting & ((counter == model.MESSAGES) | (counter == model.REQUESTS))
    bench.promise(~heard | (phase == Operation.CHECK_READ) & ~clearing)
    working = requested | ~(counting | bench.state("IDLE", "FINISHED"))
    asked = (frames.verdict == Verdict.REQUEST) & (writes | clearing)
    good = ~found & ~inner["malformed"] | clearing
    in_phase = bench.state("ADDRESS", "QUANTITY", "BYTES", "VALUE", "ASK", "NEXT") & (phase == Operation.WRITE)
    bench.promise(~working | (frames.verdict == Verdict.REQUEST))
    bench.promise(~clearing | (frames.function == model.DIAGNOSE) | bench.state("IDLE"))
    echoes = bench.state("HEAD") & (inner["stop"] == ECHOED) | bench.state("PHASE") & (phase == Operation.READ)
    bench.promise(~clearing | in_phase | echoes | bench.state("FINISH", "FINISHED", "IDLE"))
    cleared = (inner["address"] == COUNTERS + 8 - inner["left"]) & (inner["left"] <= 8) & (inner["left"] != 0)
    bench.promise(~(in_phase & clearing) | cleared & bench.state("ASK", "NEXT"))
    bench.promise(~in_phase | asked & (~found | clearing))
    bench.promise(~in_phase | ~inner["malformed"] | clearing | bench.state("BYTES"))
    writing = file.start & (file.operation == Operation.WRITE)
    bench.promise(~writing | frames.ended & asked & good)
    bench.promise(~writing | ~clearing | (file.address >= COUNTERS) & (file.address < COUNTERS + 8))
    finishing = file.start & (file.operation == Operation.FINISH)
    bench.promise(~finishing | frames.ended & asked)


PROPERTIES = [
    Property(
        f"a frame is finished within {ALL} clocks in which the server waits for neither registers nor line",
        WHERE,
        every_frame_ends,
        depth=2,
        quick=True,
        bugs=(
            Bug(Walk.end_phase, "self.phase.eq(self.phase + 1)", "self.phase.eq(self.phase)"),
            Bug(Walk.refuse, "code.eq(exception)", "code.eq(0)"),
        ),
    ),
    Property(
        "what is asked of the registers stays until it is done",
        WHERE,
        keeps_what_it_asks_for,
        depth=2,
        bugs=(Bug(Walk._ask, "file.value.eq(word)", "file.value.eq(self.frames.byte)"),),
    ),
    Property(
        "registers are written only for a request to this unit that writes and in which no check has found anything",
        WHERE,
        writes_what_was_checked,
        depth=2,
        bugs=(
            Bug(Server._count, "m.If(frames.verdict == Verdict.REQUEST)", "m.If(frames.verdict != Verdict.FOREIGN)"),
            Bug(Server._begin_phases, "m.If(file.absent)", "m.If(file.absent & file.outside)"),
            Bug(Server._begin_phases, CHECKS_WRITES, CLEARS_BEFORE),
        ),
    ),
]
