"""The link from pin to pin: Modbus clients and a UART that others wrote, against the registers of an axis."""

import json
import logging
import zlib

import cocotb
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from cocotb.task import bridge, resume
from cocotb.triggers import ClockCycles, FallingEdge, First, RisingEdge, Timer
from cocotbext.uart import UartSink, UartSource
from pymodbus import FramerType, ModbusException
from pymodbus.client.base import ModbusBaseSyncClient
from pymodbus.transport import CommParams, CommType

from hardwall.hdl.board.lead_out import lead_out
from hardwall.hdl.link.link import Link
from hardwall.model.axis.register_file import EXCLUSIVE
from hardwall.model.axis.registers import CAPTURE, COUNTERS, MAP, SUPERVISOR, TELEMETRY
from hardwall.model.link import server
from hardwall.model.link.line import framed
from hardwall.model.register import Kind
from hardwall.testing import Bench, parameters, rng, simulate
from stimuli import frames
from stimuli.lengths import WHOLE
from stimuli.restless import Restless
from stimuli.status import show
from stimuli.supervised import CAPTURE_REGISTERS, captured, supervised

BAUD = 3_000_000
"""4 clocks a bit at the spec's 12 MHz."""
SILENCE_NS = 60_000
"""As long a silence of the device, 150 bytes, is no answer, unless a gap must end the request."""

ROUNDS = 5 if WHOLE else 3
"""Values that every port has, one after the other."""


class Device(wiring.Component):
    """The link with a capture memory."""

    def __init__(self, name: str):
        self.link = Link(supervised(name), BAUD)
        ports = dict(self.link.signature.members)
        del ports["capture_address"], ports["capture_data"], ports["capture_done"]
        super().__init__(ports)

    def elaborate(self, platform):
        m = Module()
        m.submodules.link = link = self.link
        place = Signal.like(link.capture_address)
        m.d.sync += place.eq(link.capture_address)
        m.d.comb += [link.capture_data.eq(captured(place)), link.capture_done.eq(1)]
        m.d.comb += lead_out(link, self, self.signature.members)
        return m


def make(name: str) -> Device:
    return Device(name)


class Client(ModbusBaseSyncClient):
    """pymodbus's client, its bytes carried by cocotbext-uart in the simulator's time."""

    def __init__(self, dut, bit_ns: float):
        super().__init__(FramerType.RTU, 0, CommParams(comm_type=CommType.SERIAL, timeout_connect=60), None, None, None)
        self.silence_ns = SILENCE_NS
        self.source, self.sink = UartSource(dut.uart_rx, baud=1e9 / bit_ns), UartSink(dut.uart_tx, baud=1e9 / bit_ns)
        for end in (self.source, self.sink):
            end.log.setLevel(logging.WARNING)

    def connect(self) -> bool:
        return True

    @resume
    async def _send(self, request: bytes) -> None:
        self.sink.clear()
        await self.source.write(request)
        await self.source.wait()

    @resume
    async def _receive(self) -> bytes:
        await self.sink.wait(self.silence_ns, "ns")
        return bytes(self.sink.read_nowait())

    def send(self, request: bytes, addr=None) -> int:
        self._send(request)
        return len(request)

    def recv(self, size=None) -> bytes:
        return self._receive()


async def opened(dut, error: float = 0.0) -> Client:
    """Return a client of a device that was reset, with a line whose rate is wrong by a fraction `error`."""
    bench, link = Bench(dut, make(**parameters())), make(**parameters()).link
    await bench.reset()
    # The reset's line is low, and stays so for a while: a break, which is a spoilt byte.
    await ClockCycles(dut.clk, 100)
    bench.drive(uart_rx=1)
    bit_ns = bench.period_ns * link.registers.spec.clock_hz / link.baud
    client = Client(dut, bit_ns * (1 + error))
    # The gap forgets it.
    await Timer(bench.period_ns * (link.gap_clocks + 100), "ns")
    return client


async def takes_commits(dut, bench: Bench) -> None:
    """Keep every commit waiting for longer than a byte, as an axis does until its sample; there is no answer before."""
    while True:
        await RisingEdge(dut.commit)
        await RisingEdge(dut.clk)
        bench.drive(commit_pending=1)
        answered = FallingEdge(dut.uart_tx)
        assert await First(answered, ClockCycles(dut.clk, 60)) is not answered, "an answer before the sample"
        bench.drive(commit_pending=0)


def values(answer) -> list[int]:
    assert not answer.isError(), answer
    return answer.registers


