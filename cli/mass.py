"""The command `mass`."""

from functools import partial
from typing import Annotated

import typer

from ..model.checks import shown
from ..sim.jobs.store import Store
from ..sim.scene.case import Case
from ..sim.studies import mass
from ..sim.walls.mapping import verdict
from .errors import BadInput
from .options import BackendOption, StartsOption, methods_option, numbers_of
from .rates import RATES
from .scenes import SceneArgument, curves_of, rates_of, refuse, refuse_for_maps
from .study import StudyOptions, study

LEAST = 3.1e-5
"""The least virtual mass beside 0, as a share of the handle's: half an LSB of a word of 16 bits, which holds 0.99."""


@study("workers", "resume", "set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    wanted: Annotated[str | None, methods_option(",".join(mass.METHODS))] = None,
    rates: Annotated[
        str, typer.Option(metavar="HZ,...", help="sample rates beside the scene's own, 1e3 to 1e7 Hz; none: only those")
    ] = "1e5",
    masses: Annotated[
        str | None,
        typer.Option(
            metavar="SHARE,...",
            help=f"virtual masses as shares of the handle's mass: 0, or {LEAST:g} to 0.99 of either sign",
            show_default=",".join(f"{share:g}" for share in mass.SHARES),
        ),
    ] = None,
    walls: Annotated[
        str,
        typer.Option(
            metavar="K:B,...", help="walls by stiffness and damping, N/m and N s/m; a soft one is nearly free space"
        ),
    ] = ",".join(f"{wall.stiffness_n_per_m:g}:{wall.damping_n_s_per_m:g}" for wall in mass.WALLS),
    starts: StartsOption = 5,
    backend: BackendOption = "fixed",
) -> None:
    changes, most = options.changes(), mass.MOST
    refuse_for_maps(changes, "see --estimators")
    refuse(changes, RATES, "see --rates")
    refuse(changes, ("virtual_mass",), "see --masses")
    case = Case.of(scene, changes)
    rates_hz = [] if rates == "none" else sorted(rates_of(rates, "--rates"))
    shares = list(mass.SHARES)
    if masses is not None:
        shares = sorted(numbers_of(masses, "--masses", -most, most, "of the handle's mass"))
        small = next((share for share in shares if 0 < abs(share) < LEAST), None)
        if small is not None:
            raise BadInput(
                f"--masses must be 0, or {LEAST:g} to {most:g} of the handle's mass, of either sign, not {small}"
            )
    settings = mass.settings_of(curves_of(wanted or ",".join(mass.METHODS)), rates_hz, _walls(walls))
    run = partial(options.results, f"{case.scene.name}, virtual masses", verdict, store=Store("zwidth", options.resume))
    results = run(mass.jobs(case, settings, shares, starts, backend))
    options.finish(mass.study(case, settings, shares, starts, results))


def _walls(text: str) -> list[mass.Wall]:
    """Return the walls of a list K:B,..."""
    walls = []
    for word in text.split(","):
        parts = word.split(":")
        if len(parts) != 2:
            raise BadInput(f"--walls must be pairs K:B of N/m and N s/m, not {shown(word)}")
        stiffness, damping = (numbers_of(part, "--walls", 0.0, 1e9, "N/m and N s/m")[0] for part in parts)
        walls.append(mass.Wall(stiffness, damping))
    return list(dict.fromkeys(walls))
