"""The command `lipschitz`."""

from typing import Annotated

import typer

from ..sim.scene.case import Case
from ..sim.studies import lipschitz
from .options import within
from .scenes import GAINS, SceneArgument, refuse
from .study import StudyOptions, study

RECORD_MAX_S = 1e6
"""The longest record on either side of the contact, s: as long as the longest protocol."""


@study("set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    before: Annotated[
        float, typer.Option(metavar="S", help="length of the record before the contact, 0 to 1e6 s")
    ] = 0.1,
    after: Annotated[
        float, typer.Option(metavar="S", help="length of the record after the contact, 1e-3 to 1e6 s")
    ] = 0.4,
    sines: Annotated[int, typer.Option(min=1, max=20, help="number of sines to fit")] = 7,
) -> None:
    within(before, "--before", 0.0, RECORD_MAX_S, "s")
    within(after, "--after", 1e-3, RECORD_MAX_S, "s")
    case = Case.of(scene, options.changes())
    refuse(case.changes, GAINS, "it takes the paper's filter")
    options.finish(lipschitz.study(case, before, after, sines))
