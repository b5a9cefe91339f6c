"""What a processor on the bus has before it: a board that runs, with its pins at rest, and a bus master of others."""

import logging

from cocotb.clock import Clock
from cocotbext.axi import AxiLiteBus, AxiLiteMaster

from hardwall.hdl.axis.board import Board
from hardwall.hdl.link.axi_link import AxiLink
from hardwall.model.axis.registers import RegisterMap
from hardwall.testing import Bench
from stimuli.specs import spec


def make(name: str) -> Board:
    """Return the board of an axis, with a bus in place of a line."""
    return Board(spec(name), AxiLink(RegisterMap(spec(name))))


async def started(dut, board: Board) -> tuple[Bench, AxiLiteMaster]:
    """Start the board: clocks run, the encoder is connected, and the loop of the emergency stop is open."""
    bench = Bench(dut, board)
    await bench.reset()
    bench.drive(encoder_a_n=1, encoder_b_n=1, drive_enable=1, external_fault=1)
    Clock(dut.oscillator, 20 * bench.period_ns, "ns").start()
    master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "axi"), dut.clk)
    for part in (master.write_if, master.read_if):
        part.log.setLevel(logging.WARNING)
    return bench, master
