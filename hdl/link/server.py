"""The application layer of Modbus: functions and exceptions over a register file."""

from amaranth.hdl import Cat, Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hardwall.model.axis.register_file import ANSWER, ANSWERS, CELL_BITS, Design, Operation
from hardwall.model.link import server as model
from hardwall.model.link.line import Verdict

from ..arithmetic.fixed import less
from .line import BYTE, Frames
from .requests import ADDRESS_BITS, Requests
from .walk import ECHOED, HEAD, HEAD_OF_OTHERS, Walk

COUNTERS_CLEARED = 8


class Server(wiring.Component):
    """The requests of frames carried out on a register file, and their answers.

    Equation: the model's, word for word; it has the order of the checks. A frame is walked register by register: once
    to check it, and once to do it, so nothing is done of a frame that ends in an exception. A frame that reads takes a
    snapshot before the first register.

    Latency: to the first byte of an answer less than 30 clocks; also 21 for every register to write, 4 for every
    register to read, and the register file's times for a snapshot and a commit. Throughput: one frame after the other;
    a byte of an answer waits for the line.

    Rounding and overflow: the counters wrap.

    Parameters
    ----------
    design : hardwall.model.axis.register_file.Design
        The registers.

    Members
    -------
    frames : In(Frames)
        The line.
    file : Out(Requests)
        The register file.

    Raises
    ------
    TypeError
        If `design` is not a Design.

    Source: "Modbus Application Protocol Specification V1.1b3", sections 6.3, 6.4, 6.6, 6.8, 6.12, 6.17, 6.21
    (functions) and 7 (exceptions).
    """

    def __init__(self, design: Design):
        if not isinstance(design, Design):
            raise TypeError(f"design must be a register_file.Design, not {design!r}")
        self._design = design
        super().__init__({"frames": In(Frames()), "file": Out(Requests())})

    @property
    def design(self) -> Design:
        return self._design

    def elaborate(self, platform):
        m = Module()
        walk = Walk(m, self.frames, self.file)
        with m.FSM():
            self._count(m, walk)
            self._begin_phases(m, walk)
            self._read_fields(m, walk)
            self._do_registers(m, walk)
            self._diagnose(m, walk)
            self._identify(m, walk)
            self._answer(m, walk)
        return m

    def _count(self, m: Module, walk: Walk) -> None:
        """Add the states that wait for a frame and count it; each count leads to the next step."""
        frames, file, function = self.frames, self.file, self.frames.function
        with m.State("IDLE"):
            m.d.sync += [walk.code.eq(0), walk.clearing.eq(0), walk.malformed.eq(0), walk.beat.eq(0)]
            m.d.sync += walk.phase.eq(Operation.CHECK_READ)
            with m.If(frames.ended), m.Switch(frames.verdict):
                with m.Case(Verdict.SPOILT):
                    walk.count(model.ERRORS)
                with m.Case(Verdict.OVERRUN):
                    walk.count(model.OVERRUNS)
                with m.Default():
                    walk.count(model.MESSAGES)
        with m.State("COUNT"):
            m.d.comb += [file.start.eq(1), file.clear.eq(1), file.operation.eq(Operation.COUNT)]
            with m.If(file.done):
                m.next = "FINISHED"
                with m.Switch(walk.address[:3]):
                    with m.Case(model.MESSAGES):
                        with m.If(frames.verdict == Verdict.REQUEST):
                            walk.count(model.REQUESTS)
                        with m.Elif(frames.verdict == Verdict.BROADCAST):
                            walk.count(model.UNANSWERED)
                    with m.Case(model.REQUESTS):
                        m.d.comb += walk.at_fields.eq(1)
                        m.next = "PHASE"
                        with m.If((function == model.DIAGNOSE) | (function == model.IDENTIFY)):
                            m.next = "ADDRESS"
                        with m.Elif(~walk.reads & ~walk.writes):
                            walk.refuse(model.FUNCTION)
                    with m.Case(model.EXCEPTIONS):
                        walk.send_head(HEAD)

    def _begin_phases(self, m: Module, walk: Walk) -> None:
        """Add the state that begins each phase: check reads, check writes, write, read."""
        file = self.file
        with m.State("PHASE"), m.Switch(walk.phase):
            with m.Case(Operation.CHECK_READ):
                m.next = "ADDRESS"
                with m.If(~walk.reads):
                    walk.end_phase()
            with m.Case(Operation.CHECK_WRITE):
                m.d.comb += [walk.at_written.eq(walk.reads), walk.at_fields.eq(1)]
                m.next = "ADDRESS"
                with m.If(~walk.writes):
                    walk.end_phase()
            with m.Case(Operation.WRITE):
                m.d.comb += [walk.at_written.eq(walk.reads), walk.at_fields.eq(1)]
                m.next = "ADDRESS"
                with m.If(~walk.writes):
                    walk.end_phase()
                with m.If(file.refused):
                    walk.refuse(model.FAILURE)
                with m.If(file.outside):
                    walk.refuse(model.VALUE)
                with m.If(file.absent):
                    walk.refuse(model.ABSENT)
                with m.If(walk.malformed):
                    walk.refuse(model.VALUE)
            with m.Case(Operation.READ):
                m.next = "SNAPSHOT"
                with m.If(~walk.reads):
                    walk.send_head(ECHOED)

    def _read_fields(self, m: Module, walk: Walk) -> None:
        """Add the states that take the fields of a request, up to the first value, for each phase anew."""
        file, function = self.file, self.frames.function
        with m.State("SNAPSHOT"):
            m.d.comb += [file.start.eq(1), file.operation.eq(Operation.SNAPSHOT), walk.at_fields.eq(1)]
            with m.If(file.done):
                m.next = "ADDRESS"
        with m.State("ADDRESS"):
            walk.take(3)
            m.d.sync += walk.first.eq(1)
            with m.If(walk.beat == 3):
                m.d.comb += [walk.address_given.eq(1), walk.own_left.eq(1)]
                m.next = "QUANTITY"
                with m.If(walk.single):
                    m.next = "VALUE"
                with m.Elif(function == model.IDENTIFY):
                    m.next = "IDENTIFY"
        with m.State("QUANTITY"):
            walk.take(3)
            with m.If(walk.beat == 3):
                m.d.comb += walk.left_given.eq(1)
                with m.If(function == model.DIAGNOSE):
                    m.next = "DIAGNOSE"
                with m.Elif(walk.phase[0] == walk.phase[1]):
                    # To read: check first, or send the head.
                    m.next = "ASK"
                    with m.If(walk.phase[0]):
                        walk.send_head(HEAD)
                    with m.Elif(walk.bad):
                        m.d.sync += walk.malformed.eq(1)
                        walk.end_phase()
                with m.Else():
                    m.d.sync += walk.malformed.eq(walk.malformed | walk.bad)
                    m.next = "BYTES"
        with m.State("BYTES"):
            walk.take(2)
            with m.If(walk.beat == 2):
                m.next = "VALUE"
                with m.If(walk.malformed | (walk.word[:BYTE] != walk.left << 1)):
                    m.d.sync += walk.malformed.eq(1)
                    walk.end_phase()
        with m.State("VALUE"):
            walk.take(3)
            with m.If(walk.beat == 3):
                m.next = "ASK"

    def _do_registers(self, m: Module, walk: Walk) -> None:
        """Add the states that ask the file for one register after another, and that finish a write."""
        file = self.file
        with m.State("ASK"):
            m.d.comb += file.start.eq(1)
            with m.If(file.done):
                m.next = "NEXT"
                with m.If(walk.phase == Operation.READ):
                    m.d.comb += walk.got.eq(1)
                    m.next = "SEND_HIGH"
        with m.State("NEXT"):
            m.d.comb += walk.onward.eq(1)
            m.d.sync += walk.first.eq(0)
            m.next = "ASK"
            with m.If(walk.left == 1):
                walk.end_phase()
                with m.If(walk.phase == Operation.READ):
                    m.next = "FINISHED"
                with m.Elif(walk.phase == Operation.WRITE):
                    m.next = "FINISH"
            with m.Elif((walk.phase[0] ^ walk.phase[1]) & ~walk.clearing):
                m.next = "VALUE"
        with m.State("FINISH"):
            m.d.comb += [file.start.eq(1), file.operation.eq(Operation.FINISH)]
            with m.If(file.done):
                m.next = "PHASE"

    def _diagnose(self, m: Module, walk: Walk) -> None:
        """Add the state of diagnostics: the first word is at `address`."""
        with m.State("DIAGNOSE"):
            sub = walk.address[: ADDRESS_BITS - 1]
            m.d.sync += walk.phase.eq(Operation.READ)
            with m.If(sub == model.ECHO):
                walk.send_head(ECHOED)
            with m.Elif(less(sub, model.CLEAR) | ~less(sub, model.LAST_COUNTER + 1)):
                walk.refuse(model.FUNCTION)
            with m.Elif(walk.word != 0):
                walk.refuse(model.VALUE)
            with m.Elif(sub == model.CLEAR):
                m.d.comb += [walk.own_address.eq(1), walk.own_left.eq(1), walk.size.eq(COUNTERS_CLEARED)]
                m.d.sync += [walk.phase.eq(Operation.WRITE), walk.clearing.eq(1)]
                m.next = "ASK"
            with m.Else():
                m.d.comb += [walk.own_address.eq(1), walk.counter.eq(sub), walk.own_left.eq(1)]
                walk.send_head(HEAD_OF_OTHERS)

    def _identify(self, m: Module, walk: Walk) -> None:
        """Add the state of identification.

        The first word, at `address`, has the kind, which is 14, and the code; then the number of the object comes.
        """
        answers = self._design.answers_at
        with m.State("IDENTIFY"):
            walk.take(2)
            m.d.sync += walk.phase.eq(Operation.READ)
            with m.If(walk.beat == 2):
                kind, asked, number_asked = walk.address[BYTE:CELL_BITS], walk.address[:BYTE], walk.word[:BYTE]
                named, known = asked == model.NAMED, less(number_asked, len(answers) // 2)
                with m.If(kind != model.DEVICE_IDENTIFICATION):
                    walk.refuse(model.FUNCTION)
                with m.Elif(~asked.any() | ~less(asked, model.NAMED + 1)):
                    walk.refuse(model.VALUE)
                with m.Elif(named & ~known):
                    walk.refuse(model.ABSENT)
                with m.Else():
                    walk.send_head(HEAD_OF_OTHERS)
                    # A number that is not known begins a stream at the first object.
                    chosen = Cat(Mux(known, number_asked[: exact_log2(ANSWERS)], 0), named)
                    m.d.comb += [walk.own_address.eq(1), walk.own_left.eq(1)]
                    m.d.comb += walk.place.eq(answers[False, 0][0] | chosen << exact_log2(ANSWER))
                    with m.Switch(chosen):
                        for (one, number), (_, registers) in answers.items():
                            with m.Case(one * ANSWERS + number):
                                m.d.comb += walk.size.eq(registers)

    def _answer(self, m: Module, walk: Walk) -> None:
        """Add the states that send the answer."""
        frames, answer = self.frames, self.frames.answer
        with m.State("HEAD"):
            # The byte is taken twice, and so into the upper half.
            m.d.comb += [walk.taking.eq(walk.beat[0] ^ walk.beat[1]), answer.valid.eq(walk.beat == 3)]
            m.d.comb += walk.excepting.eq((walk.code != 0) & walk.index[0])
            with m.If(walk.beat != 3):
                m.d.sync += walk.beat.eq(walk.beat + 1)
            with m.Elif(answer.ready):
                m.d.comb += walk.advance.eq(1)
                m.d.sync += walk.beat.eq(0)
                with m.If((walk.index + 1)[: len(walk.stop)] == walk.stop):
                    m.d.comb += walk.ending.eq(1)
                    with m.Switch(walk.stop):
                        with m.Case(HEAD):
                            m.next = "SEND_LAST"
                        with m.Case(HEAD_OF_OTHERS):
                            m.next = "ASK"
                        with m.Default():
                            m.next = "FINISHED"
        for state in ("SEND_LAST", "SEND_HIGH", "SEND_LOW"):
            with m.State(state):
                m.d.comb += answer.valid.eq(1)
                with m.If(answer.ready):
                    m.d.comb += walk.taking.eq(1)
                    m.next = {"SEND_HIGH": "SEND_LOW", "SEND_LOW": "NEXT", "SEND_LAST": "ASK"}[state]
                    if state == "SEND_LAST":
                        with m.If(walk.code != 0):
                            m.next = "FINISHED"
        with m.State("FINISHED"):
            m.d.comb += frames.finished.eq(1)
            m.next = "IDLE"
