"""The commands about stiff walls: which are stable, and what a hit asks of Levant's gains."""

import json
import time
from collections.abc import Iterable
from dataclasses import asdict
from typing import Annotated

import typer

from ..scene.load import load, read
from ..scene.schema import Scene
from .options import (
    Backend,
    BadInput,
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
    show,
    show_table,
)

COLUMNS = {"method": "left"}
COLUMNS |= dict.fromkeys(
    ("area (kN/m N s/m)", "held", "in place", "largest K (kN/m)", "to B (N s/m)", "hits", "s"), "right"
)


def curves_of(wanted: str | None, scene: Scene) -> list:
    """Return the methods of the paper's Figure 5 on a scene, or those that are wanted: of these, or NAME[:OUTPUT]."""
    from ..estimates.accuracy import outputs  # noqa: PLC0415
    from ..walls import methods  # noqa: PLC0415

    papers = methods.methods(scene)
    if wanted is None:
        return list(papers.values())
    curves = []
    try:
        for name in dict.fromkeys(word.strip() for word in wanted.split(",")):
            if name in papers:
                curves.append(papers[name])
            else:
                curves += [methods.Curve(methods.label(*pair), *pair) for pair in outputs(name)]
    except ValueError as error:
        raise BadInput(f"--estimators: {error}, or of {', '.join(papers)}") from None
    return curves


def map_changes(set_: list[str] | None, estimators: str, walls: str = "see the scene's section zwidth") -> dict:
    """Return the changes of a scene that is mapped; `refuse`s methods and walls, for which the reasons are given."""
    changes = scene_changes(set_)
    refuse(changes, ("controller.estimator", "controller.output", "controller.gains"), estimators)
    refuse(changes, ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m"), walls)
    return changes


def refuse(changes: dict, keys: tuple[str, ...], instead: str) -> None:
    """Refuse changes of a scene that the command makes itself."""
    for key in changes:
        if key.startswith(keys):
            raise BadInput(f"--set {key} is what this command sets itself: {instead}")


def area_text(each) -> str:
    """Return the area of a map in kN/m N s/m, with a + where the region leaves the map."""
    return f"{each.area / 1e3:.0f}" + "+" * each.leaves


def explain_areas(maps: Iterable) -> None:
    """Say what the + of `area_text` is, if there was one."""
    if any(each.leaves for each in maps):
        log.print("+: the region goes on beyond the map")


def cluster_of(jobs: int, workers: int | None, scheduler: str | None):
    """Return `cluster.client` as `--workers` or `--scheduler` ask for it."""
    from ..jobs import cluster  # noqa: PLC0415  (Dask is loaded only where it runs)

    if workers and scheduler is not None:
        raise BadInput(f"--scheduler {scheduler} has workers of its own: give it or --workers, not both")
    return cluster.client(jobs, workers, scheduler)


def make_maps(title: str, cases: list, backend: str, workers: int | None, scheduler: str | None, resume: bool) -> list:
    """Return the map of each case, made on the cluster that the options ask for, with a bar of what is done."""
    from ..jobs import store  # noqa: PLC0415  (kernels are loaded only where they run)
    from ..walls import zwidth as maps_of  # noqa: PLC0415

    for case in cases:
        maps_of.grid_of(case.parsed)  # before a cluster is started
    with cluster_of(len(cases), workers, scheduler) as client, progress(title, len(cases)) as advance:
        return maps_of.run(cases, backend, store.Store("zwidth", resume), client, advance)


def zwidth(
    scene: SceneArgument = "seed-2011",
    wanted: Annotated[
        str | None,
        typer.Option(
            "--estimators",
            metavar="NAME[:OUTPUT],...",
            help="of all estimators, or fdm-30, fdm-100, fdm-500, fdm-1000, proposed, adjusted [default: these six]",
        ),
    ] = None,
    backend: Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or RTL")] = "fixed",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Map the walls that are stable: for each estimator, the largest stiffness at every damping."""
    changes = map_changes(set_, "see --estimators")
    loaded = load(scene, changes)
    from ..pictures.zwidth import draw as draw_maps  # noqa: PLC0415
    from ..walls import methods  # noqa: PLC0415  (kernels are loaded only where they run)
    from ..walls import zwidth as maps_of  # noqa: PLC0415
    from ..walls.figure_5 import facts  # noqa: PLC0415

    plot, text = picture_file(plot), read(scene)
    cases = [maps_of.Case(curve.label, scene, text, changes | curve.changes) for curve in curves_of(wanted, loaded)]
    began = time.perf_counter()
    maps = make_maps(f"{loaded.name} Z-width, {backend}", cases, backend, workers, scheduler, resume)
    seconds = time.perf_counter() - began
    shown = facts(dict(zip(methods.methods(), maps, strict=True))) if wanted is None else []
    if as_json:
        hits = sum(each.hits for each in maps)
        report = {"scene": loaded.name, "backend": backend, "hits": hits, "seconds": seconds}
        report |= {"maps": [each.report() for each in maps], "facts": [asdict(fact) for fact in shown]}
        print(json.dumps(report))
    else:
        rows = [
            [
                each.case.label,
                area_text(each),
                "" if each.area_held is None else f"{each.area_held / 1e3:.0f}",
                f"{each.area_in_place / 1e3:.0f}",
                f"{each.largest_n_per_m / 1e3:g}",
                f"{each.damping_n_s_per_m:g}",
                str(each.hits),
                f"{each.seconds:.1f}",
            ]
            for each in maps
        ]
        show_table(COLUMNS, rows)
        explain_areas(maps)
        if shown:
            lines = [[fact.text, "held" if fact.held else "not held", fact.numbers] for fact in shown]
            show_table(dict.fromkeys(("the paper's Figure 5", "here", "numbers"), "left"), lines)
    if plot:
        draw(draw_maps(maps), plot)


def lipschitz(
    scene: SceneArgument = "seed-2011",
    before: Annotated[float, typer.Option(min=0.0, metavar="S", help="of the record, before the contact")] = 0.1,
    after: Annotated[float, typer.Option(min=1e-3, metavar="S", help="and after it")] = 0.4,
    sines: Annotated[int, typer.Option(min=1, max=20, help="how many are fitted")] = 7,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """The bound C on the acceleration, from sines fitted to a hit, and the gains that follow: the paper's Figure 4."""
    changes = scene_changes(set_)
    load(scene, changes)
    refuse(changes, ("controller.estimator", "controller.output", "controller.gains"), "it takes the paper's filter")
    from ..pictures.lipschitz import draw as draw_lipschitz  # noqa: PLC0415
    from ..studies.lipschitz import measure  # noqa: PLC0415  (kernels are loaded only where they run)

    plot = picture_file(plot)
    found = measure(scene, changes, before, after, sines)
    show(found.report(), as_json)
    if plot:
        draw(draw_lipschitz(found), plot)


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    for command in (zwidth, lipschitz):
        app.command()(command)
