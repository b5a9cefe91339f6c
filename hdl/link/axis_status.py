"""The status of one of several axes: taken from what all of them show of samples and turns, and held for the host."""

from typing import NamedTuple

from amaranth.hdl import Cat, Const, Module, Mux, ShapeLike, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.data import ArrayLayout

from hardwall.model.axes.register_file import Design
from hardwall.model.axis.register_file import CELL_BITS
from hardwall.model.axis.registers import COUNTERS, EDGE_STAMPS
from hardwall.model.axis.supervisor import COUNT, COUNT_BITS
from hardwall.model.register import VALUE_BITS

from ..arithmetic.fixed import shape
from ..wires import ports

RECORD = "count", "velocity", "wall_force", "drive", "flags"
"""The axes' outputs for a sample; their names begin with `record_`."""
TURN = "state", "ready", "latched", "first", "first_stamp", "counts", "a_channel_idle"
"""The axes' outputs for a turn; their names begin with `turn_`."""
WITH_RECORD = "illegal_count", "index_count", "index_armed", "index_latched"
"""Outputs for every axis at every clock; an axis's are taken with its record."""
OF_CAPTURE = "capture_state", "capture_place", "capture_stamp"
"""The status of the capture memory, if there is one: the same in every bank, taken with the turn."""
EDGE_KIND_BITS = (len(EDGE_STAMPS) - 1).bit_length()


def captured(design: Design) -> tuple[str, ...]:
    """Return the names of the status of the capture memory; none without one."""
    return OF_CAPTURE if design.registers.capture else ()


def shown(design: Design) -> dict[str, ShapeLike]:
    """Return the shapes of what `SupervisedAxes` shows of samples, turns and axes, by the names of its members."""
    spec, registers = design.registers.spec, design.registers
    axes, number, flags = spec.axes, range(max(spec.axes, 2)), spec.design.flags
    count, force = shape(registers["count"].format), shape(spec.force)
    record = {
        "valid": 1,
        "axis": number,
        **dict(zip(RECORD, (count, shape(spec.design.estimator.velocity), force, force, len(flags)), strict=True)),
    }
    bits = (2, 1, COUNT, COUNT, spec.stamp_width, COUNT * COUNT_BITS, 1)
    turn = {"valid": 1, "axis": number, **dict(zip(TURN, bits, strict=True))}
    return {
        **{f"record_{name}": each for name, each in record.items()},
        **{f"turn_{name}": each for name, each in turn.items()},
        "strobe": 1,
        "strobe_axis": number,
        "stepped": axes,
        "edge_kind": ArrayLayout(EDGE_KIND_BITS, axes),
        "illegal_count": ArrayLayout(shape(registers["illegal_count"].format), axes),
        "index_count": ArrayLayout(count, axes),
        "magnitude": ArrayLayout(shape(design.axes.supervisor.limit), axes),
        **dict.fromkeys(("index_armed", "index_latched", "referenced", "negative"), axes),
        "stamp": spec.stamp_width,
        "live": 1,
        "word_ready": 1,
        **{name: shape(registers[name].format) for name in captured(design)},
    }


def word_of(values: Value, axis: Value, axes: int) -> Value:
    """Return the word of an axis, of all axes' words."""
    values = Value.cast(values)
    return values.word_select(axis, len(values) // axes)


def _edge_stamps(m: Module, file: wiring.Component) -> dict[str, Value]:
    """Return the stamps of the last edges of all axes, by name; they show an edge a clock behind its count.

    An edge is decoded a clock before its count is there, and has the number of that clock.
    """
    before, stamps = Signal.like(file.stamp, name="stamp_before"), {}
    m.d.sync += before.eq(file.stamp)
    for kind, name in enumerate(EDGE_STAMPS):
        last = [Signal.like(file.stamp, name=f"{name}_{axis}") for axis in range(file.design.registers.banks)]
        for axis, stamp in enumerate(last):
            with m.If(file.stepped[axis] & (file.edge_kind[axis] == kind)):
                m.d.sync += stamp.eq(before)
        stamps[name] = Cat(last)
    return stamps


def _taken(m: Module, file: wiring.Component, asked: Signal) -> tuple[dict[str, Value], ...]:
    """Return the status of an axis by name: what comes with its strobe, with its record, and with its turn."""
    registers, banks = file.design.registers, file.design.banks
    strobed = {name: word_of(stamps, asked, banks) for name, stamps in _edge_stamps(m, file).items()}
    seen = ports(file)
    record = {name: seen[f"record_{name}"] for name in RECORD}
    record |= {name: word_of(seen[name], asked, banks) for name in WITH_RECORD}
    record["velocity"] >>= max(len(file.record_velocity) - registers["velocity"].format.width, 0)
    turn = {name: seen[f"turn_{name}"] for name in TURN if name != "counts"}
    values = range(-(-len(file.turn_counts) // VALUE_BITS))
    turn |= {f"counts_{value}": file.turn_counts.word_select(value, VALUE_BITS) for value in values}
    magnitude, negative = (word_of(each, asked, banks) for each in (file.magnitude, file.negative))
    turn |= {"driven": Mux(negative, -magnitude, magnitude), "live": file.live}
    turn |= {"referenced": word_of(file.referenced, asked, banks)}
    turn |= ports(file, captured(file.design))
    return strobed, record | {"stamp": file.stamp}, turn


class Moments(NamedTuple):
    """When the status of an axis is taken: signals, each high for one clock.

    Attributes:
        strobed: the axis had its strobe a clock before.
        recorded, turned: the record of that sample, and then its turn, is shown.
    """

    strobed: Signal
    recorded: Signal
    turned: Signal


def held_status(m: Module, file: wiring.Component, asked: Signal, moments: Moments) -> Signal:
    """Return the register of a status at the host's address, as it was at the last moments.

    Args:
        m: the module.
        file: the `BankedFile`; its inputs are named as in `shown`.
        asked: the axis whose status is asked for.
        moments: when it is taken.
    """
    status, halves = Signal(CELL_BITS), {}
    for taken, values in zip(moments, _taken(m, file, asked), strict=True):
        for name, value in values.items():
            register = file.design.registers[name]
            held = Signal(shape(register.format), name=f"held_{name}")
            with m.If(taken):
                m.d.sync += held.eq(value)
            extension = (held[-1] if register.format.signed else Const(0)).replicate(VALUE_BITS - len(held))
            whole = Cat(held, extension)
            halves |= {register.address + 1: whole[:CELL_BITS], register.address: whole[CELL_BITS:]}
    with m.Switch(file.host.address[: (COUNTERS - 1).bit_length()]):
        for place, half in halves.items():
            with m.Case(place):
                m.d.comb += status.eq(half)
    return status
