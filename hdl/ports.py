"""A Markdown table of the ports of a component's Verilog."""

from collections.abc import Iterable
from typing import NamedTuple

from amaranth.hdl import Shape
from amaranth.lib import wiring
from amaranth.lib.data import ArrayLayout

from hardwall.model.arithmetic.fixed import SQ, UQ, Format
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis.design import ILLEGAL_WIDTH
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.spec import AxisSpec

from .axes.axis import Axes
from .axes.board import AxesBoard
from .axis.axis import Axis
from .axis.board import Board

COLUMNS = ("port", "direction", "width", "format", "one LSB", "range", "reset", "what it is")
MEANINGS = {
    "clk": "clock; everything is done at its rise",
    "rst": "reset while high",
    "oscillator": "another clock, 1 to 10 MHz, not of the same source: it finds out if the first one stops",
    "encoder_a": "encoder's pin A; asynchronous",
    "encoder_b": "encoder's pin B; asynchronous",
    "encoder_z": "encoder's index pin; asynchronous",
    "encoder_a_n": "complement of A; asynchronous; unused unless encoder_loss is enabled",
    "encoder_b_n": "complement of B; asynchronous; unused unless encoder_loss is enabled",
    "drive_enable": "low: the drive is zero",
    "external_fault": "loop of the amplifier's fault; low is a cause, unless it is disabled",
    "emergency_stop": "loop of the emergency stop; low: the drive is zero",
    "clear_flags": "pulse: clear flags and illegal_count",
    "preload": "pulse: set the count; the estimator starts afresh at the next sample",
    "origin_shift": "pulse: add to the count and to index_count; the estimator starts afresh at the next sample",
    "preload_count": "what preload sets the count to, and what origin_shift adds",
    "slip": "the count has lost its scale: index_latched and referenced fall",
    "index_arm": "pulse: latch the place of the next index",
    "commit": "pulse: take all parameters at the next sample; hold them until commit_pending falls",
    "drive": "force on the handle: what is to leave the FPGA",
    "sampled": "high for one clock with the drive of a sample",
    "actuated": "high for one clock with a drive that follows the force",
    "count": "position, live",
    "sampled_count": "position that a sample took; it changes with the velocity that was estimated from it",
    "velocity": "estimate of the last sample",
    "acceleration": "second output of the estimator, with `velocity`",
    "wall_force": "the wall's force on the handle at the last sample",
    "flags": "sticky",
    "stepped": "high for one clock with the count of a new edge",
    "edge_kind": "kind of the last edge: 0 A rises, 1 B rises, 2 A falls, 3 B falls",
    "edge_down": "the last edge counted -1",
    "indexed": "high for one clock with stepped, if the edge found an index, at the count before it",
    "estimated": "high for one clock with the estimate of a sample",
    "saturated": "with estimated: the estimator is saturated",
    "strobe_busy": "high for one clock behind a sample that began before the last one's velocity was there",
    "illegal": "sticky: both channels changed at once; the position is unknown",
    "overspeed": "sticky: edges came faster than the filter passes; the position is unknown",
    "wrapped": "sticky: the count has gone beyond an end of its range; the position is unknown",
    "illegal_count": "illegal transitions since the last clear; saturates",
    "index_count": "place of the index, once index_latched",
    "index_armed": "an index is waited for",
    "index_latched": "index_count is valid",
    "referenced": "the origin was shifted since the index was latched, and the scale has not slipped",
    "stamp": "number of this clock",
    "stamp_a_rise": "stamp of the last rise of A",
    "stamp_b_rise": "stamp of the last rise of B",
    "stamp_a_fall": "stamp of the last fall of A",
    "stamp_b_fall": "stamp of the last fall of B",
    "commit_pending": "parameters wait for the next sample",
    "uart_rx": "serial line from the host, Modbus RTU; idle high; asynchronous",
    "uart_tx": "serial line to the host; idle high",
    "axi_awaddr": "bus: byte address of a write",
    "axi_awprot": "bus: no effect",
    "axi_awvalid": "bus: there is an address to write to",
    "axi_awready": "bus: the address is taken, together with the data",
    "axi_wdata": "bus: what is written",
    "axi_wstrb": "bus: the bytes that are written: the upper half, the lower, or both",
    "axi_wvalid": "bus: there is something to write",
    "axi_wready": "bus: the data are taken",
    "axi_bresp": "bus: 0 written, 2 refused, 3 no such register",
    "axi_bvalid": "bus: the write has ended",
    "axi_bready": "bus: the end of the write is taken",
    "axi_araddr": "bus: byte address of a read",
    "axi_arprot": "bus: no effect",
    "axi_arvalid": "bus: there is an address to read from",
    "axi_arready": "bus: the address is taken",
    "axi_rdata": "bus: what was read",
    "axi_rresp": "bus: 0 read, 2 refused, 3 no such register",
    "axi_rvalid": "bus: the read has ended",
    "axi_rready": "bus: what was read is taken",
    "drive_pdm": "pulses; their density is the magnitude of the drive; safe when low",
    "drive_sign": "1: the drive is negative, or positive if it is inverted",
    "gate_high_a": "high gate of the bridge's leg A, which pulses for a positive drive; safe when low",
    "gate_low_a": "low gate of leg A; safe when low",
    "gate_high_b": "high gate of leg B, which pulses for a negative drive; safe when low",
    "gate_low_b": "low gate of leg B; safe when low",
    "dac_cs_n": "chip select of the DAC, low during a frame",
    "dac_sclk": "serial clock of the DAC",
    "dac_mosi": "serial data of the DAC, the uppermost bit first",
    "dac_clear_n": "clear of the DAC: its level holds it at its middle code while low; safe when low",
    "alive": "square wave while ARMED, for the charge pump of an amplifier's enable; safe when low",
    "outputs_enable": "enable of the buffers of the drive's pins and alive: both clocks run, the reset has ended",
}
"""The meaning of every port; a run-time word has its own text."""
OF_SEVERAL = {
    "commit": "pulse: the words of the axis's shadow act together from its next sample on",
    "commit_pending": "the words of the axis's shadow wait for its next sample",
    "word_write": "write word_value into the shadow of the word word_number of the axis word_axis, while word_ready",
    "word_axis": "the axis of the word that is written",
    "word_number": "the number of the word that is written: see the words below",
    "word_value": "what is written; a signed word modulo its width",
    "word_ready": "words can be written: the first rota after a reset is over",
    "strobe": "an axis is sampled in this clock",
    "strobe_axis": "the axis that is sampled in this clock",
    "velocity": "estimate of the axis that is estimated",
    "estimated_count": "the count of the sample of which the velocity is",
    "record_valid": "high for one clock, a clock after the end of every sample of any axis, with its record",
    "record_axis": "the axis of the record",
    "record_count": "the count of the sample",
    "record_velocity": "the velocity that was made of it",
    "record_wall_force": "the wall's force that was made of it",
    "record_drive": "the drive of the axis at the end of the sample",
    "record_flags": "the flags of the axis at the end of the sample",
}
"""The meaning of the ports that several axes have otherwise, or alone."""


