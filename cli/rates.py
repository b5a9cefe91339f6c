"""The command `rates`."""

from typing import Annotated

import typer

from ..sim.scene.case import Case
from ..sim.studies import rates
from ..sim.walls.methods import methods
from .maps import mapper_of
from .options import ModelOption, StartsOption, methods_option
from .scenes import SceneArgument, curves_of, rates_of, refuse, refuse_for_maps
from .study import StudyOptions, study

RATES = ("controller.sample_hz", "controller.actuation_hz", "controller.clock_hz")


@study("workers", "scheduler", "resume", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "drive-2011",
    wanted: Annotated[str | None, methods_option(",".join(rates.METHODS))] = None,
    tried: Annotated[
        str | None,
        typer.Option(
            "--rates",
            metavar="HZ,...",
            help="sample rates, 1e3 to 1e7 Hz",
            show_default=",".join(f"{rate:g}" for rate in rates.RATES_HZ),
        ),
    ] = None,
    starts: StartsOption = 3,
    backend: ModelOption = "fixed",
) -> None:
    changes = options.changes()
    refuse_for_maps(changes, "it searches them")
    refuse(changes, RATES, "see --rates")
    rates_hz = sorted(rates_of(tried, "--rates")) if tried is not None else list(rates.RATES_HZ)
    case = Case.of(scene, changes)
    curves = curves_of(",".join(rates.METHODS) if wanted is None else wanted, methods(case.scene))
    options.finish(rates.study(case, curves, rates_hz, mapper_of(options, backend, starts)))
