"""The registers of several axes: for each of them a bank with the registers of an axis alone.

The bank of axis k begins at k times 0x0100. A register has the same offset in its bank as in the map of a single axis
(`hardwall.model.axis.registers` describes both). So what a host knows of one axis it knows of each.

What there is once for all axes is in the bank of axis 0, and reads 0 in the others, where it cannot be written:

- the constants, to which `axes` is added;
- the counters of the link;
- `heartbeat` and `supervisor_watchdog`, for there is one host;
- the words and pulses of the one capture memory (`hardwall.model.axes.capture`), and the word `capture_axis`. Its state
  can be read in every bank.

The map that the device carries in its window has the registers of axis 0, and the number of banks.
"""

import dataclasses
from typing import ClassVar

from ..axis.registers import CAPTURE_REGISTERS, END, RegisterMap, records_in
from ..axis.supervised import registers_of
from ..checks import check_int, shown
from ..register import Kind, Register
from .axis import AxesSpec
from .capture import ROTA_LEAST
from .capture import Design as Capture
from .supervised import Design

OF_THE_HOST = "heartbeat", "supervisor_watchdog"
"""Live words that exist once, because there is one host."""
OF_CAPTURE = "capture_"
"""How the names of what there is of the capture memory begin."""
BANK = END
"""The addresses from one bank to the next."""


def is_shared(register: Register) -> bool:
    """Return whether a live word or a pulse is there once for all axes; no other register is one of these."""
    if register.kind not in (Kind.LIVE, Kind.PULSE):
        return False
    return register.name in OF_THE_HOST or register.name.startswith(OF_CAPTURE)


class AxesMap(RegisterMap):
    """The registers of supervised axes: axis 0's, with their addresses. Every other axis has the same in its own bank.

    Args:
        spec: the axes.
        capture_registers: registers of the capture memory, 8 for each of its records; 0 for none. If it is not given:
            as many as a board has, or none where a rota is shorter than a record.

    Attributes:
        spec: as given.
        banks: the number of banks, one for each axis.

    The other attributes are as of `RegisterMap`, for the bank of axis 0.

    Raises:
        TypeError: if `spec` is not an AxesSpec.
        ValueError: if `capture_registers` is none that there can be, or a rota is shorter than a record.
    """

    PRODUCT: ClassVar = b"axes"
    spec: AxesSpec

    def __init__(self, spec: AxesSpec, capture_registers: int | None = None):
        if not isinstance(spec, AxesSpec):
            raise TypeError(f"spec must be an AxesSpec, not {shown(spec)}")
        self.spec, self.banks = spec, spec.axes
        if capture_registers is None:
            capture_registers = CAPTURE_REGISTERS if spec.clocks_per_sample >= ROTA_LEAST else 0
        records = records_in(capture_registers)
        self.capture_registers, self.capture = capture_registers, Capture(spec, records) if records else None
        design = Design(spec)
        # The same words in the same order as for a single axis; the watchdog is among them.
        live = (*design.supervisor.words, *design.monitors.words, design.live[-1])
        known = registers_of(spec, live)
        self._describe((*known, *(self.capture.registers() if self.capture else ())), design.committed)

    @property
    def _more_constants(self) -> tuple[tuple[str, int, str, str], ...]:
        return (("axes", self.banks, "", "The axes of the device, each of which has a bank of registers."),)

    @property
    def _more_described(self) -> dict[str, int]:
        return {"banks": self.banks}

    @property
    def shared(self) -> tuple[Register, ...]:
        """The live words and pulses that there are once for all axes."""
        return tuple(each for each in (*self.live, *self.pulses) if is_shared(each))

    def of_axis(self, name: str, axis: int) -> Register:
        """Return the register of a name in the bank of an axis.

        Raises:
            KeyError: if there is no register of that name.
            TypeError: if `axis` is not an int.
            ValueError: if there is no such axis, or what is asked for is in the bank of axis 0 only.
        """
        check_int("axis", axis, 0, self.banks - 1)
        register = self[name]
        if axis and is_shared(register):
            raise ValueError(f"axis must be 0 for {name}, which there is once for all axes, not {axis!r}")
        return dataclasses.replace(register, address=register.address + BANK * axis)
