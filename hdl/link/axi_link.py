"""The link of an axis that has a processor beside it: an AXI4-Lite bus, from its signals to the ports of an axis."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import connect

from hardwall.model.axis import register_file
from hardwall.model.axis.registers import RegisterMap

from ..axis.register_file import RegisterFile
from ..board.lead_out import lead_out
from .axi import Subordinate


class AxiLink(wiring.Component):
    """The registers of an axis behind an AXI4-Lite bus of the axis's own clock.

    Latency, rounding and overflow: as in the blocks.

    Parameters
    ----------
    registers : hardwall.model.axis.registers.RegisterMap
        The registers.

    Members
    -------
    the signals of `Subordinate` : In and Out
        The bus.
    the members of `RegisterFile` without `host` : In and Out
        The ports to the axis.

    Raises
    ------
    TypeError
        If `registers` is not a RegisterMap.
    """

    PINS = Subordinate.PINS

    def __init__(self, registers: RegisterMap):
        self._registers = registers
        self._file = RegisterFile(register_file.Design(registers))
        super().__init__({**self.PINS, **self._file.ports})

    @property
    def registers(self) -> RegisterMap:
        return self._registers

    def elaborate(self, platform):
        m = Module()
        m.submodules.subordinate = subordinate = Subordinate()
        m.submodules.file = file = self._file
        connect(m, subordinate.file, file.host)
        m.d.comb += [lead_out(subordinate, self, self.PINS), lead_out(file, self, file.ports)]
        return m
