"""Readable Verilog, and the table of its ports, from a component."""

import dataclasses
import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

# The Yosys that ships with Amaranth as a wheel: the same version, and so the same text, on every machine.
os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")

from amaranth.back import verilog
from amaranth.hdl import Shape
from amaranth.lib import wiring

from hardwall.model.arithmetic.fixed import SQ, UQ, Format
from hardwall.model.axis import ILLEGAL_WIDTH
from hardwall.model.spec import AxisSpec

from .axis import Axis
from .board import Board

COLUMNS = ("port", "direction", "width", "format", "one LSB", "range", "reset", "what it is")
MEANINGS = {
    "clk": "clock; everything is done at its rise",
    "rst": "reset while high",
    "encoder_a": "encoder's pin A; asynchronous",
    "encoder_b": "encoder's pin B; asynchronous",
    "encoder_z": "encoder's index pin; asynchronous",
    "drive_enable": "low: the drive is zero",
    "clear_flags": "pulse: clear flags and illegal_count",
    "preload": "pulse: set the count; the estimator starts afresh at the next sample",
    "preload_count": "what preload sets the count to",
    "index_arm": "pulse: latch the count at the next rise of the index",
    "commit": "pulse: take all parameters at the next sample; hold them until commit_pending falls",
    "drive": "force on the handle: what is to leave the FPGA",
    "sampled": "high for one clock with the drive of a sample",
    "actuated": "high for one clock with a drive that follows the force",
    "count": "position, live",
    "velocity": "estimate of the last sample",
    "wall_force": "the wall's force on the handle at the last sample",
    "flags": "sticky",
    "illegal_count": "illegal transitions since the last clear; saturates",
    "index_count": "count at the index, once index_latched",
    "index_armed": "an index is waited for",
    "index_latched": "index_count is valid",
    "stamp": "number of this clock",
    "stamp_a_rise": "stamp of the last rise of A",
    "stamp_b_rise": "stamp of the last rise of B",
    "stamp_a_fall": "stamp of the last fall of A",
    "stamp_b_fall": "stamp of the last fall of B",
    "commit_pending": "parameters wait for the next sample",
    "scan_select_n": "low: a frame is on its way; asynchronous",
    "scan_clock": "serial clock; a bit each way at its rise; asynchronous",
    "scan_in": "frame to the axis, most significant bit first; asynchronous",
    "scan_out": "frame from the axis, most significant bit first",
    "drive_pdm": "pulses; their density is the magnitude of the drive",
    "drive_sign": "1: the drive is negative",
}
"""What each port is; a run-time word says it itself."""


def to_verilog(component: wiring.Component, name: str) -> str:
    """Return Verilog of `component` as module `name`, with ports `clk` and `rst` beside its members.

    Source attributes are left out, so that the text depends on the design alone and can be cached by its content.
    """
    return verilog.convert(component, name=name, emit_src=False, strip_internal_attrs=True)


class Quantity(NamedTuple):
    """How a port's word is read."""

    format: Format
    si_per_unit: float
    unit: str
    reset: int | None = None


def _quantities(spec: AxisSpec) -> dict[str, Quantity]:
    """Return the ports of an axis that carry numbers; the others are bits."""
    count = Quantity(SQ(spec.count_width, 0), spec.count_m, "m")
    force = Quantity(spec.force, spec.force_resolution_n, "N")
    stamp = Quantity(UQ(spec.stamp_width, 0), 1 / spec.clock_hz, "s")
    return {
        **dict.fromkeys(("count", "preload_count", "index_count"), count),
        **dict.fromkeys(("drive", "wall_force"), force),
        **dict.fromkeys(("stamp", "stamp_a_rise", "stamp_b_rise", "stamp_a_fall", "stamp_b_fall"), stamp),
        "illegal_count": Quantity(UQ(ILLEGAL_WIDTH, 0), 1.0, ""),
        "velocity": Quantity(spec.design.estimator.velocity, spec.velocity_unit_m_per_s, "m/s"),
        **{word.name: Quantity(word.format, word.si_per_unit, word.unit, word.reset) for word in spec.design.words},
    }


