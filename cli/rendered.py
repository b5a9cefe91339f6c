"""The command `rendered`."""

from functools import partial
from typing import Annotated, Any

import typer

from ..sim.estimates.moved_handle import MotionError
from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.studies import rendered
from ..sim.walls.methods import methods
from .errors import BadInput
from .options import BackendOption, StartsOption, methods_option, numbers_of, within
from .scenes import SceneArgument, curves_of, rates_of, refuse
from .study import StudyOptions, study

FREQUENCIES_HZ, SPEEDS_MM_PER_S, AMPLITUDES_MM, WINDOWS_MS = (1, 10_000), (0.1, 10_000.0), (1e-6, 100.0), (0.01, 100.0)
MOST = 100
"""The most frequencies, and speeds, of a call."""
METHODS = "controller.estimator", "controller.output"


@study("workers", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    wanted: Annotated[str | None, methods_option(",".join(rendered.METHODS))] = None,
    tried: Annotated[
        str | None,
        typer.Option(
            "--rates",
            metavar="HZ,...",
            help="sample rates besides the scene's, 1e3 to 1e7 Hz",
            show_default="1e3,1e4,1e6",
        ),
    ] = None,
    frequencies: Annotated[
        str,
        typer.Option(metavar="HZ,...", help="frequencies of the handle's motion inside the wall, 1 to 10000, whole Hz"),
    ] = ",".join(map(str, rendered.FREQUENCIES_HZ)),
    amplitude: Annotated[
        float, typer.Option(metavar="MM", help="amplitude of the handle's motion, 1e-6 to 100 mm")
    ] = rendered.AMPLITUDE_MM,
    speeds: Annotated[
        str, typer.Option(metavar="MM_PER_S,...", help="speeds at which the handle meets the wall, 0.1 to 10000 mm/s")
    ] = ",".join(f"{speed:g}" for speed in rendered.SPEEDS_MM_PER_S),
    window: Annotated[
        float,
        typer.Option(
            metavar="MS", help="time after the contact in which the rate of the force is taken, 0.01 to 100 ms"
        ),
    ] = rendered.WINDOW_MS,
    starts: StartsOption = rendered.STARTS,
    backend: BackendOption = "fixed",
) -> None:
    changes = options.changes()
    refuse(changes, METHODS, "see --estimators")
    moving = rendered.Moving(
        [round(each) for each in _few(frequencies, "--frequencies", *FREQUENCIES_HZ, "Hz", whole=True)],
        within(amplitude, "--amplitude", *AMPLITUDES_MM, "mm") / 1e3,
        [each / 1e3 for each in _few(speeds, "--speeds", *SPEEDS_MM_PER_S, "mm/s")],
        within(window, "--window", *WINDOWS_MS, "ms") / 1e3,
    )
    rates_hz = sorted(rates_of(tried, "--rates")) if tried is not None else list(rendered.RATES_HZ)
    case = Case.of(scene, changes)
    curves = curves_of(",".join(rendered.METHODS) if wanted is None else wanted, methods(case.scene))
    run = partial(options.results, store=Store("rendered"))
    try:
        result = rendered.study(case, curves, rates_hz, moving, backend, starts, run)
    except MotionError as error:
        raise BadInput(str(error)) from None
    options.finish(result)


def _few(text: str, option: str, *limits: Any, whole: bool = False) -> list[float]:
    """Return the numbers of a list given with an option, ascending; raise BadInput if there are too many."""
    numbers = sorted(numbers_of(text, option, *limits, whole=whole))
    if len(numbers) > MOST:
        raise BadInput(f"{option} must be at most {MOST} numbers, not {len(numbers)}")
    return numbers
