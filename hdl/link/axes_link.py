"""The link of several axes: Modbus RTU on a UART, and a bank of registers for each axis."""

from amaranth.lib import wiring

from hardwall.model.axes_registers import AxesMap
from hardwall.model.link import banked_file, uart

from .banked_file import BankedFile
from .link import Link
from .server import Server


class AxesLink(Link):
    """The registers of several axes behind the two pins of a serial line: the blocks of `Link`, and a `BankedFile`.

    `hardwall.model.axes_registers` has the addresses.

    Latency: as of `Link`, with the times of `BankedFile`: an answer to a frame with pulses, and one with the status of
    an axis, waits for that axis's next samples.

    Rounding and overflow: as in the blocks.

    Parameters
    ----------
    registers : hardwall.model.axes_registers.AxesMap
        The registers; its spec has the clock.
    baud : int
        Rate of the line, bits a second.

    Members
    -------
    uart_rx, uart_tx : In(1) and Out(1)
        As of `Link`.
    the members of `BankedFile` without `host` : In and Out
        The ports to the axes.

    Raises
    ------
    TypeError
        If `registers` is not an AxesMap, or `baud` is not an int.
    ValueError
        If the clock does not allow the rate.
    """

    def __init__(self, registers: AxesMap, baud: int = uart.BAUD):
        design = banked_file.Design(registers)
        self._registers = registers
        self._uart = uart.Design(registers.spec.clock_hz, baud)
        self._file, self._server = BankedFile(design), Server(design)
        wiring.Component.__init__(self, {**self.PINS, **self._file.ports})
