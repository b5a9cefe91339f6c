"""The command `board`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..model.axes.axis import AxesSpec
from ..model.checks import FieldError, shown
from ..model.runtime.result import Values
from ..model.spec import AxisSpec
from ..sim.boards.description import BOARDS, Description, Memory
from ..sim.jobs.named_folder import foreign
from ..sim.rtl.bitstream import Order, build
from ..sim.rtl.loader import load as load_into
from ..sim.scene.load import load
from ..sim.scene.schema import Scene
from ..sim.scene.several import ABSENT
from .errors import BadInput, one_line
from .options import AxesOption, EstimatorOption
from .scenes import SceneOfBoardArgument
from .study import StudyOptions, study
from .terminal import log


def boards_beginning(incomplete: str) -> list[str]:
    """Return the boards whose names begin so, for the completion of a shell."""
    return [name for name in BOARDS if name.startswith(incomplete)]


@study("set_")
def command(
    options: StudyOptions,
    board: Annotated[
        str, typer.Argument(metavar="BOARD", help=f"the board: {', '.join(BOARDS)}", autocompletion=boards_beginning)
    ],
    folder: Annotated[
        str,
        typer.Option(
            "-o", "--output-folder", metavar="DIR", help="folder for the files: new, empty, or written by this command"
        ),
    ],
    scene: SceneOfBoardArgument = None,
    estimator: EstimatorOption = None,
    axes: AxesOption = None,
    seeds: Annotated[
        int,
        typer.Option(
            min=1, max=99, help="largest number of placements to try; the first that reaches the clock rate is taken"
        ),
    ] = 5,
    program: Annotated[
        Memory | None, typer.Option(help="load the bitstream into this memory of the connected board")
    ] = None,
) -> None:
    on = board_named("board", board)
    if program and program not in on.loads:
        raise BadInput(f"--program must be one of {', '.join(on.loads)} for {on.name}, not {program!r}")
    of = scene_on(on, options.changes(controller__estimator=estimator), scene)
    path = _free(folder)
    order = Order(on, of.name, spec_on(of, axes, on), of.glitch_clocks, seeds)
    with log.status(f"{on.name}: Yosys, then nextpnr until a seed reaches {of.spec.clock_hz / 1e6:g} MHz"):
        report = build(order, path)
    options.finish(Values(report))
    said = f"{report['fmax_mhz']:.2f} MHz for a clock of {report['clock_mhz']:g} MHz"
    log.print(one_line(f"bitstream: {path / report['bitstream']}, {said}"), soft_wrap=True)
    if program:
        with log.status(f"loading {on.name}"):
            load_into(on, path / report["bitstream"], program, report["sha256"])


def board_named(option: str, name: str) -> Description:
    """Return the board with the name that an option or an argument has."""
    if name not in BOARDS:
        raise BadInput(f"{option} must be one of {', '.join(BOARDS)}, not {shown(name)}")
    return BOARDS[name]


def scene_on(board: Description, changes: dict[str, Any], scene: str | None) -> Scene:
    """Return the scene for a board: the given one, or the board's own, at a clock that the board can make."""
    return load(scene, changes) if scene is not None else load(board.scene, board.changes | changes)


def spec_on(scene: Scene, axes: int | None, board: Description | None) -> AxisSpec | AxesSpec:
    """Return the axis of a scene, or several with its requirements, each with the pulses that a board gives it.

    Raises:
        BadInput: if the scene has a part that no axis of several has, or the board has no pins for so many.
        FieldError: if the axes cannot be.
    """
    if axes is None:
        return scene.spec
    for section, why in ABSENT.items():
        # A map is no part of the hardware.
        if section != "zwidth" and getattr(scene, section) is not None:
            raise BadInput(f"--axes must be absent for a scene with [{section}], not {axes}: {why}")
    try:
        if board:
            board.of_axes(axes)
    except FieldError as error:
        raise BadInput(f"--{error}") from None
    return AxesSpec(axes=axes, **scene.requirements)


def _free(folder: str) -> Path:
    """Return the path of the folder for the files; raise BadInput if it may not be written."""
    if not folder:
        raise BadInput("-o must be a folder, not ''")
    path = Path(folder)
    try:
        if path.resolve() in (Path.cwd(), *Path.cwd().parents):
            raise BadInput(f"-o must be another folder than the current one and those above it, not {shown(folder)}")
        found = foreign(path)
        above = next(each for each in path.absolute().parents if each.exists())
        if not above.is_dir():
            raise NotADirectoryError(20, "Not a directory")
    except OSError as error:
        raise BadInput(f"-o {shown(folder)} cannot be written: {error.strerror}") from None
    if found is not None:
        accepted = "a folder that is new, empty, or as this command wrote it"
        raise BadInput(f"-o must be {accepted}, and {shown(folder)} has {shown(found)}")
    return path
