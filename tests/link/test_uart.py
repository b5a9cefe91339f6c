"""The UART: every clock of RTL and twin alike, bytes that others made and read, and the rates that it accepts."""

import cocotb
import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import RisingEdge
from cocotbext.uart import UartSink, UartSource

from hardwall.hdl.link.uart import Receiver, Transmitter
from hardwall.model.link import uart
from hardwall.testing import Bench, parameters, rng, simulate
from stimuli.lengths import some_of

PAIRS = [(12_000_000, 3_000_000), (12_000_000, 1_800_000)]
"""Clocks and rates: 4 clocks a bit, and 6 and two thirds, which become a clock within a byte."""

MORE = [*PAIRS, (12_000_000, 115_200), (50_000_000, 921_600), (50_000_000, 3_000_000)]


class Pair(wiring.Component):
    """A receiver and a transmitter side by side, without streams at the ports."""

    def __init__(self, design: uart.Design):
        self.design = design
        super().__init__(
            {
                "rx": In(1),
                "byte": Out(8),
                "arrived": Out(1),
                "spoilt": Out(1),
                "payload": In(8),
                "valid": In(1),
                "ready": Out(1),
                "tx": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.receiver = receiver = Receiver(self.design)
        m.submodules.transmitter = transmitter = Transmitter(self.design)
        m.d.comb += [
            receiver.pin.eq(self.rx),
            self.byte.eq(receiver.byte),
            self.arrived.eq(receiver.arrived),
            self.spoilt.eq(receiver.spoilt),
            transmitter.bytes.payload.eq(self.payload),
            transmitter.bytes.valid.eq(self.valid),
            self.ready.eq(transmitter.bytes.ready),
            self.tx.eq(transmitter.pin),
        ]
        return m


def make(clock_hz: int, baud: int) -> Pair:
    return Pair(uart.Design(clock_hz, baud))


def line(design: uart.Design, data: list[int], clocks_per_bit: float, start: float, stop: int = 1) -> list[int]:
    """Return the levels that clocks see on the line of an ideal sender, idle for two bits before and after."""
    bits = [1, 1]
    for byte in data:
        bits += [0, *(byte >> k & 1 for k in range(8)), stop]
    bits += [1, 1]
    return [bits[int((k + start) / clocks_per_bit)] for k in range(int(len(bits) * clocks_per_bit - start))]


def read(design: uart.Design, levels: list[int]) -> list[tuple[int, int]]:
    """Return what the twin of the receiver reads from a line: bytes, and whether each is spoilt."""
    state, got = uart.Receiver(), []
    for level in [*levels, 1, 1, 1]:
        state = uart.receive(design, state, level)
        if state.arrived:
            got.append((state.byte, state.spoilt))
    return got


@cocotb.test()
async def every_clock_is_the_twins(dut):
    component = make(**parameters())
    bench, random, design = Bench(dut, component), rng(), component.design
    await bench.reset()
    names = "byte", "arrived", "spoilt", "ready", "tx"
    readers = [bench.reader(name) for name in names]
    # A reset does not reach the synchroniser, and the bench's line is low during it.
    receiver, transmitter = uart.Receiver(first=0, pin=0), uart.Transmitter()
    levels = [1] * 3
    while len(levels) < 8_000:
        # Bytes at a rate that is wrong by up to 4 %, breaks, and noise.
        clocks = design.clock_hz / design.baud * random.uniform(0.96, 1.04)
        data = random.integers(0, 256, random.integers(1, 4)).tolist()
        levels += line(design, data, clocks, random.random() * clocks, int(random.random() > 0.1))
        levels += [0] * int(random.integers(0, 90)) if random.random() < 0.1 else []
        levels += random.integers(0, 2, 20).tolist() if random.random() < 0.1 else []
    byte, arrivals = None, 0
    for k, level in enumerate(levels):
        byte = int(random.integers(0, 256)) if random.random() < 0.5 else None
        bench.drive(rx=level, valid=byte is not None, payload=byte or 0)
        await RisingEdge(dut.clk)
        seen = dict(zip(names, (reader() for reader in readers), strict=True))
        expected = {"arrived": receiver.arrived, "ready": int(transmitter.bits == 0), "tx": transmitter.shift & 1}
        expected |= {"byte": receiver.byte, "spoilt": receiver.spoilt}
        assert seen == expected, f"clock {k}"
        receiver = uart.receive(design, receiver, level)
        transmitter = uart.transmit(design, transmitter, byte)
        arrivals += receiver.arrived
    assert arrivals > 30


@cocotb.test()
async def others_bytes_are_read_and_ours_by_others(dut):
    component = make(**parameters())
    bench, random = Bench(dut, component), rng()
    bench.dut.rx.value = 1
    await bench.reset()
    bench.drive(rx=1)
    bit_ns = bench.period_ns * component.design.clock_hz / component.design.baud
    sink = UartSink(dut.tx, baud=1e9 / round(bit_ns))
    for error in (-0.025, 0.0, 0.025):
        source = UartSource(dut.rx, baud=1e9 / round(bit_ns * (1 + error)))
        monitor = bench.monitor("arrived", "byte", "spoilt")
        sent = random.integers(0, 256, 40).tolist()
        await source.write(sent)
        await source.wait()
        for _ in range(3 * round(bit_ns / bench.period_ns)):
            await RisingEdge(dut.clk)
        assert monitor.rows == [(byte, 0) for byte in sent]
        source._run_cr.cancel()
    for byte in sent:
        await bench.transact("valid", "ready", payload=byte)
    while len(sink.queue._queue) < len(sent):
        await RisingEdge(dut.clk)
    assert list(sink.read_nowait()) == sent


@pytest.mark.parametrize(("clock_hz", "baud"), some_of(PAIRS, 1))
def test_rtl(clock_hz, baud):
    simulate(__file__, make, clock_hz=clock_hz, baud=baud)


@pytest.mark.parametrize("error", [-0.02, 0.0, 0.02])
@pytest.mark.parametrize(("clock_hz", "baud"), MORE)
def test_a_rate_that_is_wrong_by_2_percent_is_read(clock_hz, baud, error):
    design, random = uart.Design(clock_hz, baud), rng()
    clocks = clock_hz / baud / (1 + error)
    for _ in range(12):
        data = [0x00, 0xFF, 0x55, 0x80, 0x01, *random.integers(0, 256, 5).tolist()]
        assert read(design, line(design, data, clocks, random.random() * clocks)) == [(byte, 0) for byte in data]


def test_a_break_is_one_spoilt_byte_and_the_next_byte_is_read():
    design = uart.Design(12_000_000, 2_000_000)
    assert read(design, [1] * 9 + [0] * 1000 + [1] * 9 + line(design, [0xA5], 6.0, 0.0)) == [(0, 1), (0xA5, 0)]
    assert read(design, [1] * 9 + [0] + [1] * 100) == []


@pytest.mark.parametrize(("clock_hz", "baud"), [(12_000_000, 921_600), (50_000_000, 115_200), (48_000_000, 3_000_000)])
def test_the_rate_of_the_transmitter_is_that_of_the_design(clock_hz, baud):
    design = uart.Design(clock_hz, baud)
    state, edges, before = uart.transmit(design, uart.Transmitter(), 0x55), [0], 0
    for clock in range(1, 12 * clock_hz // baud):
        state = uart.transmit(design, state, None)
        if state.shift & 1 != before:
            edges.append(clock)
            before = state.shift & 1
    exact = clock_hz / baud / (1 + design.error)
    assert len(edges) == 10
    assert all(0 <= edge - k * exact < 1 + 1e-9 for k, edge in enumerate(edges))


def test_every_rate_that_is_accepted_is_exact_to_half_a_part_in_a_bit():
    for clock_hz in (480_000, 12_000_000, 50_000_000, 133_000_000, 400_000_000):
        for baud in (115_200, 230_400, 460_800, 921_600, 1_000_000, 2_000_000, 3_000_000):
            try:
                design = uart.Design(clock_hz, baud)
            except ValueError:
                assert baud > clock_hz // 4
            else:
                assert clock_hz >= 4 * baud
                assert abs(design.error) <= 1 / (2 ** (uart.FRACTION_BITS + 1) * clock_hz / baud - 1) < 0.002


def test_wrong_rates_are_refused():
    with pytest.raises(ValueError, match=r"baud must be 115200 to 3000000, not 9600$"):
        uart.Design(12_000_000, 9600)
    with pytest.raises(ValueError, match=r"baud must be 115200 to 250000, not 921600$"):
        uart.Design(1_000_000)
    with pytest.raises(ValueError, match=r"clock_hz must be 460800 or more for a UART, not 100000$"):
        uart.Design(100_000)
    with pytest.raises(TypeError, match=r"baud must be an int, not 1000000.0$"):
        uart.Design(12_000_000, 1e6)
    with pytest.raises(TypeError, match=r"not 3$"):
        Receiver(3)
    with pytest.raises(TypeError, match=r"not 3$"):
        Transmitter(3)


@pytest.mark.parametrize(
    ("clock_hz", "baud"),
    [(50_000_000, 921_600), (3_686_400, 921_600), (3_686_399, 460_800), (921_600, 230_400), (460_800, 115_200)],
)
def test_a_slow_clock_has_the_fastest_usual_rate_that_it_allows(clock_hz, baud):
    assert uart.usual_baud(clock_hz) == baud == uart.Design(clock_hz, baud).baud


def test_a_clock_that_allows_no_rate_is_refused():
    with pytest.raises(ValueError, match=r"^clock_hz must be 460800 or more for a UART, not 460799$"):
        uart.Design(460_799, uart.usual_baud(460_799))
