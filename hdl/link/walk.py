"""The walk of a server through a frame: its words, the register that is next, and the phase."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib.wiring import PureInterface

from hardwall.model.axis.register_file import CELL_BITS, Operation
from hardwall.model.axis.registers import COUNTERS
from hardwall.model.link import server as model

from ..arithmetic.fixed import less
from .line import BYTE
from .requests import ADDRESS_BITS

FIELDS, FIELDS_TO_WRITE = 2, 6
"""Places in a request: of its first field, and of the first field of the registers to write if it reads as well."""
HEAD, HEAD_OF_OTHERS, ECHOED = 2, 4, 6
"""Bytes of a request that its answer begins with: of a read, of diagnostics and identification, and of a write."""


class Walk:
    """A server's place in a frame, and the steps of its states.

    Args:
        m: the server's module.
        frames: the line.
        file: the register file.

    Attributes:
        reads, writes, single: whether the function reads, writes, and writes one register.
        index, beat: the place of the requested byte, and the clock of the word that is taken.
        word, length: two bytes of the frame, or a register; and the byte of an answer that is its length, or its code.
        taking, got, ending: `word` takes a byte, a register, or the length.
        excepting: the byte to send is the function of an exception.
        advance, rewind, at_fields, at_written: `index` becomes the next place, or one of three.
        phase: what is done with the registers.
        address, left, first: the register, how many there are from it on, and whether it is the first one.
        malformed, clearing: the frame is not as it should be; the server clears its counters.
        code, stop: the exception, if any, and how many bytes of the frame are sent back.
        bad: the word is no number of registers that the phase may have.
        onward, address_given, left_given, own_address, own_left: the next `address` and `left`: of the next register,
            of a request, or of the device's own registers.
        counter, place, size: one of the counters, and the device's own registers: usually that counter.
    """

    def __init__(self, m: Module, frames: PureInterface, file: PureInterface):
        self.m, self.frames, self.file = m, frames, file
        self.reads, self.writes = Signal(), Signal()
        self.single = Signal()
        m.d.comb += [
            self.reads.eq(Cat(frames.function == each for each in model.READS).any()),
            self.writes.eq(Cat(frames.function == each for each in model.WRITES).any()),
            self.single.eq(frames.function == model.WRITE_ONE),
        ]
        self.phase = Signal(Operation)
        self.malformed, self.code, self.stop = Signal(), Signal(range(model.FAILURE + 1)), Signal(range(ECHOED + 1))
        self.clearing = Signal()
        self._take_words()
        self._ask()
        few, fewer, fewest = (
            less(self.word, most + 1) for most in (model.READ_MAX, model.WRITE_MAX, model.WRITE_AND_READ_MAX)
        )
        self.bad = ~self.word.any() | ~Mux(self.writes & self.phase[0], Mux(self.reads, fewest, fewer), few)
        self._choose_registers()

    def _take_words(self) -> None:
        """Describe the word. A byte comes a clock after its `index`, and is looked at a clock later: memory is slow."""
        m, frames = self.m, self.frames
        self.index, self.beat = Signal(BYTE), Signal(2)
        self.word, self.length = Signal(CELL_BITS), Signal(BYTE)
        self.taking, self.got, self.ending, self.excepting = Signal(), Signal(), Signal(), Signal()
        with m.If(self.taking | self.got | self.ending):
            taken = Cat(frames.byte, self.word[:BYTE])
            of_frame = Cat(taken[:BYTE], Mux(self.ending, self.length, taken[BYTE:]))
            m.d.sync += self.word.eq(Mux(self.got, self.file.data, of_frame))
        self.advance, self.rewind, self.at_fields, self.at_written = Signal(), Signal(), Signal(), Signal()
        m.d.comb += frames.index.eq(self.index)
        with m.If(self.advance | self.rewind | self.at_fields | self.at_written):
            begin = Mux(self.at_written, FIELDS_TO_WRITE, Mux(self.at_fields, FIELDS, 0))
            m.d.sync += self.index.eq(Mux(self.advance, self.index + 1, begin))

    def _ask(self) -> None:
        """Ask the file for the register, and give the word to the line."""
        file, word = self.file, self.word
        self.address, self.left = Signal(ADDRESS_BITS), Signal(BYTE)
        self.first = Signal()
        self.m.d.comb += [
            file.operation.eq(self.phase),
            file.address.eq(self.address),
            file.first.eq(self.first),
            file.last.eq(self.left == 1),
            file.value.eq(word),
            self.length.eq(Mux(self.code == 0, self.left << 1, self.code)),
            self.frames.answer.payload.eq(Cat(word[BYTE:-1], word[-1] | self.excepting)),
        ]

    def _choose_registers(self) -> None:
        """Describe what `address` and `left` become."""
        m = self.m
        self.onward, self.address_given, self.left_given = Signal(), Signal(), Signal()
        self.own_address, self.own_left = Signal(), Signal()
        self.counter, self.place, self.size = Signal(3), Signal(ADDRESS_BITS), Signal(BYTE)
        m.d.comb += [self.place.eq(COUNTERS | self.counter), self.size.eq(1)]
        with m.If(self.onward | self.address_given | self.own_address):
            given = Mux(self.address_given, self.word, self.place)
            m.d.sync += self.address.eq(Mux(self.onward, self.address + 1, given))
        with m.If(self.onward | self.left_given | self.own_left):
            given = Mux(self.left_given, self.word, self.size)
            m.d.sync += self.left.eq(Mux(self.onward, self.left - 1, given))

    def take(self, last: int) -> None:
        """Take two bytes, in the word at beat 3, or one byte, in its lower half at beat 2."""
        m, beat = self.m, self.beat
        m.d.comb += self.taking.eq(beat[0] ^ beat[1])
        m.d.sync += beat.eq(beat + 1)
        with m.If(beat < last - 1):
            m.d.comb += self.advance.eq(1)
        with m.If(beat == last):
            m.d.sync += beat.eq(0)

    def count(self, number: int) -> None:
        """Go on to count one more of something."""
        self.m.d.comb += [self.own_address.eq(1), self.counter.eq(number)]
        self.m.next = "COUNT"

    def refuse(self, exception: int) -> None:
        """Go on to answer with an exception."""
        self.m.d.sync += self.code.eq(exception)
        self.count(model.EXCEPTIONS)

    def send_head(self, length: int) -> None:
        """Send the first bytes of the frame, and then what belongs behind them."""
        self.m.d.comb += self.rewind.eq(1)
        self.m.d.sync += self.stop.eq(length)
        self.m.next = "HEAD"

    def end_phase(self) -> None:
        """Go on to the next phase."""
        self.m.d.sync += self.phase.eq(self.phase + 1)
        self.m.next = "PHASE"
