"""The register at a host's address on a board of several axes, and the pulses that the axis refuses there."""

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib.wiring import Component

from hardwall.model.axes.registers import BANK
from hardwall.model.axis.registers import CAPTURE, COUNTERS, END, MAP, PULSES, SUPERVISOR, TELEMETRY
from hardwall.model.axis.supervisor import ARMED

from ..arithmetic.fixed import less
from ..link.axis_status import word_of
from ..wires import names_of


class At(NamedTuple):
    """The register at the host's address.

    Attributes:
        place, bank: its lowest bits, and the bank, which may be none.
        in_banks, in_map, in_capture: whether it is a register of a bank, of the window, of the capture memory.
        is_pulse, is_status: the register is a pulse, or a status.
        wide: it is one of two of a value.
        half: a frame begins or ends with it, and has half of a value.
    """

    place: Value
    bank: Value
    in_banks: Value
    in_map: Value
    in_capture: Value
    is_pulse: Value
    is_status: Value
    wide: Value
    half: Value


class Axes(NamedTuple):
    """The axes of an operation: at the address, written by the frame, and read in its status.

    Attributes:
        here, to, asked: their numbers.
        asks: the frame reads a status.
    """

    here: Signal
    to: Signal
    asked: Signal
    asks: Signal


def at_address(m: Module, file: Component, depth: int) -> At:
    """Return what there is at the host's address.

    Args:
        m: the module.
        file: the `BankedFile`.
        depth: how many cells of banks there are.
    """
    host, registers = file.host, file.design.registers
    address, bits = host.address, (END - 1).bit_length()
    place, bank = address[:bits], address[bits : (depth - 1).bit_length()]
    in_map, in_capture = (address[14:] == MAP >> 14) & less(address[:14], len(file.design.map_cells)), Const(0)
    if registers.capture:
        in_capture = (address[15:] == CAPTURE >> 15) & less(address[:15], registers.capture_registers)
    # Each is a signal of its own: an expression would be written out wherever it is asked for.
    in_banks, wide, is_pulse, is_status = Signal(), Signal(), Signal(), Signal()
    status_places = Cat(place[5:] == block >> 5 for block in (TELEMETRY, SUPERVISOR)).any()
    m.d.comb += [
        in_banks.eq(less(address, BANK * file.design.banks)),
        # Counters and pulses have one register.
        wide.eq(in_banks & (place[5:] != COUNTERS >> 5)),
        is_pulse.eq(in_banks & (place[4:] == PULSES >> 4)),
        is_status.eq(in_banks & status_places),
    ]
    half = wide & ((host.first & place[0]) | (host.last & ~place[0]))
    return At(place, bank, in_banks, in_map, in_capture, is_pulse, is_status, wide, half)


def refused(m: Module, file: Component, wanted: Value, asking: Value) -> Value:
    """Return whether the axis refuses the wanted pulse, by the outputs of its last turn.

    Args:
        m: the module.
        file: the `BankedFile`.
        wanted: the pulses, in the order of the map.
        asking: the axis.
    """
    banks = file.design.banks
    ready, armed = Signal(banks), Signal(banks)
    for axis in range(banks):
        with m.If(file.turn_valid & (file.turn_axis == axis)):
            m.d.sync += [ready[axis].eq(file.turn_ready), armed[axis].eq(file.turn_state == ARMED)]
    moving = word_of(armed, asking, banks)
    refusing = {"arm": ~word_of(ready, asking, banks), "preload": moving, "origin_shift": moving}
    names = names_of(file.design.registers.pulses)
    return Cat(wanted[bit] & refusing[name] for bit, name in enumerate(names) if name in refusing).any()
