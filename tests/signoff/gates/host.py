"""A host on the serial line of a board: it arms, moves the wall, and disarms, whatever happens to the board."""

import logging
from typing import Any

import cocotb
import numpy as np
from cocotb.triggers import First, Timer
from cocotbext.uart import UartSink, UartSource

from hardwall.hdl.axis.board import Board
from hardwall.model.axis.supervisor import ARMED, DISARMED, REQUIRED, TRIPPED
from hardwall.model.link.line import framed
from hardwall.model.register import Kind
from stimuli import frames

PATIENCE = 10_000
"""Clocks after which an answer is given up: the board was reset, or did not understand."""
BYTE_BITS = 10
READ = 3
"""The function that reads registers."""


class Host:
    """A host that knows the board's registers and keeps to no more than the line's answers.

    Args:
        dut: cocotb's handle, with the pins of the line.
        board: the board.
        period_ns: its clock's.
        random: the source of everything random.
    """

    def __init__(self, dut: Any, board: Board, period_ns: int, random: np.random.Generator):
        self._registers, self._random = board.registers, random
        bit_ns = round(board.spec.clock_hz / board.link.baud) * period_ns
        self._byte_ns, self._patience_ns = BYTE_BITS * bit_ns, PATIENCE * period_ns
        self._source, self._sink = UartSource(dut.uart_rx, 1e9 / bit_ns), UartSink(dut.uart_tx, 1e9 / bit_ns)
        for end in (self._source, self._sink):
            end.log.setLevel(logging.ERROR)

    async def _request(self, pdu: bytes) -> bytes:
        """Return what the board answers, without unit and CRC; nothing if it does not."""
        self._sink.clear()
        await self._source.write(framed(b"\1" + pdu))
        await self._source.wait()
        heard = cocotb.start_soon(self._sink.wait())
        await First(heard.complete, Timer(self._patience_ns, "ns"))
        heard.cancel()
        answer = b""
        while not self._sink.empty():
            answer += bytes(self._sink.read_nowait())
            await Timer(2 * self._byte_ns, "ns")
        return answer[1:-2]

    async def _look(self) -> dict[str, int]:
        """Return the status of axis and supervisor; nothing if there is no answer."""
        first, last = self._registers["drive"].address, self._registers["driven"].address + 2
        answer = await self._request(frames.read(first, last - first))
        if len(answer) != 2 + 2 * (last - first) or answer[0] != READ:
            return {}
        cells = [int.from_bytes(answer[k : k + 2], "big") for k in range(2, len(answer), 2)]
        shown = [register for register in self._registers.status if first <= register.address < last]
        return {
            each.name: each.from_registers(tuple(cells[each.address - first : each.address - first + each.size]))
            for each in shown
        }

    async def _write(self, **values: int) -> None:
        """Write registers of one block, and 0 to those between them."""
        known = [self._registers[name] for name in values]
        first, last = min(each.address for each in known), max(each.address for each in known)
        cells: list[int] = []
        for register in self._registers.registers:
            if first <= register.address <= last and register.kind is not Kind.ACTIVE:
                cells += register.to_registers(values.get(register.name, 0))
        await self._request(frames.write(first, cells))

    def _words(self, count: int) -> dict[str, int]:
        """Return words of every size, for a stiff wall near a count."""
        random, words = self._random, {}
        for register in self._registers.words:
            part = random.random() * 2.0 ** -random.integers(0, register.format.width)
            words[register.name] = int(np.clip(register.high * part, register.low, register.high))
        place = self._registers["wall_position"]
        left, depth = int(random.integers(0, 2)), int(2.0 ** random.uniform(0, 10))
        position = int(np.clip(count + (depth if left else -depth), place.low, place.high))
        words |= {"wall_left": left, "wall_position": position, "preload_count": count}
        # The other direction disarms.
        words |= {"encoder_glitch_clocks": int(random.choice((0, 1, 2))), "encoder_invert": int(random.random() < 0.1)}
        if random.random() < 0.7:
            words |= {name: self._registers[name].high for name in ("wall_stiffness", "output_slew_limit")}
        return words

    async def _arm(self) -> None:
        """Choose how the axis is supervised, beat, and arm."""
        random, registers = self._random, self._registers
        await self._write(supervisor_ramp=registers["supervisor_ramp"].high)
        await self._write(supervisor_watchdog=registers["supervisor_watchdog"].high)
        await self._write(supervisor_causes=int(random.choice((REQUIRED, registers["supervisor_causes"].reset))))
        await self._write(heartbeat=int(random.integers(0, 1 << 16)))
        await self._write(arm=1)

    async def act(self) -> None:
        """Look, and do what the state calls for, or something else."""
        random, status = self._random, await self._look()
        if not status:
            return
        if status["state"] == TRIPPED:
            await self._write(acknowledged=status["latched"])
            await self._write(acknowledge=1, clear_flags=1)
        elif status["state"] == DISARMED:
            await self._arm()
        chance = random.random()
        if chance < 0.5:
            pulses = {name: int(random.random() < 0.2) for name in ("index_arm", "preload")}
            pulses["preload"] &= status["state"] != ARMED
            await self._write(commit=1, **pulses, **self._words(status["count"]))
        elif chance < 0.6:
            limit = self._registers["supervisor_force_limit"].high
            await self._write(supervisor_force_limit=int(limit * 2.0 ** -random.integers(0, 3)))
        elif chance < 0.7:
            await self._write(drive_invert=int(random.integers(0, 2)))
        elif chance < 0.75:
            await self._write(disarm=1)