Described = Axis | Axes | Board | AxesBoard
"""The components whose ports can be described."""


class Quantity(NamedTuple):
    """The quantity that a port's word stands for."""

    format: Format
    si_per_unit: float
    unit: str
    reset: int | None = None
    range: tuple[int, int] | None = None
    """The words that are accepted; None for the format's."""


def _quantities(spec: AxisSpec | AxesSpec) -> dict[str, Quantity]:
    """Return the quantities of the ports that carry numbers, by name; all other ports are bits."""
    count = Quantity(SQ(spec.count_width, 0), spec.count_m, "m")
    force = Quantity(spec.force, spec.force_resolution_n, "N")
    stamp = Quantity(UQ(spec.stamp_width, 0), 1 / spec.clock_hz, "s")
    velocity = Quantity(spec.design.estimator.velocity, spec.velocity_unit_m_per_s, "m/s")
    counts = ("count", "sampled_count", "preload_count", "index_count", "estimated_count", "record_count")
    estimator, accelerations = spec.design.estimator, {}
    if isinstance(estimator, Accelerated):
        unit = spec.velocity_unit_m_per_s * spec.sample_hz
        accelerations = {"acceleration": Quantity(estimator.acceleration, unit, "m/s^2")}
    return {
        **accelerations,
        **dict.fromkeys(counts, count),
        **dict.fromkeys(("drive", "wall_force", "record_drive", "record_wall_force"), force),
        **dict.fromkeys(("stamp", "stamp_a_rise", "stamp_b_rise", "stamp_a_fall", "stamp_b_fall"), stamp),
        "edge_kind": Quantity(UQ(2, 0), 1.0, ""),
        "illegal_count": Quantity(UQ(ILLEGAL_WIDTH, 0), 1.0, ""),
        **dict.fromkeys(("velocity", "record_velocity"), velocity),
        **{
            word.name: Quantity(word.format, word.si_per_unit, word.unit, word.reset, (word.low, word.high))
            for word in spec.design.words
        },
    }


def _rows(component: Described) -> Iterable[tuple[str, ...]]:
    spec = component.spec
    quantities = _quantities(spec)
    meanings = MEANINGS | {word.name: word.doc for word in spec.design.words}
    if isinstance(spec, AxesSpec):
        meanings |= OF_SEVERAL
    meanings["flags"] += ": " + ", ".join(f"bit {bit} {name}" for bit, name in enumerate(spec.design.flags))
    members = {name: (member.flow, member.shape) for name, member in component.signature.members.items()}
    for name, (flow, shape) in ({"clk": (wiring.In, 1), "rst": (wiring.In, 1)} | members).items():
        width = Shape.cast(shape).width
        kind, *numbers = (
            _number(quantities[name]) if name in quantities else ("bit" * (width == 1) or "bits", "", "", "")
        )
        each = f"{shape.length} x " if isinstance(shape, ArrayLayout) else ""
        yield f"`{name}`", "in" if flow is wiring.In else "out", str(width), each + kind, *numbers, meanings[name]


def _number(quantity: Quantity) -> tuple[str, str, str, str]:
    """Return format, SI value of one LSB, range and reset word, as text."""
    fmt, unit = quantity.format, f" {quantity.unit}" if quantity.unit else ""
    scale = fmt.lsb * quantity.si_per_unit
    lsb = f"{scale:.6g}{unit}" if unit else ""
    reset = "" if quantity.reset is None else str(quantity.reset)
    low, high = quantity.range or (fmt.min, fmt.max)
    return str(fmt), lsb, f"{low * scale:.6g} to {high * scale:.6g}{unit}", reset


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def port_table(component: Described) -> str:
    """Return a Markdown table of every port of the component's Verilog, `clk` and `rst` included.

    Raises:
        TypeError: if `component` is none of `Described`.
    """
    if not isinstance(component, Described):
        raise TypeError(f"component must be an Axis, Axes or a board of these, not {component!r}")
    return _table(COLUMNS, _rows(component))
