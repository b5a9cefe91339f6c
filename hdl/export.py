"""Readable Verilog of a component, and the files that a user needs to instantiate an axis."""

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

# Use the Yosys wheel that comes with Amaranth: the same version, and so the same text, on every machine.
os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")

from amaranth.back import verilog
from amaranth.hdl import Fragment, Value, _ir, _nir
from amaranth.lib import wiring

from hardwall.model import register_texts
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.runtime.build_folder import home_for_tools
from hardwall.model.runtime.whole_file import write_files
from hardwall.model.spec import AxisSpec

from .any_part import AnyPart
from .axes.axis import Axes
from .axes.board import AxesBoard
from .axis.axis import Axis
from .axis.board import Board
from .axis.capture import NO_FIRST_CONTENTS
from .link.axi_link import AxiLink
from .ports import Described, port_table

START = r"\$start "
"""The name of the signal whose only change, at the start of a simulation, lets every `always @*` run once."""
_CONTENTS = re.compile(
    rf"^  \(\* {NO_FIRST_CONTENTS} = .* \*\)\n(  reg .*;\n)  initial begin\n(?:    .*\] = .*;\n)*  end\n", re.MULTILINE
)
_TRIGGER = re.compile(r"^  reg (\\\$auto\$verilog_backend\S+ ) = 0;$", re.MULTILINE)


def _with_start(text: str) -> str:
    """Return Verilog whose `always @*` blocks run once at the start, whatever the version of the language.

    Yosys lets each of them read a signal that is declared with the initial value 0. In Verilog-2005 this value is an
    assignment at time 0, and the change from x lets the block run. In SystemVerilog a declared value is there before
    any block waits: nothing changes, and what a block makes of constants and of unchanged registers stays x. Assigned
    without blocking, the value comes after every block has begun to wait, in both languages.
    """
    for trigger in _TRIGGER.findall(text):
        text = text.replace(f"  reg {trigger} = 0;\n", f"  reg {START};\n  initial {START}<= 1'h0;\n")
        text = text.replace(trigger, START)
    return text


@contextmanager
def _home_for_yosys() -> Iterator[None]:
    """Give Yosys, which runs in its own process, a home folder if the user has no usable one."""
    given = home_for_tools()
    before = {name: os.environ.get(name) for name in given}
    os.environ.update(given)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def to_verilog(component: wiring.Component, name: str) -> str:
    """Return the Verilog of `component` as module `name`, with ports `clk` and `rst` besides its members.

    Source attributes are left out, so that the text depends only on the design and can be cached by its content. It is
    Verilog-2005, and means the same where it is read as SystemVerilog. A memory with the attribute `NO_FIRST_CONTENTS`
    has no first contents. What the components add by `platform.add_file` comes behind it.

    Raises:
        ValueError: if two added files have one name, or one has a module called `name`.
    """
    part = AnyPart()
    with _home_for_yosys():
        text = verilog.convert(component, name=name, platform=part, emit_src=False, strip_internal_attrs=True)
    return part.added_to(_with_start(_CONTENTS.sub(r"\1", text)), name)


def to_netlist(component: wiring.Component, name: str) -> _nir.Netlist:
    """Return the netlist of `component` that `to_verilog` writes as text: Amaranth's own, before any tool has seen it.

    Amaranth has no public name for it: its range in pyproject.toml ends before the next minor version.
    """
    ports = {
        "__".join(map(str, path)): (
            Value.cast(value),
            _ir.PortDirection.Input if member.flow == wiring.In else _ir.PortDirection.Output,
        )
        for path, member, value in component.signature.flatten(component)
    }
    return _ir.build_netlist(Fragment.get(component, AnyPart()), ports, name=name)


def _facts(spec: AxisSpec | AxesSpec) -> list[str]:
    """Return the fields of the spec, one line each, with the gains that are in use."""
    return [f"{name} = {value!r}" for name, value in spec.facts.items()]


def _source(component: Described, name: str, what: str) -> str:
    head = [what, "Generated from the following; ports.md says what each port is.", "", *_facts(component.spec)]
    return "".join(f"// {line}".rstrip() + "\n" for line in head) + "\n" + to_verilog(component, name)


