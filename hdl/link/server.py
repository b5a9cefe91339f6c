"""The application layer of Modbus: functions and exceptions over a register file."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hardwall.model.axis.register_file import ANSWER, ANSWERS, CELL_BITS, Design, Operation
from hardwall.model.axis.registers import COUNTERS
from hardwall.model.link import server as model
from hardwall.model.link.line import Verdict

from ..arithmetic.fixed import less
from .line import BYTE, Frames
from .requests import ADDRESS_BITS, Requests

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

    Latency: to the first byte of an answer less than 30 clocks, 21 for every register to write, 4 for every register to
    read, and the register file's times for a snapshot and a commit. Throughput: one frame after the other; a byte of an
    answer waits for the line.

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
        function, answers = frames.function, self._design.answers_at
        reads, writes, single = Signal(), Signal(), Signal()
        m.d.comb += [
            reads.eq(Cat(function == each for each in model.READS).any()),
            writes.eq(Cat(function == each for each in model.WRITES).any()),
            single.eq(function == model.WRITE_ONE),
        ]

        # A byte of the frame comes a clock after its `index`, and is looked at a clock later: a memory is slow.
        index, beat = Signal(BYTE), Signal(2)
        word, length = Signal(CELL_BITS), Signal(BYTE)
        taking, got, ending, excepting = Signal(), Signal(), Signal(), Signal()
        with m.If(taking | got | ending):
            taken = Cat(frames.byte, word[:BYTE])
            m.d.sync += word.eq(Mux(got, file.data, Cat(taken[:BYTE], Mux(ending, length, taken[BYTE:]))))
        # What `index` becomes is the next place, or one of three.
        advance, rewind, at_fields, at_written = Signal(), Signal(), Signal(), Signal()
        m.d.comb += frames.index.eq(index)
        with m.If(advance | rewind | at_fields | at_written):
            begin = Mux(at_written, FIELDS_TO_WRITE, Mux(at_fields, FIELDS, 0))
            m.d.sync += index.eq(Mux(advance, index + 1, begin))

        def take(last: int):
            """Take two bytes, which are in the word at beat 3, or one, which is in its lower half at beat 2."""
            m.d.comb += taking.eq(beat[0] ^ beat[1])
            m.d.sync += beat.eq(beat + 1)
            with m.If(beat < last - 1):
                m.d.comb += advance.eq(1)
            with m.If(beat == last):
                m.d.sync += beat.eq(0)

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
            length.eq(Mux(code == 0, left << 1, code)),
            answer.payload.eq(Cat(word[BYTE:-1], word[-1] | excepting)),
        ]
        few, fewer, fewest = (
            less(word, most + 1) for most in (model.READ_MAX, model.WRITE_MAX, model.WRITE_AND_READ_MAX)
        )
        bad = ~word.any() | ~Mux(writes & phase[0], Mux(reads, fewest, fewer), few)

        # What `address` and `left` become: those of the next register, of a request, or of this device's own.
        onward, address_given, left_given, own_address, own_left = Signal(), Signal(), Signal(), Signal(), Signal()
        counter, place, size = Signal(3), Signal(ADDRESS_BITS), Signal(BYTE)
        m.d.comb += [place.eq(COUNTERS | counter), size.eq(1)]
        with m.If(onward | address_given | own_address):
            m.d.sync += address.eq(Mux(onward, address + 1, Mux(address_given, word, place)))
        with m.If(onward | left_given | own_left):
            m.d.sync += left.eq(Mux(onward, left - 1, Mux(left_given, word, size)))

        def count(number: int):
            m.d.comb += [own_address.eq(1), counter.eq(number)]
            m.next = "COUNT"

        def refuse(exception: int):
            m.d.sync += code.eq(exception)
            count(model.EXCEPTIONS)

        def send_head(length: int):
            """Send the first bytes of the frame, and then what belongs behind them."""
            m.d.comb += rewind.eq(1)
            m.d.sync += stop.eq(length)
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
                with m.If(file.done):
                    m.next = "FINISHED"
                    with m.Switch(address[:3]):
                        with m.Case(model.MESSAGES):
                            with m.If(frames.verdict == Verdict.REQUEST):
                                count(model.REQUESTS)
                            with m.Elif(frames.verdict == Verdict.BROADCAST):
                                count(model.UNANSWERED)
                        with m.Case(model.REQUESTS):
                            m.d.comb += at_fields.eq(1)
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
                    m.d.comb += [at_written.eq(reads), at_fields.eq(1)]
                    m.next = "ADDRESS"
                    with m.If(~writes):
                        end_phase()
                with m.Case(Operation.WRITE):
                    m.d.comb += [at_written.eq(reads), at_fields.eq(1)]
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
                m.d.comb += [file.start.eq(1), file.operation.eq(Operation.SNAPSHOT), at_fields.eq(1)]
                with m.If(file.done):
                    m.next = "ADDRESS"
            with m.State("ADDRESS"):
                take(3)
                m.d.sync += first.eq(1)
                with m.If(beat == 3):
                    m.d.comb += [address_given.eq(1), own_left.eq(1)]
                    m.next = "QUANTITY"
                    with m.If(single):
                        m.next = "VALUE"
                    with m.Elif(function == model.IDENTIFY):
                        m.next = "IDENTIFY"
            with m.State("QUANTITY"):
                take(3)
                with m.If(beat == 3):
                    m.d.comb += left_given.eq(1)
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
                take(2)
                with m.If(beat == 2):
                    m.next = "VALUE"
                    with m.If(malformed | (word[:BYTE] != left << 1)):
                        m.d.sync += malformed.eq(1)
                        end_phase()
            with m.State("VALUE"):
                take(3)
                with m.If(beat == 3):
                    m.next = "ASK"

            # A register.
            with m.State("ASK"):
                m.d.comb += file.start.eq(1)
                with m.If(file.done):
                    m.next = "NEXT"
                    with m.If(phase == Operation.READ):
                        m.d.comb += got.eq(1)
                        m.next = "SEND_HIGH"
            with m.State("NEXT"):
                m.d.comb += onward.eq(1)
                m.d.sync += first.eq(0)
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
                with m.Elif(less(sub, model.CLEAR) | ~less(sub, model.LAST_COUNTER + 1)):
                    refuse(model.FUNCTION)
                with m.Elif(word != 0):
                    refuse(model.VALUE)
                with m.Elif(sub == model.CLEAR):
                    m.d.comb += [own_address.eq(1), own_left.eq(1), size.eq(COUNTERS_CLEARED)]
                    m.d.sync += [phase.eq(Operation.WRITE), clearing.eq(1)]
                    m.next = "ASK"
                with m.Else():
                    m.d.comb += [own_address.eq(1), counter.eq(sub), own_left.eq(1)]
                    send_head(HEAD_OF_OTHERS)
            with m.State("IDENTIFY"):
                # The first word has the kind, which is 14, and the code; then the number of the object comes.
                take(2)
                m.d.sync += phase.eq(Operation.READ)
                with m.If(beat == 2):
                    kind, asked, number_asked = address[BYTE:CELL_BITS], address[:BYTE], word[:BYTE]
                    named, known = asked == model.NAMED, less(number_asked, len(answers) // 2)
                    with m.If(kind != model.DEVICE_IDENTIFICATION):
                        refuse(model.FUNCTION)
                    with m.Elif(~asked.any() | ~less(asked, model.NAMED + 1)):
                        refuse(model.VALUE)
                    with m.Elif(named & ~known):
                        refuse(model.ABSENT)
                    with m.Else():
                        send_head(HEAD_OF_OTHERS)
                        # A number that is not known begins a stream at the first object.
                        chosen = Cat(Mux(known, number_asked[: exact_log2(ANSWERS)], 0), named)
                        m.d.comb += [own_address.eq(1), own_left.eq(1)]
                        m.d.comb += place.eq(answers[False, 0][0] | chosen << exact_log2(ANSWER))
                        with m.Switch(chosen):
                            for (one, number), (_, registers) in answers.items():
                                with m.Case(one * ANSWERS + number):
                                    m.d.comb += size.eq(registers)

            # The answer.
            with m.State("HEAD"):
                # The byte is taken twice, and so into the upper half.
                m.d.comb += [taking.eq(beat[0] ^ beat[1]), answer.valid.eq(beat == 3)]
                m.d.comb += excepting.eq((code != 0) & index[0])
                with m.If(beat != 3):
                    m.d.sync += beat.eq(beat + 1)
                with m.Elif(answer.ready):
                    m.d.comb += advance.eq(1)
                    m.d.sync += beat.eq(0)
                    with m.If((index + 1)[: len(stop)] == stop):
                        m.d.comb += ending.eq(1)
                        with m.Switch(stop):
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
                        m.d.comb += taking.eq(1)
                        m.next = {"SEND_HIGH": "SEND_LOW", "SEND_LOW": "NEXT", "SEND_LAST": "ASK"}[state]
                        if state == "SEND_LAST":
                            with m.If(code != 0):
                                m.next = "FINISHED"
            with m.State("FINISHED"):
                m.d.comb += frames.finished.eq(1)
                m.next = "IDLE"
        return m
