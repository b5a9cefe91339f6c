"""The command `axes`."""

from dataclasses import replace
from typing import Annotated

import typer

from ..model.axes.axis import AXES_MAX, PIPELINES
from ..model.checks import shown
from ..sim.jobs.store import Store
from ..sim.studies import axes
from .errors import BadInput
from .options import SeedsOption
from .study import StudyOptions, study


@study("plot")
def command(
    options: StudyOptions,
    wanted: Annotated[
        str, typer.Option("--estimators", metavar="NAME,...", help=f"estimators to compare: {', '.join(PIPELINES)}")
    ] = "levant",
    numbers: Annotated[
        str, typer.Option("--axes", metavar="N,...", help=f"numbers of axes, 1 to {AXES_MAX}")
    ] = ",".join(map(str, axes.NUMBERS)),
    bare: Annotated[bool, typer.Option("--bare", help="add the axes without supervisors")] = False,
    seeds: SeedsOption = 1,
) -> None:
    jobs = axes.jobs(_names(wanted), _numbers(numbers), bare, seeds)
    # Placement runs in processes of its own.
    rows = replace(options, workers=1).results(f"axes on {axes.DEVICE}", axes.cost, jobs, Store("axes"))
    options.finish(axes.AxesCosts(rows))


def _names(text: str) -> list[str]:
    """Return the estimators of a list."""
    names = list(dict.fromkeys(word.strip() for word in text.split(",")))
    for name in names:
        if name not in PIPELINES:
            raise BadInput(f"--estimators must be of {', '.join(PIPELINES)}, not {shown(name)}")
    return names


def _numbers(text: str) -> list[int]:
    """Return the numbers of axes of a list, from the least to the most."""
    numbers = set()
    for word in text.split(","):
        number = int(word) if word.strip().isascii() and word.strip().isdigit() and len(word) < 10 else 0
        if not 1 <= number <= AXES_MAX:
            raise BadInput(f"--axes must be whole numbers of 1 to {AXES_MAX}, not {shown(word)}")
        numbers.add(number)
    return sorted(numbers)
