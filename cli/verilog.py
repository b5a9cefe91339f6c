"""The command `verilog`."""

from pathlib import Path
from typing import Annotated

import typer

from ..model.checks import shown
from ..sim.boards.description import BOARDS
from ..sim.rtl.sources import files_around, write_verilog
from ..sim.scene.load import load
from .board import board_named, boards_beginning, scene_on, spec_on
from .errors import BadInput
from .options import AxesOption, EstimatorOption, SetOption
from .scenes import SceneOrOfBoardArgument, changes_of

DEFAULT = "seed-2011"
"""The scene if none is given, nor a board that has its own."""


def command(
    scene: SceneOrOfBoardArgument = None,
    folder: Annotated[
        str, typer.Option("-o", "--output-folder", metavar="DIR", help="folder for the files; it is made if absent")
    ] = ".",
    board: Annotated[
        str | None,
        typer.Option(
            metavar="BOARD",
            help=f"also write the top module, pins and FuseSoC core for a board: {', '.join(BOARDS)}",
            autocompletion=boards_beginning,
            show_default="none",
        ),
    ] = None,
    estimator: EstimatorOption = None,
    axes: AxesOption = None,
    set_: SetOption = None,
) -> None:
    on = None if board is None else board_named("--board", board)
    changes = changes_of(set_, controller__estimator=estimator)
    spec = spec_on(scene_on(on, changes, scene) if on else load(scene or DEFAULT, changes), axes, on)
    beside = files_around(spec, on) if on else {}
    if not folder:
        raise BadInput("-o must be a folder, not ''")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"-o {shown(folder)} cannot be made: {error.strerror}") from None
    for path in write_verilog(spec, Path(folder), beside):
        print(path)
