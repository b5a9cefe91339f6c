"""The serial-line layer of Modbus RTU: frames out of bytes, and answers with their CRC into bytes."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.crc.catalog import CRC16_MODBUS
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from hardwall.model.checks import check_int
from hardwall.model.link.line import BROADCAST, COUNTED, FIXED, FRAME_MAX, FRAME_MIN, UNIT, Verdict

BYTE = 8
UNMIXED = {"no_rw_check": 1}
"""The attribute of a memory in which data read in the clock of a write to the same address is not used."""


class Frames(wiring.Signature):
    """The way from the line to a server, as the line sees it.

    Members
    -------
    verdict : Out(range(5))
        While `ended`: a `model.link.line.Verdict` on the frame.
    ended : Out(1)
        High from the end of a frame until `finished`.
    function : Out(8)
        The frame's second byte.
    index : In(8)
        A place in the frame.
    byte : Out(8)
        The byte at the place that `index` had a clock before; it holds until `finished`.
    answer : In(stream.Signature(8))
        The bytes of the answer to a request, without the CRC.
    finished : In(1)
        Pulse, with `ended` and a clock or more after the last byte of the answer: the frame has been dealt with.
    """

    def __init__(self):
        super().__init__(
            {
                "verdict": Out(range(len(Verdict))),
                "ended": Out(1),
                "function": Out(BYTE),
                "index": In(range(FRAME_MAX)),
                "byte": Out(BYTE),
                "answer": In(stream.Signature(BYTE)),
                "finished": In(1),
            }
        )


class Line(wiring.Component):
    """Bytes from a receiver to frames with a verdict, and answers with their CRC to a transmitter.

    Equation: a frame ends with the byte that its function and byte count make its last one. If the length is unknown,
    the frame ends when no byte has arrived for `gap_clocks` clocks. A frame is spoilt if it ends so before its known
    length, has 256 bytes without an end, a bad CRC or a spoilt byte. The model says why no single flipped bit passes.

    After a spoilt frame, bytes are dropped until a gap, without another verdict. Others that arrive while a frame is
    judged, is `ended`, or its answer is under way are dropped, too: then comes the verdict `OVERRUN`, and up to a gap
    bytes are dropped.

    The answer to a request passes to `sent`, and its CRC follows `finished`.

    Latency: `ended` 2 clocks after the last byte arrived; 2 clocks after a gap. Throughput: a byte a clock.

    Rounding and overflow: none.

    Parameters
    ----------
    gap_clocks : int
        The silence that ends a frame, clocks, 2 or more.

    Members
    -------
    byte : In(8)
        With `arrived`: a byte.
    arrived, spoilt : In(1)
        Pulse: take `byte`; with it, the byte is not good.
    sent : Out(stream.Signature(8))
        The bytes of answers.
    frames : Out(Frames)
        The frames, and the answers to them.

    Raises
    ------
    TypeError
        If `gap_clocks` is not an int.
    ValueError
        If `gap_clocks` is less than 2.

    Source: "Modbus over Serial Line, Specification and Implementation Guide", sections 2.2 (addresses), 2.5.1.1 (frame)
    and 6.2.2 (CRC); the end by length instead of by 3.5 characters of silence is for adapters that pause.
    """

    def __init__(self, gap_clocks: int):
        check_int("gap_clocks", gap_clocks, 2)
        self._gap_clocks = gap_clocks
        super().__init__(
            {
                "byte": In(BYTE),
                "arrived": In(1),
                "spoilt": In(1),
                "sent": Out(stream.Signature(BYTE)),
                "frames": Out(Frames()),
            }
        )

    @property
    def gap_clocks(self) -> int:
        return self._gap_clocks

    def elaborate(self, platform):
        m = Module()
        frames = self.frames
        m.submodules.frame = frame = Memory(shape=BYTE, depth=FRAME_MAX, init=[], attrs=UNMIXED)
        write, read = frame.write_port(), frame.read_port()
        m.submodules.crc = check = CRC16_MODBUS(data_width=BYTE).create()
        position, last = Signal(range(FRAME_MAX)), Signal(range(FRAME_MAX + BYTE + max(COUNTED.values())))
        known, spoilt, draining, overrun, good = Signal(), Signal(), Signal(), Signal(), Signal()
        addressed = Signal(Verdict, init=Verdict.FOREIGN)
        quiet = Signal(range(self._gap_clocks + 1))
        gap = quiet == self._gap_clocks
        m.d.sync += quiet.eq(Mux(self.arrived, 0, quiet + ~gap))
        m.d.comb += [
            write.addr.eq(position),
            write.data.eq(self.byte),
            read.addr.eq(frames.index),
            frames.byte.eq(read.data),
            check.data.eq(Mux(frames.ended, frames.answer.payload, self.byte)),
            self.sent.payload.eq(frames.answer.payload),
        ]

        listening, lost = Signal(), Signal()
        m.d.comb += lost.eq(overrun | (self.arrived & ~listening & ~draining))
        m.d.sync += overrun.eq(lost)
        with m.FSM():
            with m.State("LISTEN"):
                m.d.comb += listening.eq(1)
                m.d.sync += good.eq(0)
                with m.If(self.arrived & ~draining):
                    m.d.comb += [write.en.eq(1), check.valid.eq(1), check.start.eq(position == 0)]
                    m.d.sync += [position.eq(position + 1), spoilt.eq(spoilt | self.spoilt)]
                    with m.Switch(position):
                        with m.Case(0):
                            m.d.sync += addressed.eq(
                                Mux(
                                    self.byte == UNIT,
                                    Verdict.REQUEST,
                                    Mux(self.byte == BROADCAST, Verdict.BROADCAST, Verdict.FOREIGN),
                                )
                            )
                        with m.Case(1):
                            m.d.sync += frames.function.eq(self.byte)
                            with m.Switch(self.byte):
                                for function, length in FIXED.items():
                                    with m.Case(function):
                                        m.d.sync += [last.eq(length - 1), known.eq(1)]
                        for function, place in COUNTED.items():
                            with m.Case(place), m.If(frames.function == function):
                                m.d.sync += [last.eq(self.byte + place + 2), known.eq(1)]
                    whole = known & (position == last)
                    with m.If(whole | position.all()):
                        m.d.sync += good.eq(whole)
                        m.next = "JUDGE"
                with m.Elif(gap & ~self.arrived):
                    m.d.sync += draining.eq(0)
                    with m.If(position != 0):
                        # Only a function that has no length may end so.
                        has_length = [frames.function == function for function in (*FIXED, *COUNTED)]
                        m.d.sync += good.eq((position >= FRAME_MIN) & ~Cat(has_length).any())
                        m.next = "JUDGE"
            with m.State("JUDGE"):
                # The CRC of a good frame with its CRC is the residue; the answer's CRC begins afresh.
                m.d.comb += check.start.eq(1)
                m.d.sync += [position.eq(0), known.eq(0), spoilt.eq(0)]
                with m.If(good & ~spoilt & check.match_detected):
                    m.d.sync += frames.verdict.eq(addressed)
                with m.Else():
                    # What is spoilt otherwise than by a gap lasts until one.
                    m.d.sync += [frames.verdict.eq(Verdict.SPOILT), draining.eq(~gap)]
                m.next = "ENDED"
            with m.State("ENDED"):
                m.d.comb += [
                    frames.ended.eq(1),
                    self.sent.valid.eq(frames.answer.valid),
                    frames.answer.ready.eq(self.sent.ready),
                    check.valid.eq(frames.answer.valid & self.sent.ready),
                ]
                with m.If(frames.finished):
                    m.next = "OVER"
                    with m.If(frames.verdict == Verdict.REQUEST):
                        m.next = "CRC_LOW"
            with m.State("CRC_LOW"):
                m.d.comb += [self.sent.valid.eq(1), self.sent.payload.eq(check.crc[:BYTE])]
                with m.If(self.sent.ready):
                    m.next = "CRC_HIGH"
            with m.State("CRC_HIGH"):
                m.d.comb += [self.sent.valid.eq(1), self.sent.payload.eq(check.crc[BYTE:])]
                with m.If(self.sent.ready):
                    m.next = "OVER"
            with m.State("OVER"):
                m.next = "LISTEN"
                with m.If(lost):
                    m.d.sync += [overrun.eq(0), draining.eq(1), frames.verdict.eq(Verdict.OVERRUN)]
                    m.next = "ENDED"
        return m
