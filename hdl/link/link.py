"""The link: Modbus RTU on a UART, from the pins of the line to the ports of an axis, or of several."""

from typing import ClassVar

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect

from hardwall.model.axes import register_file as banked_file
from hardwall.model.axes.registers import AxesMap
from hardwall.model.axis import register_file
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.link import uart
from hardwall.model.link.line import GAP_S

from ..axes.register_file import BankedFile
from ..axis.register_file import RegisterFile
from ..board.lead_out import lead_out
from .line import Line
from .server import Server
from .uart import Receiver, Transmitter


class Link(wiring.Component):
    """The registers of an axis, or of several, behind the two pins of a serial line.

    Unit 1 answers the functions 3, 4, 6, 16 and 23 (registers), 8 (counters) and 43/14 (identification) in frames of at
    most 256 bytes; `hardwall.model.axis.registers` has the addresses, and `hardwall.model.axes.registers`. The line's
    idle level is high.

    Latency: an answer begins when the request has been carried out: less than 6000 clocks after its last byte. A commit
    takes up to a sample period more, and with several axes the waits of `BankedFile`. A pulse is at its port before the
    answer begins.

    Rounding and overflow: as in the blocks.

    Parameters
    ----------
    registers : hardwall.model.axis.registers.RegisterMap
        The registers, of several axes an AxesMap; its spec has the clock.
    baud : int
        Rate of the line, bits a second.

    Members
    -------
    uart_rx : In(1)
        Line from the host; asynchronous.
    uart_tx : Out(1)
        Line to the host.
    the members of `RegisterFile` without `host`, of several axes those of `BankedFile` : In and Out
        The ports to the axis, or the axes.

    Raises
    ------
    TypeError
        If `registers` is not a RegisterMap, or `baud` is not an int.
    ValueError
        If the clock does not allow the rate.

    Source: "Modbus over Serial Line, Specification and Implementation Guide V1.02" and "Modbus Application Protocol
    Specification V1.1b3".
    """

    PINS: ClassVar = {"uart_rx": In(1, init=1), "uart_tx": Out(1, init=1)}

    def __init__(self, registers: RegisterMap, baud: int = uart.BAUD):
        several = isinstance(registers, AxesMap)
        design = banked_file.Design(registers) if several else register_file.Design(registers)
        self._registers = registers
        self._uart = uart.Design(registers.spec.clock_hz, baud)
        self._file, self._server = BankedFile(design) if several else RegisterFile(design), Server(design)
        super().__init__({**self.PINS, **self._file.ports})

    @property
    def registers(self) -> RegisterMap:
        return self._registers

    @property
    def baud(self) -> int:
        return self._uart.baud

    @property
    def gap_clocks(self) -> int:
        """Clocks of silence that end a frame without a length."""
        return round(GAP_S * self._registers.spec.clock_hz)

    def elaborate(self, platform):
        m = Module()
        m.submodules.receiver = receiver = Receiver(self._uart)
        m.submodules.transmitter = transmitter = Transmitter(self._uart)
        m.submodules.line = line = Line(self.gap_clocks)
        m.submodules.server = server = self._server
        m.submodules.file = file = self._file
        connect(m, line.frames, server.frames)
        connect(m, server.file, file.host)
        connect(m, line.sent, transmitter.bytes)
        m.d.comb += [
            receiver.pin.eq(self.uart_rx),
            line.byte.eq(receiver.byte),
            line.arrived.eq(receiver.arrived),
            line.spoilt.eq(receiver.spoilt),
            self.uart_tx.eq(transmitter.pin),
        ]
        m.d.comb += lead_out(file, self, file.ports)
        return m
