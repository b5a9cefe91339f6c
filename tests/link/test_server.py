"""The server: whole frames through line, server and register file, RTL and twin alike, whatever arrives."""

import cocotb
import pytest
from cocotb.triggers import ClockCycles, RisingEdge
from server_world import Stack, World

from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.hdl.link.server import Server
from hardwall.model.axis import register_file
from hardwall.model.axis.registers import CAPTURE, COUNTERS, WRITTEN
from hardwall.model.link import server
from hardwall.model.link.line import Line, Verdict, framed
from hardwall.testing import simulate
from stimuli import frames
from stimuli.random_requests import random_request
from stimuli.supervised import supervised

EXCEPTIONS = [
    (b"\5\0\0\xff\0", 1),
    (bytes([43, 13, 1, 0]), 1),
    (bytes([8, 0, 1, 0, 0]), 1),
    (frames.read(0, 0), 3),
    (frames.read(0, 126), 3),
    (frames.read(1, 2), 2),
    (frames.read(0, 1), 2),
    (frames.read(0x100, 2), 2),
    (frames.read(0xFFFF, 2), 2),
    (frames.read(0xF000, 4), 2),
    (frames.write_one(0x80, 0), 2),
    (frames.write(0x20, [0, 0]), 2),
    (frames.write_one(0x7F, 2), 3),
    (frames.write(0x84, [0, 2]), 3),
    (b"\x10" + frames.words(0x84, 2) + b"\2" + frames.words(0), 3),
    (frames.write(0x84, [0, 2, 0]), 2),
    (frames.write(0x84, [0] * server.WRITE_MAX), 2),
    (bytes([8, 0, 11, 0, 1]), 3),
    (bytes([43, 14, 0, 0]), 3),
    (bytes([43, 14, 5, 0]), 3),
    (bytes([43, 14, 4, 3]), 2),
    (frames.write_and_read(0x80, [0, 0], 0, 0), 3),
    (frames.write_and_read(0x20, [0, 0], 0, 2), 2),
    # One bit beside what is known: a sub-function, a kind, a code and an object of identification.
    *((bytes([8]) + frames.words(11 | 1 << bit, 0), 1) for bit in range(4, 16)),
    *((bytes([43, 14 ^ 1 << bit, 1, 0]), 1) for bit in range(8)),
    *((bytes([43, 14, 3 | 1 << bit, 0]), 3) for bit in range(2, 8)),
    *((bytes([43, 14, 4, 1 << bit]), 2) for bit in range(2, 8)),
]
"""A request for every reason of an exception of the server's own, and its code."""


@cocotb.test()
async def requests_are_answered_as_the_twin_does(dut):
    world = World(dut)
    await world.reset()
    seen = set()
    for _ in range(200):
        if world.random.random() < 0.3:
            await world.live()
        answer = await world.send(framed(b"\1" + random_request(world.random, world.design)))
        if answer is None:
            await world.gap()
        else:
            seen.add(tuple(answer[1:3]) if answer[1] & 0x80 else answer[1])
    assert {3, 4, 6, 8, 16, 23, 43} <= seen
    assert {(16 | 0x80, 2), (16 | 0x80, 3)} <= seen


@cocotb.test()
async def every_exception(dut):
    world = World(dut)
    await world.reset()
    for pdu, code in EXCEPTIONS:
        answer = await world.send(framed(b"\1" + pdu)) or await world.gap()
        assert answer == bytes([1, pdu[0] | 0x80, code])
    world.bench.drive(refuse=-1, busy=1)
    world.server.file.capture = None
    assert await world.request(frames.read(CAPTURE, 8)) == b"\x83\4"
    assert await world.request(frames.read(CAPTURE + world.registers.capture_registers - 2, 4)) == b"\x83\2"
    world.server.file.refusing = frozenset(pulse.name for pulse in world.registers.pulses)
    assert await world.request(frames.write(world.registers["commit"].address, [1, 0, 7])) == b"\x90\4"
    assert (await world.request(frames.read(WRITTEN, 2)))[2:] == frames.words(0, 0)


@cocotb.test()
async def every_identification(dut):
    world = World(dut)
    await world.reset()
    for kind in range(server.NAMED + 2):
        for number in range(4):
            await world.request(bytes([server.IDENTIFY, server.DEVICE_IDENTIFICATION, kind, number]))


@cocotb.test()
async def every_diagnosis(dut):
    world = World(dut)
    await world.reset()
    for sub in range(server.CLEAR + 12):
        for data in (0, 5):
            await world.request(bytes([server.DIAGNOSE]) + frames.words(sub, data))
    counters = [COUNTERS + k for k in range(server.LAST_COUNTER - server.FIRST_COUNTER + 1)]
    assert any(world.server.file.live[counter] for counter in counters)
    await world.request(bytes([server.DIAGNOSE]) + frames.words(server.CLEAR, 0))
    assert not any(world.server.file.live[counter] for counter in counters)