def _rows(component: Axis | Board) -> Iterable[tuple[str, ...]]:
    spec = component.spec
    quantities = _quantities(spec)
    meanings = MEANINGS | {word.name: word.doc for word in spec.design.words}
    meanings["flags"] += ": " + ", ".join(f"bit {bit} {name}" for bit, name in enumerate(spec.design.flags))
    members = {name: (member.flow, Shape.cast(member.shape)) for name, member in component.signature.members.items()}
    for name, (flow, shape) in ({"clk": (wiring.In, Shape(1)), "rst": (wiring.In, Shape(1))} | members).items():
        numbers = (
            _number(quantities[name]) if name in quantities else ("bit" if shape.width == 1 else "bits", "", "", "")
        )
        yield f"`{name}`", "in" if flow is wiring.In else "out", str(shape.width), *numbers, meanings[name]


def _number(quantity: Quantity) -> tuple[str, str, str, str]:
    """Return format, SI value of one LSB, range and reset word, as text."""
    fmt, unit = quantity.format, f" {quantity.unit}" if quantity.unit else ""
    scale = fmt.lsb * quantity.si_per_unit
    lsb = f"{scale:.6g}{unit}" if unit else ""
    reset = "" if quantity.reset is None else str(quantity.reset)
    return str(fmt), lsb, f"{fmt.min * scale:.6g} to {fmt.max * scale:.6g}{unit}", reset


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def port_table(component: Axis | Board) -> str:
    """Return a Markdown table of every port of the component's Verilog, `clk` and `rst` included.

    Raises:
        TypeError: if `component` is neither an Axis nor a Board.
    """
    if not isinstance(component, Axis | Board):
        raise TypeError(f"component must be an Axis or a Board, not {component!r}")
    return _table(COLUMNS, _rows(component))


def _frame_table(board: Board, fields: tuple[tuple[str, Shape], ...]) -> str:
    """Return a Markdown table of the fields of a frame, in the order on the wire."""
    left, rows = board.frame_bits, []
    for name, shape in fields:
        bits = f"{left - 1}" if shape.width == 1 else f"{left - 1}:{left - shape.width}"
        rows.append((bits, f"`{name}`", "signed" if shape.signed else "unsigned"))
        left -= shape.width
    if left:
        rows.append((f"{left - 1}:0", "", "unused"))
    return _table(("bits", "field", "read as"), rows)


def _facts(spec: AxisSpec) -> list[str]:
    """Return the fields of the spec, one line each, with the gains that it stands for."""
    fields = {field.name: getattr(spec, field.name) for field in dataclasses.fields(spec)}
    fields["gains"] = spec.design.gains
    return [f"{name} = {value!r}" for name, value in fields.items()]


def _source(component: Axis | Board, name: str, what: str) -> str:
    head = [what, "Generated from the following; ports.md says what each port is.", "", *_facts(component.spec)]
    return "".join(f"// {line}".rstrip() + "\n" for line in head) + "\n" + to_verilog(component, name)


def write(spec: AxisSpec, folder: Path) -> tuple[Path, ...]:
    """Write `axis.v`, `board.v` and `ports.md` into `folder`, which is made if need be; return their paths.

    The text depends on the spec and the versions of this project and its Yosys alone.

    Raises:
        TypeError: if `spec` is not an AxisSpec.
        OSError: if a file cannot be written.
    """
    axis, board = Axis(spec), Board(spec)
    facts = "".join(f"    {line}\n" for line in _facts(spec))
    files = {
        "axis.v": _source(axis, "axis", "One axis of hardwall, encoder pins to drive: every parameter is a port."),
        "board.v": _source(board, "board", "One axis of hardwall behind a dozen pins, with a serial port."),
        "ports.md": (
            f"# Ports\n\nOf the axis\n\n{facts}\n"
            f"A sample every {spec.clocks_per_sample} clocks; the drive changes {axis.latency} clocks after it is "
            "taken. A word of the format SQ(i, f) is signed, UQ(i, f) unsigned, of i + f bits; f of them are the "
            "fraction.\n\n"
            f"## axis.v\n\n{port_table(axis)}\n"
            f"## board.v\n\n{port_table(board)}\n"
            f"### The serial port\n\nAn SPI device, mode 0: {board.frame_bits} bits each way, the first of them number "
            f"{board.frame_bits - 1}.\n\n"
            f"To the axis:\n\n{_frame_table(board, board.commands)}\n"
            f"From the axis:\n\n{_frame_table(board, board.telemetry)}"
        ),
    }
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(folder / name for name in files)
