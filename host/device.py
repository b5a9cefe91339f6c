"""The description that a device carries with it: its identity and its registers."""

import json
import zlib
from dataclasses import dataclass
from types import MappingProxyType

from ..model.arithmetic.fixed import SQ, UQ
from ..model.axes.axis import AXES_MAX
from ..model.axis.registers import CONSTANTS, LAYOUT, MAP, SPACE, TELEMETRY
from ..model.register import VALUE_BITS, Kind, Register
from .errors import ForeignError
from .port import Port

TEXT_MAX = 1 << 18
"""The most characters of a map, which has some ten thousand."""
VENDOR = b"hardwall"
COLUMNS = ["address", "name", "kind", "signed", "bits", "si_per_lsb", "unit", "least", "most", "reset"]
"""The columns of the map's table."""
LAYOUT_AT, IDENTITY_AT, CLOCK_AT, MAP_AT, CAPTURE_AT, SAMPLE_AT, AXES_AT = 0, 2, 6, 8, 10, 12, 14
"""Addresses of the constants, which every version has at the same places; the last one of several axes only."""
CONSTANT_NAMES = (
    ("layout", LAYOUT_AT, ""),
    ("identity_high", IDENTITY_AT, ""),
    ("identity_low", IDENTITY_AT + 2, ""),
    ("clock_hz", CLOCK_AT, "Hz"),
    ("map_bytes", MAP_AT, ""),
    ("capture_registers", CAPTURE_AT, ""),
    ("clocks_per_sample", SAMPLE_AT, ""),
    ("axes", AXES_AT, ""),
)
"""Name, address and unit of every constant; the map in the device does not describe them."""


@dataclass(frozen=True)
class Device:
    """A device as it describes itself.

    Attributes:
        identity: hash of specification and map, 16 hexadecimal digits.
        clock_hz: frequency of its clock, Hz.
        registers: every register but the constants, by name.
        capture_registers: registers of its capture memory; 0 without one.
        clocks_per_sample: clocks from a sample to the next.
        axes: the number of axes. Each of several axes has a bank of registers; `registers` are the first one's.
    """

    identity: str
    clock_hz: int
    registers: MappingProxyType[str, Register]
    capture_registers: int
    clocks_per_sample: int
    axes: int = 1

    def of_kind(self, kind: Kind) -> tuple[Register, ...]:
        """Return the registers of a kind, in the order of their addresses."""
        return tuple(each for each in self.registers.values() if each.kind is kind)

    @property
    def accelerates(self) -> bool:
        """Whether its estimator has an acceleration."""
        return "acceleration" in self.registers

    @property
    def constants(self) -> tuple[Register, ...]:
        """The registers of the constants, in the order of their addresses; a device of one axis has no `axes`."""
        return tuple(
            Register(name, Kind.CONSTANT, UQ(VALUE_BITS, 0), "", 1.0, unit, address=CONSTANTS + at)
            for name, at, unit in CONSTANT_NAMES
            if name != "axes" or self.axes > 1
        )


def read_identity(port: Port) -> str:
    """Return the identity of the device at a port.

    Raises:
        HostError: if it does not answer.
    """
    return "".join(f"{each:04x}" for each in port.read(IDENTITY_AT, CLOCK_AT - IDENTITY_AT))


def read_device(port: Port) -> Device:
    """Return what the device at a port says of itself.

    Raises:
        ForeignError: if it is none of ours, or of another version.
        HostError: if it does not answer.
    """
    said = port.identify()
    if said.get(0) != VENDOR:
        raise ForeignError(
            f"the device at {port.name} is {said.get(0, b'?').decode(errors='replace')!r}, not a hardwall board"
        )
    constants = port.read(CONSTANTS, TELEMETRY - CONSTANTS)

    def constant(place: int) -> int:
        return constants[place] << 16 | constants[place + 1]

    if constant(LAYOUT_AT) != LAYOUT:
        raise ForeignError(
            f"the device at {port.name} has the register layout {constant(LAYOUT_AT)}; this hardwall knows "
            f"{LAYOUT}: use the version of hardwall that made its bitstream"
        )
    size = constant(MAP_AT)
    if not 0 < size <= 2 * (SPACE - MAP):
        raise ForeignError(f"the map of the device at {port.name} must have 1 to {2 * (SPACE - MAP)} bytes, not {size}")
    window = b"".join(each.to_bytes(2, "big") for each in port.read(MAP, (size + 1) // 2))
    identity = f"{constant(IDENTITY_AT):08x}{constant(IDENTITY_AT + 2):08x}"
    registers = _registers(port.name, window[:size], identity)
    axes = constant(AXES_AT)
    if axes > AXES_MAX:
        raise ForeignError(f"the device at {port.name} must have at most {AXES_MAX} axes, not {axes}")
    # A device of one axis has no such constant.
    last = constant(CAPTURE_AT), constant(SAMPLE_AT), max(axes, 1)
    return Device(identity, constant(CLOCK_AT), MappingProxyType(registers), *last)


def _registers(name: str, compressed: bytes, identity: str) -> dict[str, Register]:
    """Return the registers of a compressed map; check that it belongs to the identity."""
    try:
        text = zlib.decompressobj().decompress(compressed, TEXT_MAX)
        described = json.loads(text)
        if described["identity"] != identity or described["columns"] != COLUMNS:
            raise ValueError("it is of another build")
        return {row[1]: _register(*row) for row in described["registers"]}
    except (zlib.error, ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        raise ForeignError(f"the map of the device at {name} cannot be read: {error}") from None


def _register(
    address: int, name: str, kind: str, signed: int, bits: int, lsb: float, unit: str, *words: int
) -> Register:
    """Return a row of the map as a register: its word is an integer, with an SI value of its 1."""
    least, most, reset = words
    form = SQ(bits, 0) if signed else UQ(bits, 0)
    return Register(name, Kind(kind), form, "", lsb, unit, least, most, reset, address)