@cocotb.test()
async def whatever_arrives_is_judged_as_the_twin_does(dut):
    world = World(dut)
    await world.reset()
    for frame in frames.requests(world.random, 120):
        data, case = bytearray(frame), world.random.random()
        if case < 0.2:
            data[world.random.integers(0, len(data))] ^= 1 << world.random.integers(0, 8)
        elif case < 0.3:
            del data[world.random.integers(0, len(data)) :]
        elif case < 0.4:
            data[:0] = world.random.bytes(world.random.integers(1, 5))
        elif case < 0.45:
            data = bytearray(b"\1\x66" + world.random.bytes(270))
        more = int(0.9 < case < 0.97)
        await world.send(bytes(data), spoilt=3 if case > 0.97 else -1, more=more)
        if case < 0.5 or more:
            await world.gap()
    counters = [world.server.file.live[COUNTERS + k] for k in range(8)]
    assert min(counters[server.OVERRUNS :]) > 0
    answer = await world.request(frames.read(COUNTERS, 8))
    assert answer[2:] == frames.words(*counters[:3], counters[3] + 1, *counters[4:6], counters[6] + 1, counters[7])


@cocotb.test()
async def no_flipped_bit_is_accepted(dut):
    world = World(dut)
    await world.reset()
    frame = framed(b"\1" + frames.write(world.registers["wall_stiffness"].address - 1, [0, 0, 77]))
    whole = framed(b"\1" + frames.write(world.registers["commit"].address, [1, 0, 5]))
    for data in (frame, whole):
        for flipped in frames.flips(data):
            assert await world.send(flipped) is None
            assert await world.gap() is None
    assert world.answers == 0
    assert world.pulsed.rows == []


@cocotb.test()
async def a_reset_in_the_middle_of_a_frame_forgets_it(dut):
    world = World(dut)
    await world.reset()
    stiffness = world.registers["wall_stiffness"].address
    for cut in (1, 4, 11, 13):
        await world.request(frames.write(stiffness, [0, 9]))
        await world.request(frames.write_one(world.registers["commit"].address, 1))
        frame = framed(b"\1" + frames.write(stiffness, [0, 7]))
        for byte in frame[:cut]:
            world.bench.drive(byte=byte, arrived=1)
            await RisingEdge(dut.clk)
        world.bench.drive(arrived=0)
        await ClockCycles(dut.clk, cut)
        dut.rst.value = 1
        await ClockCycles(dut.clk, 1)
        dut.rst.value = 0
        world.line, world.server.file = Line(), register_file.RegisterFile(world.design)
        answer = await world.request(frames.read(stiffness, 2))
        assert answer == b"\3\4" + frames.words(0, 0)
        active = world.registers["active_wall_stiffness"].address
        assert await world.request(frames.read(active, 2)) == b"\3\4" + frames.words(0, 0)


@cocotb.test()
async def written_words_wait_for_their_commit(dut):
    world = World(dut)
    await world.reset()
    registers = world.registers
    word, active, commit = (registers[name].address for name in ("wall_position", "active_wall_position", "commit"))
    assert (await world.request(frames.write(word, [0xFFFF, 0xFFFE])))[0] == 16
    assert (await world.request(frames.read(word, 2)))[2:] == frames.words(0xFFFF, 0xFFFE)
    assert (await world.request(frames.read(active, 2)))[2:] == frames.words(0, 0)
    assert (await world.request(frames.write_one(commit, 1)))[0] == 6
    assert (await world.request(frames.read(active, 2)))[2:] == frames.words(0xFFFF, 0xFFFE)
    ((_, *words),) = world.pulsed.rows
    assert dict(zip(world.server.file.active, words, strict=True))["wall_position"] == -2


@cocotb.test()
async def the_largest_request_is_answered_in_time(dut):
    world = World(dut)
    await world.reset()
    await world.request(frames.read(0, 2))
    pulses, values = world.registers.pulses, []
    for word in world.registers.words:
        values += word.to_registers(word.reset)
    pdu = frames.write_and_read(pulses[-1].address, [0] * (len(pulses) - 1) + [1, *values], 0, 124)
    begun, asked = len(world.sent.rows), world.bench.clock_number()
    await world.request(pdu)
    written, component = len(pulses) + len(values), RegisterFile(world.design)
    most = 30 + 21 * written + 4 * 124 + component.snapshot_clocks + component.shift_clocks
    # The commit waits 50 clocks for its sample.
    assert world.sent.clocks[begun] - asked - len(pdu) <= most + 50 < 6000


@pytest.mark.parametrize("name", ["mhz"])
def test_rtl(name):
    simulate(__file__, Stack, name=name)


def answers(*pdus: bytes) -> list[bytes]:
    """Return the twin's answers, without unit and CRC."""
    under_test = server.Server(register_file.Design(supervised("mhz")))
    return [under_test.take(Verdict.REQUEST, framed(b"\1" + pdu))[1:] for pdu in pdus]


@pytest.mark.parametrize(("pdu", "code"), EXCEPTIONS)
def test_every_exception(pdu, code):
    assert answers(pdu) == [bytes([pdu[0] | 0x80, code])]


def test_the_device_may_refuse_a_pulse():
    under_test = server.Server(register_file.Design(supervised("mhz")))
    under_test.file.refusing = frozenset({"arm"})
    arm = supervised("mhz")["arm"].address
    assert under_test.take(Verdict.REQUEST, framed(b"\1" + frames.write_one(arm, 1))) == b"\1\x86\4"
    assert under_test.take(Verdict.REQUEST, framed(b"\1" + frames.write_one(arm, 0)))[1] == 6
    assert under_test.file.pulses == ()


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Server(3)
