"""The picture of the area of the stable region against the filter's cutoff."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..studies.cutoff import LEVEL, PAPERS_HZ, Cutoffs, Optimum
from .labels import label_points
from .style import COLOURS, LABEL_PT, THEORY, lay_out, new_figure, page

TICKS_HZ = (30, 50, 100, 200, 500, 1000, 2000, 4000)
FILTERED, UNFILTERED = COLOURS["butterworth"], COLOURS["fdm"]


@page
def draw(cutoffs: Cutoffs) -> Figure:
    """Return the picture: one panel a device, with a common axis of cutoffs."""
    optima = cutoffs.optima
    title = "Area of the stable region of walls (K, B) behind a finite difference and a filter"
    picture = new_figure(0.9 + 2.2 * len(optima), title)
    panels = picture.subplots(len(optima), sharex=True, squeeze=False)[:, 0]
    for axes, optimum in zip(panels, optima, strict=True):
        _draw(axes, optimum)
    panels[-1].set_xscale("log")
    panels[-1].set_xticks(TICKS_HZ, [f"{tick_hz}" for tick_hz in TICKS_HZ])
    panels[-1].xaxis.set_minor_formatter(NullFormatter())
    panels[-1].set_xlabel("cutoff of the second-order Butterworth filter (Hz); dotted: the founding paper's")
    picture.align_ylabels(panels)
    lay_out(picture)
    for axes, optimum in zip(panels, optima, strict=True):
        _label(axes, optimum)
    return picture


def _areas(optimum: Optimum) -> dict[float, float]:
    """Return the areas by cutoff, in kN/m N s/m."""
    return {cutoff_hz: a_map.area / 1e3 for cutoff_hz, a_map in optimum.maps.items()}


def _draw(axes: Axes, optimum: Optimum) -> None:
    """Draw the areas of a device, and the best of them."""
    areas, unfiltered = _areas(optimum), optimum.unfiltered.area / 1e3
    for cutoff_hz in PAPERS_HZ:
        axes.axvline(cutoff_hz, color=THEORY, ls=":", lw=0.9)
    axes.axvspan(*optimum.level_hz, color=FILTERED, alpha=0.15, lw=0)
    axes.axhline(unfiltered, color=UNFILTERED, ls="--", lw=1.1)
    axes.plot(list(areas), list(areas.values()), color=FILTERED, marker="o", ms=3.5)
    if leaving := [cutoff_hz for cutoff_hz, each in optimum.maps.items() if each.leaves]:
        style = {"ls": "", "marker": "^", "ms": 7, "mfc": "none", "color": FILTERED}
        axes.plot(leaving, [areas[each] for each in leaving], **style)
    axes.plot(optimum.best_hz, areas[optimum.best_hz], ls="", marker="*", ms=13, color=FILTERED, mec="black")
    axes.set_title(_settings(optimum), fontsize=LABEL_PT)
    axes.set_ylabel("area (kN/m N s/m)")
    axes.set_ylim(0, 1.15 * max(*areas.values(), unfiltered, 1e-3))


def _label(axes: Axes, optimum: Optimum) -> None:
    """Label the best cutoff, the equally good range, the area without a filter, and the first region beyond the map."""
    areas, (low, high) = _areas(optimum), optimum.level_hz
    unfiltered = optimum.unfiltered.area / 1e3
    best = f"best: {optimum.best_hz:.0f} Hz, {areas[optimum.best_hz]:.0f}" + ", at the end" * optimum.at_end
    best += f"\nwithin {LEVEL * 100:g} % of that: {low:.0f} to {high:.0f} Hz"
    level = [(hz, unfiltered) for hz in axes.get_xlim()]
    labels = [
        (best, (optimum.best_hz, areas[optimum.best_hz]), FILTERED),
        (f"no filter: {unfiltered:.0f}", level, UNFILTERED),
    ]
    if leaving := [cutoff_hz for cutoff_hz, each in optimum.maps.items() if each.leaves]:
        labels.append(("and more: the region leaves the map", (leaving[0], areas[leaving[0]]), FILTERED))
    label_points(axes, labels, lines=[list(areas.items())])


def _settings(optimum: Optimum) -> str:
    """Return the title of a panel: the device, and the grid of its maps."""
    handle, controller, grid = optimum.scene.handle, optimum.scene.controller, optimum.scene.zwidth
    friction = f"{handle.coulomb_n:g} N" if handle.coulomb_n else "no"
    return (
        f"{optimum.scene.name}: {handle.mass_kg:g} kg, {friction} dry friction, counts of "
        f"{optimum.scene.encoder.count_m * 1e6:g} µm, samples at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz;\nsteps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, "
        f"{grid.damping_step_n_s_per_m:g} N s/m"
    )