@cocotb.test()
async def everything_can_be_read_by_function_3(dut):
    client, registers = await opened(dut), supervised(**parameters())

    def window(first: int, count: int) -> list[int]:
        read = []
        while len(read) < count:
            some = min(125, count - len(read))
            read += values(client.read_holding_registers(first + len(read), count=some, device_id=1))
        return read

    @bridge
    def run() -> None:
        fixed = [each for each in registers.registers if each.kind is Kind.CONSTANT]
        constants = values(client.read_holding_registers(0, count=2 * len(fixed), device_id=1))
        named = {r.name: r.from_registers(tuple(constants[r.address : r.address + 2])) for r in fixed}
        assert f"{named['identity_high']:08x}{named['identity_low']:08x}" == registers.identity
        size = named["map_bytes"]
        packed = b"".join(each.to_bytes(2, "big") for each in window(MAP, (size + 1) // 2))[:size]
        described = json.loads(zlib.decompress(packed))
        assert described["identity"] == registers.identity
        rows = [dict(zip(described["columns"], row, strict=True)) for row in described["registers"]]
        assert [row["address"] for row in rows] == [r.address for r in registers.registers[len(fixed) :]]
        assert named["capture_registers"] == CAPTURE_REGISTERS
        assert window(CAPTURE, CAPTURE_REGISTERS) == [captured(k) for k in range(CAPTURE_REGISTERS)]

    await run()


@cocotb.test()
async def words_are_written_committed_and_read_back(dut):
    client, registers = await opened(dut), supervised(**parameters())
    commits = Bench(dut, make(**parameters())).monitor("commit", "wall_stiffness", "preload_count")
    dut.count.value, dut.drive.value, dut.first_stamp.value = (1 << 21) - 5, 3, 0xDCBA98
    place = {register.name: register.address for register in registers.registers}

    @bridge
    def run() -> None:
        unit = {"device_id": 1}
        stiffness = place["wall_stiffness"]
        assert not client.write_registers(stiffness, [0, 1234, 0, 77], **unit).isError()
        assert values(client.read_input_registers(stiffness, count=4, **unit)) == [0, 1234, 0, 77]
        active = place["active_wall_stiffness"]
        assert values(client.read_holding_registers(active, count=4, **unit)) == [0, 0, 0, 0]
        assert not client.write_register(place["commit"], 1, **unit).isError()
        assert values(client.read_holding_registers(active, count=4, **unit)) == [0, 1234, 0, 77]
        # One frame writes, commits and reads.
        both = client.readwrite_registers(
            read_address=place["drive"],
            read_count=4,
            write_address=place["commit"],
            values=[1, 0xFFFF, 0xFFF0],
            **unit,
        )
        assert values(both) == [0, 3, 0xFFFF, 0xFFFB]
        assert values(client.read_holding_registers(place["first_stamp"], count=2, **unit)) == [0x00DC, 0xBA98]

    await run()
    assert commits.rows == [(1234, 0), (1234, -16)]


@cocotb.test()
async def exceptions_counters_and_identification(dut):
    client, registers = await opened(dut, error=0.025), supervised(**parameters())
    place = {register.name: register.address for register in registers.registers}
    dut.refuse.value = -1 & (1 << len(registers.pulses)) - 1

    @bridge
    def run() -> None:
        unit = {"device_id": 1}
        client.silence_ns += Bench.period_ns * make(**parameters()).link.gap_clocks
        codes = [
            client.read_coils(0, count=1, **unit).exception_code,
            client.read_holding_registers(1, count=2, **unit).exception_code,
            client.write_registers(place["encoder_invert"], [0, 2], **unit).exception_code,
            client.write_register(place["arm"], 1, **unit).exception_code,
        ]
        assert codes == [1, 2, 3, 4]
        client.silence_ns = SILENCE_NS
        assert client.diag_query_data(b"\x5a\xa5", **unit).message == b"\x5a\xa5"
        assert client.diag_read_bus_message_count(**unit).message == 6
        assert client.diag_read_bus_exception_error_count(**unit).message == 4
        objects = client.read_device_information(read_code=1, object_id=0, **unit).information
        assert objects == {0: b"hardwall", 1: b"axis", 2: registers.identity.encode()}
        assert client.read_device_information(read_code=4, object_id=1, **unit).information == {1: b"axis"}
        with pytest.raises(ModbusException, match="No response"):
            client.read_holding_registers(0, count=2, device_id=9)
        assert client.diag_clear_counters(**unit).isError() is False
        assert client.diag_read_bus_message_count(**unit).message == 1

    await run()


@cocotb.test(skip=not WHOLE)
async def each_pulse_is_refused_alone(dut):
    client, registers = await opened(dut), supervised(**parameters())
    every = (1 << len(registers.pulses)) - 1

    @bridge
    def run() -> None:
        for bit, pulse in enumerate(registers.pulses):
            dut.refuse.value = 1 << bit
            assert client.write_register(pulse.address, 1, device_id=1).exception_code == 4
            dut.refuse.value = every ^ 1 << bit
            assert not client.write_register(pulse.address, 1, device_id=1).isError()

    await run()


@cocotb.test()
async def what_is_no_request_of_registers_that_there_are_is_counted(dut):
    client, registers = await opened(dut), supervised(**parameters())
    stiffness, gap_clocks = registers["wall_stiffness"].address, make(**parameters()).link.gap_clocks

    @bridge
    def counters() -> list[int]:
        return values(client.read_holding_registers(COUNTERS, count=8, device_id=1))

    @bridge
    def asks_for_too_much() -> None:
        # The largest request that there is: most of its registers are none.
        assert client.write_registers(stiffness, [0] * server.WRITE_MAX, device_id=1).exception_code == 2

    async def sends(data: bytes) -> None:
        client.sink.clear()
        await client.source.write(data)
        await client.source.wait()

    before = await counters()
    assert before[server.ERRORS] == 1, "the break that the line begins with"
    await sends(framed(b"\0" + frames.write(stiffness, [0, 55])))
    await Timer(SILENCE_NS, "ns")
    # A function without a length ends by a gap.
    await sends(framed(b"\1\xe1"))
    await Timer(gap_clocks * Bench.period_ns + SILENCE_NS, "ns")
    assert bytes(client.sink.read_nowait()) == framed(b"\1\xe1\1")
    await asks_for_too_much()
    more = {server.MESSAGES: 4, server.EXCEPTIONS: 2, server.REQUESTS: 3, server.UNANSWERED: 1}
    grown = [now - then for now, then in zip(await counters(), before, strict=True)]
    assert grown == [more.get(k, 0) for k in range(8)]


@cocotb.test()
async def every_port_has_what_a_client_writes_and_reads(dut):
    client, registers, random = await opened(dut), supervised(**parameters()), rng()
    bench, unit = Bench(dut, make(**parameters())), {"device_id": 1}
    words, live, pulses = registers.words, registers.live, registers.pulses
    every = (*registers.status, *words, *live)
    restless = {each.name: Restless(each, random) for each in every}
    drawn: dict[str, int] = {}
    pulsed = [bench.monitor(pulse.name, *(word.name for word in words)) for pulse in pulses]
    cocotb.start_soon(takes_commits(dut, bench))

    def halves(those, of: dict[str, int]) -> list[int]:
        return [half for each in those for half in each.to_registers(of[each.name])]

    for number in range(ROUNDS):
        drawn.update({name: values_of.next() for name, values_of in restless.items()})
        # Those are much alike from word to word; the last ones differ.
        if number == ROUNDS - 1:
            drawn.update({each.name: int(random.integers(each.low, each.high + 1)) for each in every})
        await show(dut, bench, registers, {each.name: drawn[each.name] for each in registers.status})

        @bridge
        def run() -> None:
            assert not client.write_registers(live[0].address, halves(live, drawn), **unit).isError()
            # A frame has none of the pulses that exclude each other but one.
            alone = [pulse for pulse in pulses if pulse.name in {*EXCLUSIVE} - {"commit"}]
            together = [int(pulse not in alone) for pulse in pulses[::-1]] + halves(words, drawn)
            bench.drive(refuse=(1 << len(pulses)) - 1)
            assert client.write_registers(pulses[-1].address, together, **unit).exception_code == 4
            bench.drive(refuse=0)
            assert not client.write_registers(pulses[-1].address, together, **unit).isError()
            assert not any(client.write_register(pulse.address, 1, **unit).isError() for pulse in alone)
            for block in (TELEMETRY, SUPERVISOR):
                shown = halves([each for each in registers.status if block <= each.address < block + 0x20], drawn)
                assert values(client.read_holding_registers(block, count=len(shown), **unit)) == shown
            for absent in (0xB000, 0xFFFF):
                assert client.read_holding_registers(absent, count=2, **unit).exception_code == 2

        await run()
        assert {word.name: bench.reader(word.name)() for word in live} == {word.name: drawn[word.name] for word in live}
        assert [len(monitor.rows) for monitor in pulsed] == [number + 1] * len(pulses)
        assert pulsed[0].rows[-1] == tuple(drawn[word.name] for word in words)


def test_rtl():
    simulate(__file__, make, name="paper")


def test_wrong_parameters_are_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Link(3)
    with pytest.raises(ValueError, match=r"baud must be 115200 to 3000000, not 9600$"):
        Link(supervised("paper"), 9600)
