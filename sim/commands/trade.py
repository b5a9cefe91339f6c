"""The command of what a simulation's shortcuts save, and cost in accuracy."""

import json
import time
from collections.abc import Callable, Hashable

import typer

from .options import (
    JsonOption,
    PlotOption,
    ResumeOption,
    SceneArgument,
    SetOption,
    WorkersOption,
    draw,
    log,
    picture_file,
    progress,
    show_table,
)
from .zwidth import make_maps, map_changes, refuse


class _Runs:
    """Runs a study's hits as the options say: see `trade_study.Runs`. What is timed runs alone, in this process."""

    def __init__(self, workers: int | None, resume: bool):
        self._workers, self._resume = workers, resume

    def maps(self, backend: str, cases: list) -> list:
        return make_maps(f"maps, {backend}", cases, backend, self._workers, None, self._resume)

    def verdicts(self, jobs: list[dict]) -> list[dict]:
        from ..jobs import parallel, store  # noqa: PLC0415  (kernels are loaded only where they run)
        from ..walls import zwidth  # noqa: PLC0415  (kernels are loaded only where they run)

        with progress("walls around the edge", len(jobs)) as advance:
            # Many have just been hit for a map.
            return parallel.run(zwidth.verdict, jobs, store.Store("zwidth"), self._workers, advance)

    def medians(self, contestants: dict[Hashable, Callable[[], float]], rounds: int) -> dict[Hashable, float]:
        from ..studies import bench  # noqa: PLC0415

        with progress("times", rounds * len(contestants)) as advance:
            begun = iter(range(rounds * len(contestants)))
            return bench.medians(contestants, rounds, lambda _: advance(next(begun)))


def trade(
    scene: SceneArgument = "drive-2011",
    workers: WorkersOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Speed against accuracy: what a coarser backend, device, rate, solver or map saves, and what it gets wrong."""
    from ..pictures.trade import draw as draw_trade  # noqa: PLC0415
    from ..studies.trade_runs import study  # noqa: PLC0415

    changes, plot = map_changes(set_, "it takes two of the paper's"), picture_file(plot)
    refuse(changes, ("solver",), "it is one of the settings")
    began = time.perf_counter()
    found = study(scene, changes, _Runs(workers, resume))
    if as_json:
        print(json.dumps(found.report() | {"seconds": time.perf_counter() - began}))
    else:
        _show(found)
    if plot:
        draw(draw_trade(found), plot)


def _show(found) -> None:
    from ..studies.trade import HIT, MAP  # noqa: PLC0415  (kernels are loaded only where they run)

    columns = {"setting": "left"} | dict.fromkeys(("hit (ms)", "maps: hits", "s"), "right")
    for label in found.walls:
        columns |= dict.fromkeys((f"{label}: verdicts", f"{label}: K"), "right")
    rows = []
    for point in found.points:
        row = [point.shortcut.label, f"{point.hit_s * 1e3:.1f}", str(point.hits), f"{point.map_s:.1f}"]
        for label, share in point.differ.items():
            best = ["* " * (point in found.best(question, label)) for question in (HIT, MAP)]
            row.append(f"{best[0]}{share:.0%}")
            row.append(best[1] + "{median:.0%} to {largest:.0%}".format(**point.of_stiffness(label)))
        rows.append(row)
    show_table(columns, rows)
    walls = ", ".join(f"{count} walls with {label}" for label, count in found.walls.items())
    log.print(
        f"verdicts: how many differ, of {walls}. K: its error at the edge of the map, median to largest over B. "
        f"*: none faster is as right; what is within the scatter is right. "
        f"rtl: its verdicts are those of fixed, whose force words it had in {found.words_checked} hits"
    )


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    app.command()(trade)
