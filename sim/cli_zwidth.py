"""The commands about stiff walls: which are stable, and what a hit asks of Levant's gains."""

import json
import time
from dataclasses import asdict
from typing import Annotated

import typer

from .scene import SceneError, load, read
from .terminal import (
    Backend,
    BadInput,
    JsonOption,
    PlotOption,
    SceneArgument,
    SetOption,
    log,
    output_file,
    progress,
    scene_changes,
    show,
    show_table,
)

COLUMNS = {"method": "left"}
COLUMNS |= dict.fromkeys(("area (kN/m N s/m)", "largest K (kN/m)", "to B (N s/m)", "leaves the map", "hits"), "right")


def _curves(wanted: str | None) -> list:
    """Return the methods of the paper's Figure 5, or those that are wanted: of these, or NAME[:OUTPUT]."""
    from . import figures  # noqa: PLC0415
    from .accuracy import outputs  # noqa: PLC0415

    papers = figures.methods()
    if wanted is None:
        return list(papers.values())
    curves = []
    try:
        for name in dict.fromkeys(word.strip() for word in wanted.split(",")):
            if name in papers:
                curves.append(papers[name])
            else:
                curves += [figures.Curve(figures.label(*pair), *pair) for pair in outputs(name)]
    except ValueError as error:
        raise BadInput(f"--estimators: {error}, or of {', '.join(papers)}") from None
    return curves


def _refuse(changes: dict, keys: tuple[str, ...], instead: str) -> None:
    """Refuse changes of a scene that the command makes itself."""
    for key in changes:
        if key.startswith(keys):
            raise BadInput(f"--set {key} is what this command sets itself: {instead}")


def _limits(scene: str, changes: dict, maps: list, dampings: list[float]) -> list[list[float] | None]:
    """Return the linear loop's limits at every B, for the methods that are linear."""
    from . import theory  # noqa: PLC0415
    from .zwidth import changes_of  # noqa: PLC0415

    limits = []
    for each in maps:
        limit = None
        if each.curve.estimator in theory.LINEAR:
            loop = theory.Loop(load(scene, changes | changes_of(each.curve)))
            limit = [theory.linear_limit_n_per_m(loop, damping) for damping in dampings]
        limits.append(limit)
    return limits


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
    workers: Annotated[int | None, typer.Option(min=1, help="processes [default: one a core]")] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="of a Dask cluster that runs, in place of workers of its own")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="go on where an interrupted run was")] = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Map the walls that are stable: for each estimator, the largest stiffness at every damping."""
    changes = scene_changes(set_)
    loaded = load(scene, changes)
    from . import cluster, figures  # noqa: PLC0415  (kernels are loaded only where they run)
    from . import zwidth as maps_of  # noqa: PLC0415
    from .figure_5 import facts  # noqa: PLC0415
    from .plot_accuracy import SUFFIXES, save  # noqa: PLC0415
    from .plot_zwidth import plot_zwidth  # noqa: PLC0415
    from .store import Store, sources  # noqa: PLC0415

    _refuse(changes, ("controller.estimator", "controller.output", "controller.gains"), "see --estimators")
    _refuse(changes, ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m"), "see the scene's section zwidth")
    if workers and scheduler:
        raise BadInput(f"--scheduler {scheduler} has workers of its own: give it or --workers, not both")
    try:
        grid = maps_of.grid_of(loaded)
    except ValueError as error:
        raise SceneError(str(error)) from None
    plot, curves = output_file(plot, "--plot", SUFFIXES), _curves(wanted)
    for curve in curves:
        load(scene, changes | maps_of.changes_of(curve))
    common = {"scene": scene, "text": read(scene), "sources": sources(), "changes": changes, "backend": backend}
    began = time.perf_counter()
    total = len(curves) * len(grid.dampings)
    title, workers_of = f"{loaded.name} Z-width, {backend}", cluster.client(len(curves), workers, scheduler)
    with progress(title, total) as advance, workers_of as client:

        def columns_done(dampings: list[float | None]) -> None:
            advance(sum(len(grid.dampings) if b is None else grid.dampings.index(b) for b in dampings))

        maps = maps_of.run(curves, grid, common, Store("zwidth", resume), client, columns_done)
    seconds = time.perf_counter() - began
    shown = facts(dict(zip(figures.methods(), maps, strict=True))) if wanted is None else []
    if as_json:
        hits = sum(each.hits for each in maps)
        report = {"scene": loaded.name, "backend": backend, "hits": hits, "seconds": seconds}
        report |= {"maps": [each.report() for each in maps], "facts": [asdict(fact) for fact in shown]}
        print(json.dumps(report))
    else:
        rows = [
            [
                each.curve.label,
                f"{each.area / 1e3:.1f}",
                f"{each.largest_n_per_m / 1e3:g}",
                f"{each.damping_n_s_per_m:g}",
                "yes" if each.leaves else "no",
                str(each.hits),
            ]
            for each in maps
        ]
        show_table(COLUMNS, rows)
        if shown:
            lines = [[fact.text, "held" if fact.held else "not held", fact.numbers] for fact in shown]
            show_table(dict.fromkeys(("the paper's Figure 5", "here", "numbers"), "left"), lines)
    if plot:
        limits = _limits(scene, changes, maps, grid.dampings)
        save(plot_zwidth(maps, limits, loaded, grid, backend), plot)
        log.print(f"picture: {plot}")


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
    _refuse(changes, ("controller.estimator", "controller.output", "controller.gains"), "it takes the paper's filter")
    from .lipschitz import measure  # noqa: PLC0415  (kernels are loaded only where they run)
    from .plot_accuracy import SUFFIXES, save  # noqa: PLC0415
    from .plot_lipschitz import plot_lipschitz  # noqa: PLC0415

    plot = output_file(plot, "--plot", SUFFIXES)
    found = measure(scene, changes, before, after, sines)
    show(found.report(), as_json)
    if plot:
        save(plot_lipschitz(found), plot)
        log.print(f"picture: {plot}")


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    for command in (zwidth, lipschitz):
        app.command()(command)
