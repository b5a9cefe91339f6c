"""The Verilog of an axis, or of several, as files, for use in another tool flow."""

from collections.abc import Mapping
from pathlib import Path

from ...hdl import export
from ...model import register_header
from ...model.axes.axis import AxesSpec
from ...model.axes.registers import AxesMap
from ...model.axis.registers import RegisterMap
from ...model.runtime.input_error import InputError
from ...model.spec import AxisSpec
from ..boards.core import CORE, core
from ..boards.description import Description
from ..boards.top import drive_of_axes, made_for
from .bitstream import pages
from .flow import around

WAIVERS = Path(__file__).with_name("lint.vlt")
"""The style warnings of `verilator -Wall` on the Verilog, and why they are waived."""
VERILOG = {".v", ".sv"}
"""How the names of Verilog end, in small letters."""
LONGEST = 1000
"""The most characters of a file that are read to identify it."""


class OtherTopError(InputError):
    """A folder has the `top` of a board for another clock or another drive; one line that names both."""


def files_around(spec: AxisSpec | AxesSpec, board: Description) -> dict[str, str]:
    """Return what a board needs beside `board.v`, by name: `top`, pins, what to connect to them, a core for FuseSoC.

    Raises:
        FieldError: if the board has no pins for so many axes.
        ClockError: if the board cannot make the clock of the axis.
    """
    if isinstance(spec, AxesSpec):
        board = board.of_axes(spec.axes)
    return {**around(board, spec), **pages(board, spec), CORE: core(board, spec.clock_hz)}


def write_verilog(spec: AxisSpec | AxesSpec, folder: Path, beside: Mapping[str, str]) -> tuple[Path, ...]:
    """Write the Verilog of one axis or several, its ports, its registers and the waivers of its lint; return the paths.

    Args:
        spec: the axis, or several.
        folder: an existing folder.
        beside: the text of further files by name, as `files_around` returns it.

    Raises:
        OtherTopError: if the folder has the `top` of a board for another clock or drive, which this does not replace.
        OSError: if the files cannot be written.
    """
    registers = AxesMap(spec) if isinstance(spec, AxesSpec) else RegisterMap(spec)
    header, waivers = register_header.header(registers), WAIVERS.read_text(encoding="utf-8")
    texts = {"registers.h": header, WAIVERS.name: waivers, **beside}
    _check_tops(folder, spec, set(texts))
    return export.write(spec, folder, texts)


def _check_tops(folder: Path, spec: AxisSpec | AxesSpec, replaced: set[str]) -> None:
    """Raise OtherTopError if a folder keeps a `top` for another clock or drive than `board.v` has."""
    drive = drive_of_axes(spec.axes) if isinstance(spec, AxesSpec) else spec.stage.name
    for path in sorted(path for path in folder.iterdir() if path.suffix.lower() in VERILOG and path.is_file()):
        with path.open(encoding="utf-8", errors="replace") as file:
            found = made_for(file.readline(LONGEST))
        if found and path.name not in replaced and found[1:] != (spec.clock_hz, drive):
            raise OtherTopError(
                f"{path} is the top of {found.board} for a clock of {found.clock_hz} Hz and the drive {found.drive}, "
                f"and the scene has {spec.clock_hz} Hz and {drive}: write each board into a folder of its own, with "
                "--board"
            )
