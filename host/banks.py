"""Several axes on one board: a port to the bank of each, and all of them behind the one line."""

from collections.abc import Iterator
from contextlib import AbstractContextManager

from ..model.axes.registers import BANK, is_shared
from ..model.axis.registers import COUNTERS, END, PULSES, TELEMETRY
from .axis import Axis
from .device import Device
from .heartbeat import Beat
from .port import Port
from .requests import PLAIN, Sending
from .shared import Shared


class BankPort(Port):
    """A port to the bank of one of several axes, by the addresses of an axis that is alone.

    Some registers exist once for all axes: the constants, the counters of the link, and the words of the host and of
    the capture memory. They are read and written at their own addresses.

    Args:
        port: the line.
        device: the device there.
        axis: the number of the axis.

    Attributes:
        name: the name of the line.
    """

    def __init__(self, port: Port, device: Device, axis: int):
        self._line, self._base, self.name = port, BANK * axis, port.name
        words = filter(is_shared, device.registers.values())
        blocks = [(0, TELEMETRY), (COUNTERS, PULSES), *((word.address, word.address + word.size) for word in words)]
        self._once = {address for first, end in blocks for address in range(first, end)}

    @property
    def pace(self) -> float:
        """The pace of the line: see `Port.pace`."""
        return self._line.pace

    @property
    def lease(self) -> str | None:
        """The lease of the line: see `Port.holder`."""
        return self._line.lease

    def line_s(self, count: int) -> float:
        """Return the time that a read of so many registers takes of the line, s."""
        return self._line.line_s(count)

    def first(self) -> AbstractContextManager[None]:
        """Give this thread's requests precedence over other threads'."""
        return self._line.first()

    def relay(self, request: bytes) -> bytes:
        """Return the answer to another program's request; its addresses are the line's."""
        return self._line.relay(request)

    def read(self, address: int, count: int) -> tuple[int, ...]:
        """Return successive registers; what there is once takes another request. Errors: see `Port.read`."""
        places = range(address, address + count)
        if not self._base or address >= END:
            return self._line.read(address, count)
        once = [place for place in places if place in self._once]
        registers = dict(zip(places, self._line.read(self._base + address, count), strict=True))
        if once:
            first, size = once[0], once[-1] + 1 - once[0]
            found = zip(range(first, first + size), self._line.read(first, size), strict=True)
            registers |= {place: word for place, word in found if place in self._once}
        return tuple(registers[place] for place in places)

    def write(self, address: int, registers: tuple[int, ...], sending: Sending = PLAIN) -> None:
        """Write successive registers, all in one request; arguments and errors: see `Port.write`."""
        self._line.write(address + (0 if address in self._once else self._base), registers, sending)

    def identify(self) -> dict[int, bytes]:
        """Return the objects by which the device identifies itself."""
        return self._line.identify()

    def close(self) -> None:
        """Leave the line open, for the other axes."""


class Axes:
    """All axes on a board, from `hardwall.host.connect_axes`. A context manager that disarms each, and closes.

    Each is an `Axis`, with words, states and acts of its own. The board hears one heartbeat. It continues while the
    lease of any axis lasts. It stops beside an axis that is ARMED without a lease: after the end of its lease, or
    because an earlier host left it ARMED. Disarm that axis, or renew its lease. `supervisor_watchdog` is one word for
    all axes. There is one capture memory: it records the axis whose `capture` was started last.

    Args:
        port: the line.
        device: the device there.

    Attributes:
        device: what the board says of itself.

    Raises:
        HostError: if the board does not answer.
    """

    def __init__(self, port: Port, device: Device):
        self.device, self._port = device, port
        self._axes = list[Axis]()
        shared = Shared(Beat(port, device.registers["heartbeat"]), {}, self._axes)
        try:
            for axis in range(device.axes):
                self._axes.append(Axis(BankPort(port, device, axis), device, shared, axis))
        except BaseException:
            self._close_axes()
            raise

    def __enter__(self) -> "Axes":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self._axes)

    def __getitem__(self, axis: int) -> Axis:
        return self._axes[axis]

    def __iter__(self) -> Iterator[Axis]:
        return iter(self._axes)

    def close(self) -> None:
        """Disarm every axis, if the board can still be reached, and close the port."""
        try:
            self._close_axes()
        finally:
            self._port.close()

    def _close_axes(self) -> None:
        """Close the axes, each though another cannot be."""
        try:
            if self._axes:
                self._axes.pop().close()
        finally:
            if self._axes:
                self._close_axes()