def _registers(registers: RegisterMap) -> dict[str, str]:
    """Return the pages of a register map, by name."""
    return {
        "registers.md": register_texts.markdown(registers),
        "registers.json": register_texts.as_json(registers),
    }


FORMATS = "A word of the format SQ(i, f) is signed, UQ(i, f) unsigned, of i + f bits; f of them are the fraction."


def _line(board: Board | AxesBoard) -> str:
    """Return what is said of a board's serial line."""
    return (
        f"The serial line has {board.link.baud} baud, 8 data bits, no parity and one stop bit. It speaks Modbus "
        "RTU as unit 1; registers.md has the registers.\n"
    )


def _files(spec: AxisSpec) -> dict[str, str]:
    """Return the files of one axis, by name."""
    axis, board = Axis(spec), Board(spec)
    axi = Board(spec, AxiLink(board.registers))
    facts = "".join(f"    {line}\n" for line in _facts(spec))
    return {
        "axis.v": _source(axis, "axis", "One axis of hardwall, encoder pins to drive: every parameter is a port."),
        "axi.v": _source(axi, "axi", "One supervised axis of hardwall behind an AXI4-Lite bus, for a processor."),
        "board.v": _source(board, "board", "One supervised axis of hardwall behind a dozen pins, with a serial line."),
        "ports.md": (
            f"# Ports\n\nOf the axis\n\n{facts}\n"
            f"A sample every {spec.clocks_per_sample} clocks; the drive changes {axis.latency} clocks after it is "
            f"taken. {FORMATS}\n\n"
            f"## axis.v\n\n{port_table(axis)}\n"
            f"## board.v\n\n{port_table(board)}\n{_line(board)}\n"
            f"## axi.v\n\n{port_table(axi)}\n"
            "The word at the byte address 2 A of the bus has the registers A, in its upper half, and A + 1: a value of "
            "32 bits is one word.\n"
        ),
        **_registers(board.registers),
    }


def _files_of_axes(spec: AxesSpec) -> dict[str, str]:
    """Return the files of several axes, by name."""
    axes, board = Axes(spec), AxesBoard(spec)
    facts = "".join(f"    {line}\n" for line in _facts(spec))
    words = "".join(
        f"| {number} | `{word.name}` | {word.format} | {word.reset} | {word.doc} |\n"
        for number, word in enumerate(spec.design.words)
    )
    several = f"{spec.axes} {'axis' if spec.axes == 1 else 'axes'} of hardwall"
    return {
        "axes.v": _source(axes, "axes", f"{several} in one pipeline, encoder pins to drives."),
        "board.v": _source(board, "board", f"{several}, each supervised, behind their pins, with a serial line."),
        "ports.md": (
            f"# Ports\n\nOf the axes\n\n{facts}\n"
            f"A sample of every axis in each rota of {spec.clocks_per_sample} clocks; its drive changes {axes.latency} "
            f"clocks after it is taken. {FORMATS} A port of one bit for each axis has that of axis i in bit i; a port "
            "of N x a format has the word of axis 0 in the lowest bits.\n\n"
            f"## axes.v\n\n{port_table(axes)}\n"
            "The words that word_number counts:\n\n"
            f"| number | word | format | reset | what it is |\n| --- | --- | --- | --- | --- |\n{words}\n"
            f"## board.v\n\n{port_table(board)}\n{_line(board)}"
        ),
        **_registers(board.registers),
    }


def write(spec: AxisSpec | AxesSpec, folder: Path, beside: Mapping[str, str]) -> tuple[Path, ...]:
    """Write the Verilog, its ports and its registers into `folder`, which is made if it is missing; return the paths.

    Of an axis, `axis.v`, `board.v` and `axi.v` have their ports in `ports.md`; the registers of the last two are in
    `registers.md` and `registers.json`. Of several axes there are `axes.v` and `board.v`, and the same pages of both.
    The text depends only on the spec and on the versions of this project and its Yosys. All files are written, or none.

    Args:
        spec: the axis, or several.
        folder: the folder.
        beside: the texts of further files, by name.

    Raises:
        TypeError: if `spec` is neither an AxisSpec nor an AxesSpec.
        OSError: if a file cannot be written.
    """
    files = {**(_files_of_axes(spec) if isinstance(spec, AxesSpec) else _files(spec)), **beside}
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return write_files(folder, files)
