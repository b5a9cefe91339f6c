"""A host on the board's serial line: bits, frames, words by name, and a heartbeat."""

from collections.abc import Callable

import cocotb
from cocotb.simtime import get_sim_time
from cocotb.triggers import FallingEdge, First, Lock, Timer

from hardwall.model.axes.registers import BANK, is_shared
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.link.line import framed
from hardwall.model.register import Kind
from stimuli import frames

from .scene import BAUD, CLOCK_HZ, CLOCK_NS, CLOCKS_PER_MS

BIT_NS = CLOCK_NS * CLOCK_HZ // BAUD
SILENCE_NS = 30 * BIT_NS
"""The end of an answer: three bytes of silence."""
PATIENCE_NS = 2 * CLOCKS_PER_MS * CLOCK_NS
"""The time in which every answer has begun."""
BEAT_NS = 10 * CLOCKS_PER_MS * CLOCK_NS
REFUSED = 0x80
"""The bit of a function that is answered by an exception."""


def bits(data: bytes) -> list[int]:
    """Return the levels of the line for some bytes, with their start and stop bits."""
    return [level for byte in data for level in (0, *(byte >> bit & 1 for bit in range(8)), 1)]


class SerialHost:
    """A host that knows the words it wrote.

    It speaks of axis `axis`: of another one than the first, `first` is the host that has the line and the heartbeat.
    The device has `registers`.

    Attributes:
        beats: whether the heartbeat goes on; `repeats`: whether it always says the same.
        words: every word as it was written last.
        sent: called when the last bit of a frame is on the line.
    """

    def __init__(self, dut, registers: RegisterMap, axis: int = 0, first: "SerialHost | None" = None):
        self._registers = registers
        self._dut, self._lock = dut, first._lock if first else Lock()
        self._first, self._bank = first, axis * BANK
        self.beats, self.repeats, self.beat = True, False, 0
        self.words = {each.name: each.reset for each in (*registers.words, *registers.live)}
        self.sent: Callable[[], None] = lambda: None
        self._got = first._got if first else bytearray()
        self._tasks = [] if first else [cocotb.start_soon(self._listen()), cocotb.start_soon(self._beat())]

    def close(self) -> None:
        """End the host's tasks."""
        for task in self._tasks:
            task.cancel()

    async def _listen(self) -> None:
        tx = self._dut.uart_tx
        while True:
            await FallingEdge(tx)
            await Timer(BIT_NS // 2, "ns")
            byte = 0
            for bit in range(8):
                await Timer(BIT_NS, "ns")
                byte |= int(tx.value) << bit
            self._got.append(byte)
            await Timer(BIT_NS, "ns")

    async def _beat(self) -> None:
        while True:
            await Timer(BEAT_NS, "ns")
            if self.beats:
                await self.heartbeat()

    async def heartbeat(self) -> None:
        """Write the heartbeat, a new one unless the host repeats itself."""
        host = self._first or self
        host.beat += not host.repeats
        await host.write(heartbeat=host.beat)

    async def send(self, levels: list[int]) -> None:
        """Put levels on the line, a bit's time each; the line rests afterwards."""
        rx = self._dut.uart_rx
        for level in levels:
            rx.value = level
            await Timer(BIT_NS, "ns")
        rx.value = 1

    async def exchange(self, data: bytes) -> bytes:
        """Send bytes as they are; return what is answered, which may be nothing."""
        async with self._lock:
            self._got.clear()
            await self.send(bits(data))
            self.sent()
            await First(FallingEdge(self._dut.uart_tx), Timer(PATIENCE_NS, "ns"))
            heard = -1
            while heard != len(self._got):
                heard = len(self._got)
                await Timer(SILENCE_NS, "ns")
            # The line changes with the clock; everything here is done between its edges.
            await Timer((CLOCK_NS + CLOCK_NS // 2 - int(get_sim_time("ns"))) % CLOCK_NS or CLOCK_NS, "ns")
            return bytes(self._got)

    async def request(self, pdu: bytes) -> bytes:
        """Send a request to the board's unit; return the answer without unit and CRC.

        Raises:
            AssertionError: if there is no answer, or it is spoilt.
        """
        frame = framed(b"\1" + pdu)
        answer = await self.exchange(frame)
        assert answer, f"no answer to {frame.hex(' ')}"
        assert answer == framed(answer[:-2]), f"a spoilt answer: {answer.hex(' ')}"
        return answer[1:-2]

    def writing(self, **values: int) -> bytes:
        """Return the request that writes registers, and with them what lies between, as it was written last."""
        self.words |= {name: value for name, value in values.items() if name in self.words}
        places = [self._registers[name].address for name in values]
        cells = []
        for register in self._registers.registers:
            if min(places) <= register.address <= max(places):
                old = 0 if register.kind is Kind.PULSE else self.words[register.name]
                cells += register.to_registers(values.get(register.name, old))
        return frames.write(self._bank + min(places), cells)

    async def write(self, **values: int) -> bytes:
        """Write registers in one frame; return the answer.

        Of an axis but the first, it is a frame for each where something that the axes share lies between, and the last
        answer: that cannot be written there.
        """
        places = [self._registers[name].address for name in values]
        known = self._registers.registers
        between = (register for register in known if min(places) <= register.address <= max(places))
        if self._first and any(map(is_shared, between)):
            for name, value in values.items():
                answer = await self.request(self.writing(**{name: value}))
            return answer
        return await self.request(self.writing(**values))

    async def commit(self, **words: int) -> None:
        """Write committed words, and commit them."""
        answer = await self.write(commit=1, **words)
        assert not answer[0] & REFUSED, f"{words} is refused: {answer.hex(' ')}"

    async def read(self, name: str) -> int:
        """Return the value of a register, as the board answers it."""
        register = self._registers[name]
        data = (await self.request(frames.read(self._bank + register.address, register.size)))[2:]
        return register.from_registers(tuple(int.from_bytes(data[k : k + 2], "big") for k in range(0, len(data), 2)))

    async def acknowledge(self, causes: int) -> None:
        """Say which causes were read, and acknowledge them."""
        await self.write(acknowledged=causes)
        await self.write(acknowledge=1, clear_flags=1)

    async def arm(self) -> bool:
        """Ask to be armed; return whether that was taken."""
        return not (await self.write(arm=1))[0] & REFUSED
