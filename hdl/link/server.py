"""The application layer of Modbus: functions and exceptions over a register file."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.link import server as model
from hardwall.model.link.line import Verdict
from hardwall.model.link.register_file import CELL_BITS, Design, Operation
from hardwall.model.registers import COUNTERS

from .line import BYTE, Frames
from .register_file import ADDRESS_BITS, Requests

FIELDS, FIELDS_TO_WRITE = 2, 6
"""Places in a request: of its first field, and of the first field of the registers to write if it reads as well."""
HEAD, HEAD_OF_OTHERS, ECHOED = 2, 4, 6
"""Bytes of a request that its answer begins with: of a read, of diagnostics and identification, and of a write."""
COUNTERS_CLEARED = 8


class Server(wiring.Component):
    """The requests of frames carried out on a register file, and their answers.

    Equation: the model's, word for word; it has the order of the checks. A frame is walked register by register: once
    to check it, and once to do it, so nothing is done of a frame that ends in an exception. A frame that reads takes a
    snapshot before the first register.

    Latency: to the first byte of an answer less than 30 clocks, 20 for every register to write, 3 for every register to
    read, and the register file's times for a snapshot and a commit. Throughput: one frame after the other; a byte of an
    answer waits for the line.

    Rounding and overflow: the counters wrap.

    Parameters
    ----------
    design : hardwall.model.link.register_file.Design
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

    Source: "Modbus Application Protocol Specification V1.1b3", sections 6.3, 6.4, 6.6, 6.8, 6.12, 6.17, 6.21 (the
    functions) and 7 (the exceptions).
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
        frames, file, answer = self.frames, self.file, self.frames.answer
        function = frames.function
        reads, writes, single = Signal(), Signal(), Signal()
        m.d.comb += [
            reads.eq(Cat(function == each for each in model.READS).any()),
            writes.eq(Cat(function == each for each in model.WRITES).any()),
            single.eq(function == model.WRITE_ONE),
        ]

        # Two clocks take a byte of the frame: `index` goes out, and the byte comes. Four take a word.
        index, beat = Signal(BYTE), Signal(2)
        word, taken = Signal(CELL_BITS), Signal(CELL_BITS)
        m.d.comb += [frames.index.eq(index), taken.eq(Cat(frames.byte, word[:BYTE]))]

        def take():
            """Take a byte at every second clock; the word is there at beat 3."""
            m.d.sync += beat.eq(beat + 1)
            with m.If(beat[0]):
                m.d.sync += [word.eq(taken), index.eq(index + 1)]

        phase = Signal(Operation)
        address, left, first = Signal(ADDRESS_BITS), Signal(BYTE), Signal()
        malformed, clearing = Signal(), Signal()
        code, stop = Signal(range(model.FAILURE + 1)), Signal(range(ECHOED + 1))
        m.d.comb += [
            file.operation.eq(phase),
            file.address.eq(address),
            file.first.eq(first),
            file.last.eq(left == 1),
            file.value.eq(word),
        ]
        most = Mux(writes & phase[0], Mux(reads, model.WRITE_AND_READ_MAX, model.WRITE_MAX), model.READ_MAX)

        def count(counter: int):
            m.d.sync += address.eq(COUNTERS + counter)
            m.next = "COUNT"

        def refuse(exception: int):
            m.d.sync += code.eq(exception)
            count(model.EXCEPTIONS)

        def send_head(length: int):
            """Send the first bytes of the frame, and then what belongs behind them."""
            m.d.sync += [index.eq(0), stop.eq(length)]
            m.next = "HEAD"

        def end_phase():
            m.d.sync += phase.eq(phase + 1)
            m.next = "PHASE"

        with m.FSM():
            with m.State("IDLE"):
                m.d.sync += [code.eq(0), clearing.eq(0), malformed.eq(0), beat.eq(0), phase.eq(Operation.CHECK_READ)]
                with m.If(frames.ended), m.Switch(frames.verdict):
                    with m.Case(Verdict.SPOILT):
                        count(model.ERRORS)
                    with m.Case(Verdict.OVERRUN):
                        count(model.OVERRUNS)
                    with m.Default():
                        count(model.MESSAGES)
            with m.State("COUNT"):
                m.d.comb += [file.start.eq(1), file.clear.eq(1), file.operation.eq(Operation.COUNT)]
                m.d.sync += index.eq(FIELDS)
                with m.If(file.done):
                    m.next = "FINISHED"
                    with m.Switch(address[:3]):
                        with m.Case(model.MESSAGES):
                            with m.If(frames.verdict == Verdict.REQUEST):
                                count(model.REQUESTS)
                            with m.Elif(frames.verdict == Verdict.BROADCAST):
                                count(model.UNANSWERED)
                        with m.Case(model.REQUESTS):
                            m.next = "PHASE"
                            with m.If((function == model.DIAGNOSE) | (function == model.IDENTIFY)):
                                m.next = "ADDRESS"
                            with m.Elif(~reads & ~writes):
                                refuse(model.FUNCTION)
                        with m.Case(model.EXCEPTIONS):
                            send_head(HEAD)

            # What a frame that reads or writes goes through: check the registers to read, check those to write, write,
            # read.
            with m.State("PHASE"), m.Switch(phase):
                with m.Case(Operation.CHECK_READ):
                    m.next = "ADDRESS"
                    with m.If(~reads):
                        end_phase()
                with m.Case(Operation.CHECK_WRITE):
                    m.d.sync += index.eq(Mux(reads, FIELDS_TO_WRITE, FIELDS))
                    m.next = "ADDRESS"
                    with m.If(~writes):
                        end_phase()
                with m.Case(Operation.WRITE):
                    m.d.sync += index.eq(Mux(reads, FIELDS_TO_WRITE, FIELDS))
                    m.next = "ADDRESS"
                    with m.If(~writes):
                        end_phase()
                    with m.If(file.refused):
                        refuse(model.FAILURE)
                    with m.If(file.outside):
                        refuse(model.VALUE)
                    with m.If(file.absent):
                        refuse(model.ABSENT)
                    with m.If(malformed):
                        refuse(model.VALUE)
                with m.Case(Operation.READ):
                    m.next = "SNAPSHOT"
                    with m.If(~reads):
                        send_head(ECHOED)
            with m.State("SNAPSHOT"):
                m.d.comb += [file.start.eq(1), file.operation.eq(Operation.SNAPSHOT)]
                m.d.sync += index.eq(FIELDS)
                with m.If(file.done):
                    m.next = "ADDRESS"
            with m.State("ADDRESS"):
                take()
                m.d.sync += first.eq(1)
                with m.If(beat == 3):
                    m.d.sync += [address.eq(taken), left.eq(1)]
                    m.next = "QUANTITY"
                    with m.If(single):
                        m.next = "VALUE"
                    with m.Elif(function == model.IDENTIFY):
                        m.next = "IDENTIFY"
            with m.State("QUANTITY"):
                take()
                with m.If(beat == 3):
                    m.d.sync += left.eq(taken)
                    bad = (taken == 0) | taken[7:].any() | (taken[:7] > most)
                    with m.If(function == model.DIAGNOSE):
                        m.next = "DIAGNOSE"
                    with m.Elif(phase[0] == phase[1]):
                        # To read: check first, or send the head.
                        m.next = "ASK"
                        with m.If(phase[0]):
                            send_head(HEAD)
                        with m.Elif(bad):
                            m.d.sync += malformed.eq(1)
                            end_phase()
                    with m.Else():
                        m.d.sync += malformed.eq(malformed | bad)
                        m.next = "BYTES"
            with m.State("BYTES"):
                take()
                with m.If(beat[0]):
                    m.d.sync += beat.eq(0)
                    m.next = "VALUE"
                    with m.If(malformed | (frames.byte != left << 1)):
                        m.d.sync += malformed.eq(1)
                        end_phase()
            with m.State("VALUE"):
                take()
                with m.If(beat == 3):
                    m.next = "ASK"

            # A register.
            with m.State("ASK"):
                m.d.comb += file.start.eq(1)
                with m.If(file.done):
                    m.next = "NEXT"
                    with m.If(phase == Operation.READ):
                        m.d.sync += word.eq(file.data)
                        m.next = "SEND_HIGH"
            with m.State("NEXT"):
                m.d.sync += [address.eq(address + 1), left.eq(left - 1), first.eq(0)]
                m.next = "ASK"
                with m.If(left == 1):
                    end_phase()
                    with m.If(phase == Operation.READ):
                        m.next = "FINISHED"
                    with m.Elif(phase == Operation.WRITE):
                        m.next = "FINISH"
                with m.Elif((phase[0] ^ phase[1]) & ~clearing):
                    m.next = "VALUE"
            with m.State("FINISH"):
                m.d.comb += [file.start.eq(1), file.operation.eq(Operation.FINISH)]
                with m.If(file.done):
                    m.next = "PHASE"

            # The other functions: their first word is at `address`.
            with m.State("DIAGNOSE"):
                sub = address[: ADDRESS_BITS - 1]
                m.d.sync += phase.eq(Operation.READ)
                with m.If(sub == model.ECHO):
                    send_head(ECHOED)
                with m.Elif(sub[5:].any() | (sub[:5] < model.CLEAR) | (sub[:5] > model.LAST_COUNTER)):
                    refuse(model.FUNCTION)
                with m.Elif(word != 0):
                    refuse(model.VALUE)
                with m.Elif(sub == model.CLEAR):
                    m.d.sync += [address.eq(COUNTERS), left.eq(COUNTERS_CLEARED), clearing.eq(1)]
                    m.d.sync += phase.eq(Operation.WRITE)
                    m.next = "ASK"
                with m.Else():
                    m.d.sync += [address.eq(COUNTERS | sub[:3]), left.eq(1)]
                    send_head(HEAD_OF_OTHERS)
            with m.State("IDENTIFY"):
                # The word has the kind, which is 14, and the code; then the number of the object comes.
                take()
                m.d.sync += phase.eq(Operation.READ)
                with m.If(beat[0]):
                    m.d.sync += beat.eq(0)
                    kind, asked = word[BYTE:], word[:BYTE]
                    named = asked == model.NAMED
                    with m.If(kind != model.DEVICE_IDENTIFICATION):
                        refuse(model.FUNCTION)
                    with m.Elif((asked == 0) | (asked > model.NAMED)):
                        refuse(model.VALUE)
                    with m.Else():
                        send_head(HEAD_OF_OTHERS)
                        # A number that is not known begins a stream at the first object, and is no single object.
                        for (one, number), (place, size) in self._design.answers_at.items():
                            with m.If((named == one) & ((frames.byte == number) | (~named & (number == 0)))):
                                m.d.sync += [address.eq(place), left.eq(size)]
                        with m.If(named & (frames.byte >= len(self._design.answers_at) // 2)):
                            refuse(model.ABSENT)

            # The answer.
            with m.State("HEAD"):
                m.d.comb += [
                    answer.valid.eq(beat[0]),
                    answer.payload.eq(Cat(frames.byte[:-1], frames.byte[-1] | ((code != 0) & index[0]))),
                ]
                with m.If(~beat[0]):
                    m.d.sync += beat.eq(1)
                with m.Elif(answer.ready):
                    m.d.sync += [beat.eq(0), index.eq(index + 1)]
                    with m.If(index + 1 == stop):
                        m.d.sync += word.eq(Cat(Const(0, BYTE), Mux(code == 0, left << 1, code)))
                        with m.Switch(stop):
                            with m.Case(HEAD):
                                m.next = "SEND_LAST"
                            with m.Case(HEAD_OF_OTHERS):
                                m.next = "ASK"
                            with m.Default():
                                m.next = "FINISHED"
            for state in ("SEND_LAST", "SEND_HIGH", "SEND_LOW"):
                with m.State(state):
                    m.d.comb += [answer.valid.eq(1), answer.payload.eq(word[BYTE:])]
                    with m.If(answer.ready):
                        m.d.sync += word.eq(word << BYTE)
                        m.next = {"SEND_HIGH": "SEND_LOW", "SEND_LOW": "NEXT", "SEND_LAST": "ASK"}[state]
                        if state == "SEND_LAST":
                            with m.If(code != 0):
                                m.next = "FINISHED"
            with m.State("FINISHED"):
                m.d.comb += frames.finished.eq(1)
                m.next = "IDLE"
        return m
