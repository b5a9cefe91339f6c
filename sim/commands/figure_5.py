"""The commands about the founding paper's Figure 5: why a region ends in a drop, and the device that was not given."""

import json
import time
from typing import Annotated, Literal

import typer

from ..scene.load import load
from .options import (
    JsonOption,
    PlotOption,
    ResumeOption,
    SceneArgument,
    SchedulerOption,
    SetOption,
    WorkersOption,
    draw,
    log,
    picture_file,
    progress,
    scene_changes,
    show_table,
)
from .studies import BackendOption, Maps
from .zwidth import cluster_of, refuse

ReadingOption = Annotated[
    Literal["3-30", "30-300"] | None,
    typer.Option("--axis", metavar="B", help="of the paper's B axis, N s/m: 3-30 or 30-300 [default: both]"),
]


def _changes(set_: list[str] | None) -> dict:
    """Return the changes of a scene; bad input for those that the commands make themselves."""
    changes = scene_changes(set_)
    refuse(changes, ("controller.estimator", "controller.output"), "it compares methods")
    refuse(changes, ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m"), "it hits many walls")
    return changes


def drop(
    scene: SceneArgument = "seed-2011",
    backend: BackendOption = "fixed",
    workers: WorkersOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Why Levant's stable region ends at one damping, in a sharp drop; and estimators that have none."""
    from ..jobs import parallel, store  # noqa: PLC0415
    from ..pictures.drop import draw as draw_drop  # noqa: PLC0415
    from ..studies import drop as studied  # noqa: PLC0415  (kernels are loaded only where they run)

    changes, plot = _changes(set_), picture_file(plot)
    load(scene, changes)
    maps, known = Maps(backend, workers, None, resume), store.Store("drop", resume)

    def striking(title: str, jobs: list[dict]) -> list[dict]:
        with progress(title, len(jobs)) as advance:
            return parallel.run(studied.strike, jobs, known, workers, advance)

    found = studied.study(scene, changes, backend, striking, maps)
    if as_json:
        print(json.dumps(maps.report() | found.report()))
    else:
        _show_drop(found)
    if plot:
        draw(draw_drop(found), plot)


def _show_drop(found) -> None:
    chatter = {"method": "left", "changed": "left"}
    chatter |= dict.fromkeys(("swing at rest (mm/s)", "mean", "rests to B: predicted", "measured"), "right")
    rows = []
    for each in found.laws:
        own = found.chatters[each.method]
        ends = f"{own.swing_m_per_s.max() * 1e3:.2f}", f"{abs(own.mean_m_per_s).max() * 1e3:.2f}"
        rests = f"{each.predicted_n_s_per_m:.3g}", f"{each.measured_n_s_per_m:.3g}"
        plain = each.factor == "none"
        rows.append(
            [each.method, "" if plain else f"{each.factor} {each.value}", *(ends if plain else ("", "")), *rests]
        )
    show_table(chatter, rows)
    _show_ends(found)
    ratios = ", ".join(f"{each:.2f}" for each in found.agreement())
    log.print(f"measured over predicted, least, quartiles and most: {ratios}")
    columns = (
        "area (kN/m N s/m)",
        "of the paper's best",
        "in place",
        "to B (N s/m)",
        "K near its end / largest",
    )
    rows = []
    for name, each in found.maps.items():
        times, before = found.of_papers(name), found.before_the_end(name)
        areas = f"{each.area / 1e3:.0f}", "" if times is None else f"{times:.2f}", f"{each.area_in_place / 1e3:.0f}"
        end = f"{each.damping_n_s_per_m:g}", "" if before is None else f"{before:.2f}"
        rows.append([each.case.label, *areas, *end])
    show_table({"method": "left"} | dict.fromkeys(columns, "right"), rows)


def _show_ends(found) -> None:
    numbers = ("K (kN/m)", "rests to B (N s/m)", "stable to B (N s/m)")
    rows = [
        [
            each.method,
            f"{each.stiffness_n_per_m / 1e3:g}",
            f"{each.rests_n_s_per_m:.3g}",
            f"{each.stable_n_s_per_m:.3g}",
        ]
        for each in found.ends
    ]
    show_table({"method": "left"} | dict.fromkeys(numbers, "right"), rows)


def fit(
    scene: SceneArgument = "seed-2011",
    reading: ReadingOption = None,
    evaluations: Annotated[int, typer.Option(min=1, help="of a search, about so many")] = 576,
    seed: Annotated[int, typer.Option(min=0, help="of a search")] = 1,
    backend: BackendOption = "fixed",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Search what the paper does not give (mass, friction, delay ...) for a device that shows its Figure 5."""
    from ..jobs import store  # noqa: PLC0415  (kernels are loaded only where they run)
    from ..studies import fit as studied  # noqa: PLC0415
    from ..walls import zwidth  # noqa: PLC0415  (kernels are loaded only where they run)
    from ..walls.methods import methods  # noqa: PLC0415

    changes = _changes(set_)
    refuse(changes, ("zwidth",), "its maps go a little beyond the paper's axes")
    loaded, known, fits = load(scene, changes), store.Store("fit", resume), []
    began = time.perf_counter()
    with cluster_of(len(methods()), workers, scheduler) as client:

        def mapping(_: str, cases: list) -> list:
            return zwidth.run(cases, backend, known, client)

        for each in [reading] if reading else studied.READINGS:
            with progress(f"{loaded.name}, B axis {each}", evaluations) as advance:
                fits.append(studied.study(scene, changes, each, evaluations, seed, mapping, advance))
    seconds = time.perf_counter() - began
    if as_json:
        report = {"scene": loaded.name, "backend": backend, "seed": seed, "seconds": seconds}
        print(json.dumps(report | {"fits": [each.report() for each in fits]}))
        return
    for each in fits:
        _show_fit(each)
    log.print(f"{sum(len(each.trials) for each in fits)} evaluations, {seconds:.0f} s")


def _show_fit(found) -> None:
    best = found.finalists[0]
    rows = [[key, f"{found.own[key]:g}", f"{value:g}"] for key, value in best.values.items()]
    show_table({f"B axis {found.reading}": "left", "before": "right", "fitted": "right"}, rows)
    least = found.least_shortfalls()
    rows = [
        [before.text, _held(before), _held(after), after.numbers, "" if lack is None else f"{lack:.3f}"]
        for before, after, lack in zip(found.before.facts, best.facts, least, strict=True)
    ]
    columns = (f"the paper's Figure 5: {best.held} of {len(rows)}", "before", "fitted", "numbers")
    show_table(dict.fromkeys(columns, "left") | {"least, others held": "right"}, rows)


def _held(fact) -> str:
    return "held" if fact.held else f"short by {fact.shortfall:.3f}"


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    for command in (drop, fit):
        app.command()(command)
