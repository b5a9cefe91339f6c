"""The command `verilog`."""

from pathlib import Path
from typing import Annotated

import typer

from ..model.checks import shown
from ..sim.rtl.sources import write_verilog
from ..sim.scene.load import load
from .board import spec_on
from .errors import BadInput
from .options import AxesOption, EstimatorOption, SetOption
from .scenes import SceneArgument, changes_of


def command(
    scene: SceneArgument = "seed-2011",
    folder: Annotated[
        str, typer.Option("-o", "--output-folder", metavar="DIR", help="folder for the files, made if absent")
    ] = ".",
    estimator: EstimatorOption = None,
    axes: AxesOption = None,
    set_: SetOption = None,
) -> None:
    spec = spec_on(load(scene, changes_of(set_, controller__estimator=estimator)), axes)
    if not folder:
        raise BadInput("-o must be a folder, not ''")
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"-o {shown(folder)} cannot be made: {error.strerror}") from None
    for path in write_verilog(spec, Path(folder)):
        print(path)
