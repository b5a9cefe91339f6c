"""The registers of several axes: for each of them a bank with the registers of an axis alone.

The bank of axis k begins at k times 0x0100, and a register of it is as far from there as the same register of a single
axis is from 0 (`hardwall.model.registers`, which describes both). So what a host knows of one axis it knows of each.

What there is once for all axes is in the bank of axis 0, and reads 0 in the others, where it cannot be written:

- the constants, to which `axes` is added;
- the counters of the link;
- `heartbeat` and `supervisor_watchdog`, for there is one host.

The map that the device carries in its window has the registers of axis 0, and the number of banks. There is no capture
memory: the constant `capture_registers` is 0. The stamps of edges stay 0, for no axis of several keeps them.
"""

import dataclasses
from typing import ClassVar

from .axes import AxesSpec
from .checks import check_int, shown
from .register import Register
from .registers import END, RegisterMap
from .supervised import registers_of
from .supervised_axes import Design

SHARED = "heartbeat", "supervisor_watchdog"
"""Live words that there are once for all axes."""
BANK = END
"""The addresses from the bank of an axis to that of the next one."""


class AxesMap(RegisterMap):
    """The registers of supervised axes: those of axis 0, placed, which every other axis has in a bank of its own.

    Args:
        spec: the axes.

    Attributes:
        spec: as given.
        banks: the number of banks, one for each axis.

    The other attributes are those of `RegisterMap`, for the bank of axis 0.

    Raises:
        TypeError: if `spec` is not an AxesSpec.
    """

    PRODUCT: ClassVar = b"axes"
    spec: AxesSpec

    def __init__(self, spec: AxesSpec):
        if not isinstance(spec, AxesSpec):
            raise TypeError(f"spec must be an AxesSpec, not {shown(spec)}")
        self.spec, self.banks = spec, spec.axes
        self.capture_registers, self.capture = 0, None
        design = Design(spec)
        # The same words in the same order as those of a single axis: the watchdog is among them.
        live = (*design.supervisor.words, *design.monitors.words, design.live[-1])
        self._describe(registers_of(spec, live, design.ranges), design.committed)

    @property
    def _more_constants(self) -> tuple[tuple[str, int, str, str], ...]:
        return (("axes", self.banks, "", "The axes of the device, each of which has a bank of registers."),)

    @property
    def _more_described(self) -> dict[str, int]:
        return {"banks": self.banks}

    def of_axis(self, name: str, axis: int) -> Register:
        """Return the register of a name in the bank of an axis.

        Raises:
            KeyError: if there is no register of that name.
            TypeError: if `axis` is not an int.
            ValueError: if there is no such axis, or what is asked for is in the bank of axis 0 only.
        """
        check_int("axis", axis, 0, self.banks - 1)
        register = self[name]
        if axis and name in SHARED:
            raise ValueError(f"axis must be 0 for {name}, which there is once for all axes, not {axis!r}")
        return dataclasses.replace(register, address=register.address + BANK * axis)
