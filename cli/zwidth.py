"""The command `zwidth`."""

from pathlib import Path
from typing import Annotated

import typer

from ..sim.scene.case import Case
from ..sim.studies import zwidth
from ..sim.walls.mapping import STARTS
from ..sim.walls.methods import methods
from ..sim.walls.worst_variant import HELD_BY
from .maps import mapper_of
from .options import BackendOption, StartsOption, output_file
from .scenes import SceneArgument, curves_of, hands_of, refuse, refuse_for_maps
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
            help="estimators, `all`, or the paper's methods: fdm-30, fdm-100, fdm-500, fdm-1000, proposed, adjusted",
            show_default="these six methods",
        ),
    ] = None,
    starts: StartsOption = STARTS,
    hands: Annotated[
        str | None,
        typer.Option(
            "--hands",
            metavar="NAME,...",
            help=f"map each of these hands on the handle, and the worst case: all, {', '.join(HELD_BY)}",
            show_default="the scene's",
        ),
    ] = None,
    backend: BackendOption = "fixed",
    hits: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="write the verdict of every hit into this .csv")
    ] = None,
) -> None:
    changes = options.changes()
    hits = output_file(hits, "--csv", (".csv",))
    refuse_for_maps(changes, "see --estimators")
    holding = None if hands is None else hands_of(hands)
    if holding is not None:
        refuse(changes, ("hand.",), "see --hands")
    case = Case.of(scene, changes)
    curves = None if wanted is None else curves_of(wanted, methods(case.scene))
    found = zwidth.study(case, curves, holding, mapper_of(options, backend, starts))
    options.finish(found, {"hits": (hits, found.save)} if hits else {})
