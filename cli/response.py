"""The command `response`."""

from functools import partial
from typing import Annotated

import typer

from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.studies import response
from ..sim.walls.mapping import STARTS
from ..sim.walls.methods import methods
from .errors import BadInput
from .options import BackendOption, methods_option, numbers_of
from .scenes import SceneArgument, curves_of, refuse
from .study import StudyOptions, study

FREQUENCIES_HZ = 1e-3, 1e7
"""The lowest and the highest frequency that is accepted before the scene's rate is known."""


@study("workers", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    wanted: Annotated[str | None, methods_option(",".join(response.METHODS))] = None,
    frequencies: Annotated[str, typer.Option(metavar="HZ,...", help="frequencies of the sine")] = "20,70,200",
    amplitudes: Annotated[
        str, typer.Option(metavar="COUNTS,...", help="amplitudes of the sine, 0.5 to 1e5 counts")
    ] = "1,2,5,10,20,50,100,200",
    starts: Annotated[
        int, typer.Option(min=1, max=1000, metavar="N", help="places in a count and phases of the sine for each row")
    ] = STARTS,
    backend: BackendOption = "fixed",
) -> None:
    changes = options.changes()
    refuse(changes, ("controller.estimator", "controller.output"), "see --estimators")
    at_hz = sorted(numbers_of(frequencies, "--frequencies", *FREQUENCIES_HZ, "Hz"))
    counts = sorted(numbers_of(amplitudes, "--amplitudes", *response.AMPLITUDES, "counts"))
    case = Case.of(scene, changes)
    curves = curves_of(",".join(response.METHODS) if wanted is None else wanted, methods(case.scene))
    try:
        response.check(case, at_hz, counts)
    except ValueError as error:
        raise BadInput(str(error)) from None
    every = response.cases(case, curves)
    run = partial(options.results, "response", response.respond, store=Store("response"))
    rows = run(response.jobs(every, at_hz, counts, starts, backend))
    options.finish(response.Responses(rows, case.scene.name))
