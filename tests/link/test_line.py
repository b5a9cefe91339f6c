"""The serial-line layer: frames of RTL and twin alike, CRC against an implementation of others, and no flipped bit."""

import cocotb
import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import RisingEdge
from pymodbus.framer import FramerRTU

from hardwall.hdl.link import line as hdl
from hardwall.model.link.line import COUNTED, FIXED, FRAME_MAX, Line, Verdict, crc, framed, length_of
from hardwall.testing import Bench, parameters, rng, simulate
from stimuli.frames import flips, requests

GAP = 40


class Flat(wiring.Component):
    """A line whose ports are no streams."""

    def __init__(self, gap_clocks: int):
        self.gap_clocks = gap_clocks
        super().__init__(
            {
                "byte": In(8),
                "arrived": In(1),
                "spoilt": In(1),
                "verdict": Out(3),
                "ended": Out(1),
                "function": Out(8),
                "index": In(8),
                "kept": Out(8),
                "answer": In(8),
                "answering": In(1),
                "taken": Out(1),
                "finished": In(1),
                "sent": Out(8),
                "sending": Out(1),
                "ready": In(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.line = line = hdl.Line(self.gap_clocks)
        frames, sent = line.frames, line.sent
        m.d.comb += [line.byte.eq(self.byte), line.arrived.eq(self.arrived), line.spoilt.eq(self.spoilt)]
        m.d.comb += [frames.index.eq(self.index), self.kept.eq(frames.byte), frames.finished.eq(self.finished)]
        m.d.comb += [self.verdict.eq(frames.verdict), self.ended.eq(frames.ended), self.function.eq(frames.function)]
        m.d.comb += [frames.answer.payload.eq(self.answer), frames.answer.valid.eq(self.answering)]
        m.d.comb += [self.taken.eq(frames.answer.ready), self.sent.eq(sent.payload), self.sending.eq(sent.valid)]
        m.d.comb += sent.ready.eq(self.ready)
        return m


def make(gap_clocks: int) -> Flat:
    return Flat(gap_clocks)


class Wire:
    """The world around a line: bytes in, verdicts and answers out, with the twin beside it."""

    def __init__(self, dut):
        self.dut, self.bench, self.twin, self.random = dut, Bench(dut, make(**parameters())), Line(), rng()
        self.ended, self.verdict = self.bench.reader("ended"), self.bench.reader("verdict")
        self.seen: list[Verdict] = []
        self.noise = 0

    async def clocks(self, count: int) -> None:
        for _ in range(count):
            await RisingEdge(self.dut.clk)

    async def send(self, byte: int, spoilt: bool = False, pause: int = 0) -> None:
        """Send a byte, wait for the verdict if the twin has one, and compare."""
        self.bench.drive(byte=byte, spoilt=spoilt, arrived=1)
        await self.clocks(1)
        self.bench.drive(arrived=0)
        await self.agree(self.twin.receive(byte, spoilt))
        await self.clocks(pause)

    async def gap(self) -> None:
        """Be silent for a gap."""
        for _ in range(GAP + 4):
            await self.clocks(1)
            if self.ended():
                break
        await self.agree(self.twin.gap())
        await self.clocks(GAP)

    async def agree(self, expected: Verdict | None) -> None:
        """Compare the verdict, the bytes kept and a framed answer of any length with the twin's."""
        await self.clocks(4)
        assert self.ended() == (expected is not None)
        if expected is None:
            return
        assert self.verdict() == expected
        self.seen.append(expected)
        if expected is Verdict.REQUEST:
            kept = []
            for index in range(len(self.twin.frame)):
                self.bench.drive(index=index)
                await self.clocks(2)
                kept.append(int(self.dut.kept.value))
            assert bytes(kept) == bytes(self.twin.frame)
            assert int(self.dut.function.value) == self.twin.frame[1]
            answer = self.random.bytes(self.random.integers(1, FRAME_MAX - 1))
            assert await self.answered(answer) == framed(answer)
        else:
            await self.finish()
        await self.clocks(3)

    async def finish(self) -> None:
        self.bench.drive(answering=0, finished=1)
        await self.clocks(1)
        self.bench.drive(finished=0)

    async def answered(self, answer: bytes) -> bytes:
        """Give an answer to the line, to a transmitter that is ready at random; return what the line sends."""
        sent, left = [], list(answer)
        for _ in range(100 * (len(answer) + 2)):
            ready = int(self.random.random() < 0.5)
            self.bench.drive(ready=ready, answering=bool(left), answer=left[0] if left else 0, arrived=self.noise)
            await RisingEdge(self.dut.clk)
            if ready and int(self.dut.sending.value):
                sent.append(int(self.dut.sent.value))
            if ready and left and int(self.dut.taken.value):
                left.pop(0)
                if not left:
                    self.bench.drive(ready=0, answering=0)
                    await self.clocks(1)
                    await self.finish()
            if len(sent) == len(answer) + 2:
                break
        self.bench.drive(ready=0, arrived=0)
        return bytes(sent)


@cocotb.test()
async def frames_end_and_are_judged_as_the_twin_does(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    random = wire.random
    for frame in requests(random, 60):
        mangled = bytearray(frame)
        case = random.random()
        if case < 0.15:
            mangled[random.integers(0, len(mangled))] ^= 1 << random.integers(0, 8)
        elif case < 0.25:
            del mangled[random.integers(0, len(mangled)) :]
        elif case < 0.35:
            mangled += random.bytes(random.integers(1, 9))
        elif case < 0.4:
            mangled[:0] = random.bytes(random.integers(1, 9))
        elif case < 0.45:
            mangled = bytearray(random.bytes(300))
            mangled[1] = 0x70
        spoilt = int(random.integers(0, len(mangled) + 1)) if random.random() < 0.05 else -1
        for k, byte in enumerate(mangled):
            await wire.send(byte, k == spoilt)
        if wire.twin.draining or random.random() < 0.5 or case < 0.45:
            await wire.gap()
    assert set(wire.seen) == set(Verdict) - {Verdict.OVERRUN}


@cocotb.test()
async def frames_up_to_the_largest_are_kept_whole_and_longer_ones_are_spoilt(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    for function, place in COUNTED.items():
        most = FRAME_MAX - place - 3
        for count in (0, most // 3, most - 1, most, most + 1, 255):
            head = bytes([1, function]) + wire.random.bytes(place - 2) + bytes([count])
            # What would be longer than a frame may be has a good CRC where it must end.
            frame = framed(head + wire.random.bytes(min(count, most)))
            for byte in frame:
                await wire.send(byte)
            assert len(wire.twin.frame) == len(frame)
            assert wire.seen[-1] == (Verdict.REQUEST if count <= most else Verdict.SPOILT)
            await wire.gap()


@cocotb.test()
async def a_frame_short_of_its_end_is_spoilt_though_its_crc_is_right(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    functions = *FIXED, *COUNTED, 0x70
    for function in functions:
        for byte in framed(bytes([1, function])):
            await wire.send(byte)
        await wire.gap()
    # Only a function without a length may end so.
    assert wire.seen == [Verdict.SPOILT] * (len(functions) - 1) + [Verdict.REQUEST]


@cocotb.test()
async def a_gap_is_as_long_as_promised(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    frame = framed(bytes([1, 3, 0, 0, 0, 2]))
    for pause in (GAP - 6, GAP):
        for byte in frame[:4]:
            await wire.send(byte)
        await wire.clocks(pause)
        if pause >= GAP:
            await wire.agree(wire.twin.gap())
        for byte in frame[4:]:
            await wire.send(byte)
        await wire.gap()
    assert wire.seen == [Verdict.REQUEST, Verdict.SPOILT, Verdict.SPOILT]


@cocotb.test()
async def bytes_during_an_answer_are_an_overrun(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    frame = framed(bytes([1, 3, 0, 0, 0, 2]))
    wire.noise = 1
    for byte in frame:
        await wire.send(byte)
    await wire.agree(wire.twin.overrun())
    wire.noise = 0
    for byte in frame:
        await wire.send(byte)
    await wire.gap()
    for byte in frame:
        await wire.send(byte)
    assert wire.seen == [Verdict.REQUEST, Verdict.OVERRUN, Verdict.REQUEST]


@cocotb.test()
async def a_byte_at_any_clock_while_a_frame_is_dealt_with_is_an_overrun(dut):
    wire = Wire(dut)
    await wire.bench.reset()
    foreign = framed(bytes([2, 3, 0, 0, 0, 2]))
    # The frame is judged at the first clock behind it and ended at the second; the third is the last that is not for
    # the next frame.
    wire.bench.drive(finished=1)
    for clock in range(3):
        verdicts = []
        for byte, arrived in [(byte, 1) for byte in foreign] + [(0, k == clock) for k in range(8)]:
            wire.bench.drive(byte=byte, arrived=int(arrived))
            await wire.clocks(1)
            if wire.ended():
                verdicts.append(wire.verdict())
        assert verdicts == [Verdict.FOREIGN, Verdict.OVERRUN]
        await wire.clocks(GAP)


def test_rtl():
    simulate(__file__, make, gap_clocks=GAP)


def test_the_crc_is_the_one_of_others():
    random = rng()
    for _ in range(200):
        data = random.bytes(random.integers(1, 254))
        assert crc(data) == int.from_bytes(FramerRTU.compute_CRC(data).to_bytes(2, "big"), "little")
    # The example of appendix B of "Modbus over Serial Line": unit 2, function 7.
    assert framed(bytes([2, 7])) == bytes([2, 7, 0x41, 0x12])


def verdicts(frame: bytes) -> list[Verdict]:
    """Return the twin's verdicts on bytes and the gap behind them."""
    line = Line()
    got = [line.receive(byte) for byte in frame] + [line.gap()]
    return [verdict for verdict in got if verdict is not None]


def test_no_flipped_bit_is_let_through():
    random = rng()
    for frame in requests(random, 30, unit=1, known=True):
        assert verdicts(frame) == [Verdict.REQUEST]
        for flipped in flips(frame):
            assert set(verdicts(flipped)) == {Verdict.SPOILT}


def test_a_flipped_function_keeps_its_length_or_ends_by_a_gap():
    lengths = {**FIXED, **dict.fromkeys(COUNTED, "counted")}
    for function, length in lengths.items():
        for bit in range(8):
            other = lengths.get(function ^ 1 << bit)
            assert other is None or (other == length and length != "counted")


def test_the_lengths_are_those_of_the_frames():
    for frame in requests(rng(), 100, known=True):
        assert length_of(frame) == len(frame) <= FRAME_MAX
        assert length_of(frame[:1]) is None


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"gap_clocks must be an int, not 2.5$"):
        hdl.Line(2.5)
    with pytest.raises(ValueError, match=r"gap_clocks must be 2 or more, not 1$"):
        hdl.Line(1)
