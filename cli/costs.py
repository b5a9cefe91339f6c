"""The command `costs`."""

from dataclasses import replace
from typing import Annotated

import typer

from ..sim.jobs.store import Store
from ..sim.studies import costs
from .options import EstimatorsOption, SeedsOption
from .scenes import PartName, curves_of
from .study import StudyOptions, study


@study("plot")
def command(
    options: StudyOptions,
    wanted: EstimatorsOption = None,
    device: Annotated[PartName | None, typer.Option(help="FPGA to place and route for", show_default="each")] = None,
    seeds: SeedsOption = 3,
) -> None:
    names = list(dict.fromkeys(curve.estimator for curve in curves_of(wanted)))
    rows = [row for part in ([device] if device else costs.DEVICES) for row in costs_of(options, names, part, seeds)]
    options.finish(costs.Costs(rows))


def costs_of(options: StudyOptions, names: list[str], device: str, seeds: int) -> list[dict]:
    """Return the costs of estimators on a part, one after the other: placement runs in processes of its own."""
    alone = replace(options, workers=1)
    return alone.results(f"costs on {device}", costs.cost, costs.jobs(names, device, seeds), Store("costs"))
