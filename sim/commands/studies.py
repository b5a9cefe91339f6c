"""The commands of what the founding paper left open: studies of many maps."""

import json
import time
from typing import Annotated, Literal

import typer

from ..scene.load import load, names
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
    rates_of,
    show_table,
)
from .zwidth import area_text, curves_of, explain_areas, make_maps, map_changes, refuse

SEARCHED = "it is what is searched"
BackendOption = Annotated[Literal["float", "fixed"], typer.Option(help="float64 algorithm, or bit-accurate model")]


class Maps:
    """Makes maps as the options say, and knows what they took."""

    def __init__(self, backend: str, workers: int | None, scheduler: str | None, resume: bool):
        self._options = (backend, workers, scheduler, resume)
        self._hits, self._began = 0, time.perf_counter()

    def __call__(self, title: str, cases: list) -> list:
        maps = make_maps(title, cases, *self._options)
        self._hits += sum(each.hits for each in maps)
        return maps

    def report(self) -> dict:
        return {"backend": self._options[0], "hits": self._hits, "seconds": time.perf_counter() - self._began}


def cutoff(
    scenes: Annotated[
        list[str] | None,
        typer.Argument(metavar="SCENE...", help=f"of {', '.join(names())}, or .toml files [default: three devices]"),
    ] = None,
    backend: BackendOption = "fixed",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """The best cutoff of a filter behind a finite difference: the area of the stable region against it."""
    from ..pictures.cutoff import draw as draw_cutoff  # noqa: PLC0415
    from ..studies import cutoff as cutoffs  # noqa: PLC0415  (kernels are loaded only where they run)

    changes, plot = map_changes(set_, SEARCHED), picture_file(plot)
    maps = Maps(backend, workers, scheduler, resume)
    devices = cutoffs.study(list(dict.fromkeys(scenes or cutoffs.SCENES)), changes, maps)
    if as_json:
        print(json.dumps(maps.report() | {"devices": [each.report() for each in devices]}))
    else:
        _show_cutoffs(devices)
    if plot:
        draw(draw_cutoff(devices), plot)


def _show_cutoffs(devices: list) -> None:
    numbers = ("best (Hz)", "its area (kN/m N s/m)", "within 5 %, from (Hz)", "to (Hz)", "no filter: area")
    rows = []
    for each in devices:
        best = f"{each.best_hz:.0f}" + ", at the end" * each.at_end
        low, high = each.level_hz
        rows.append(
            [each.scene.name, best, area_text(each.best), f"{low:.0f}", f"{high:.0f}", area_text(each.unfiltered)]
        )
    show_table({"device": "left"} | dict.fromkeys(numbers, "right"), rows)
    cutoffs = sorted({cutoff_hz for each in devices for cutoff_hz in each.maps})
    areas = [
        [f"{cutoff_hz:g}", *(area_text(each.maps[cutoff_hz]) if cutoff_hz in each.maps else "" for each in devices)]
        for cutoff_hz in cutoffs
    ]
    show_table(dict.fromkeys(("cutoff (Hz)", *(f"{each.scene.name}: area" for each in devices)), "right"), areas)
    explain_areas(found for each in devices for found in (*each.maps.values(), each.unfiltered))


def gains(
    scene: SceneArgument = "seed-2011",
    backend: BackendOption = "fixed",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Levant's gains, searched in full: the area of the stable region over lambda and alpha, for both outputs."""
    from ..pictures.gains import draw as draw_gains  # noqa: PLC0415
    from ..studies import gains as gains_of  # noqa: PLC0415  (kernels are loaded only where they run)

    changes, plot = map_changes(set_, SEARCHED), picture_file(plot)
    maps = Maps(backend, workers, scheduler, resume)
    found = gains_of.study(scene, changes, maps)
    if as_json:
        print(json.dumps(maps.report() | found.report()))
    else:
        _show_gains(found)
    if plot:
        draw(draw_gains(found), plot)


def _show_gains(found) -> None:
    numbers = ("lambda (m^.5/s)", "alpha (m/s^2)", "area (kN/m N s/m)", "of the paper's", "in place")
    rows = []
    for output, picks in found.picks.items():
        for name, pick in picks.items():
            multiple = found.of_papers(pick)
            pair = f"{pick.gains.lambda_sqrt_m_per_s:.4g}", f"{pick.gains.alpha_m_per_s2:.4g}"
            times = "" if multiple is None else f"{multiple:.2f}"
            rows.append([output, name, *pair, area_text(pick.map), times, f"{pick.map.area_in_place / 1e3:.0f}"])
            if found.at_edge(pick.gains):
                log.print(f"{output}, {name}: at the edge of what was tried; better gains may lie beyond")
    show_table({"output": "left", "gains": "left"} | dict.fromkeys(numbers, "right"), rows)
    explain_areas(pick.map for picks in found.picks.values() for pick in picks.values())


def rates(
    scene: SceneArgument = "drive-2011",
    wanted: Annotated[
        str | None, typer.Option("--estimators", metavar="NAME[:OUTPUT],...", help="see zwidth [default: six of all]")
    ] = None,
    tried: Annotated[
        str | None, typer.Option("--rates", metavar="HZ,...", help="ascending [default: 1e3 to 1e6]")
    ] = None,
    backend: BackendOption = "fixed",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    resume: ResumeOption = False,
    set_: SetOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """What rate buys a stiff wall, 1 kHz to 1 MHz, and which part of the device ends it."""
    from ..pictures.rates import draw as draw_rates  # noqa: PLC0415
    from ..studies import rates as studied  # noqa: PLC0415  (kernels are loaded only where they run)

    changes, plot = map_changes(set_, SEARCHED), picture_file(plot)
    refuse(changes, ("controller.sample_hz", "controller.actuation_hz", "controller.clock_hz"), "see --rates")
    rates_hz = sorted(rates_of(tried, "--rates")) if tried else list(studied.RATES_HZ)
    loaded, maps = load(scene, changes), Maps(backend, workers, scheduler, resume)
    limits = studied.linear_limits(scene, changes, rates_hz)
    found = studied.study(scene, changes, curves_of(wanted or ",".join(studied.METHODS), loaded), rates_hz, maps)
    if as_json:
        print(json.dumps(maps.report() | {"methods": [each.report() for each in found], "linear_limits": limits}))
    else:
        _show_rates(found, limits, rates_hz)
    if plot:
        draw(draw_rates(found, limits), plot)


def _show_rates(found: list, limits: dict, rates_hz: list[int]) -> None:
    """Show the largest K (kN/m) by rate."""
    columns = ("the scene's", *(f"{rate / 1e3:g} kHz" for rate in rates_hz), "ratio", "gains up to (kHz)")
    rows = []
    for each in found:
        values = [f"{a_map.largest_n_per_m / 1e3:.0f}" + "+" * a_map.clipped for a_map in (each.own, *each.maps)]
        ratio = "" if each.ratio is None else f"{each.ratio:.2f}"
        ends = "" if each.ends_at_hz is None else f"{each.ends_at_hz / 1e3:g}"
        rows.append([each.label, *values, ratio, ends])
    for left, limit in limits.items():
        rows.append([f"linear: {left}", "", *(f"{value / 1e3:.0f}" for value in limit), "", ""])
    show_table({"largest K (kN/m)": "left"} | dict.fromkeys(columns, "right"), rows)
    if any(each.clipped for gain in found for each in (gain.own, *gain.maps)):
        log.print("+: K goes on beyond the map")


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    for command in (cutoff, gains, rates):
        app.command()(command)
