"""The command `zwidth`."""

from typing import Annotated

import typer

from ..scene.case import Case
from ..studies import zwidth
from ..walls.methods import methods
from .maps import Maps
from .options import BackendOption, SceneArgument, curves_of, refuse_for_maps
from .study import StudyOptions, study


@study("workers", "scheduler", "resume", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    wanted: Annotated[
        str | None,
        typer.Option(
            "--estimators",
            metavar="NAME[:OUTPUT],...",
            help="`all`, some of all, or fdm-30, fdm-100, fdm-500, fdm-1000, proposed, adjusted",
            show_default="these six",
        ),
    ] = None,
    backend: BackendOption = "fixed",
) -> None:
    changes = options.changes()
    refuse_for_maps(changes, "see --estimators")
    case = Case.of(scene, changes)
    curves = None if wanted is None else curves_of(wanted, methods(case.scene))
    options.finish(zwidth.study(case, curves, Maps(options, backend)))
