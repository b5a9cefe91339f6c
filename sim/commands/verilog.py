"""The command `verilog`."""

from pathlib import Path
from typing import Annotated

import typer

from ..rtl.sources import write_verilog
from ..scene.case import Case
from .errors import BadInput
from .options import EstimatorOption, SceneArgument, SetOption, changes_of


def command(
    scene: SceneArgument = "seed-2011",
    folder: Annotated[Path, typer.Option("-o", "--output-folder", metavar="DIR", help="made if absent")] = Path("."),
    estimator: EstimatorOption = None,
    set_: SetOption = None,
) -> None:
    spec = Case.of(scene, changes_of(set_, controller__estimator=estimator)).scene.spec
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"-o {str(folder)!r} cannot be made: {error.strerror}") from None
    for path in write_verilog(spec, folder):
        print(path)
