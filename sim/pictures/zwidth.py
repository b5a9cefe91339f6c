"""The picture of a Z-width map: the stable region of every method, and the limits from theory."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..scene.schema import Scene
from ..studies.zwidth import ZWidth
from ..walls import theory, worst_variant
from ..walls.boundary import Grid
from ..walls.grid import grid_of
from ..walls.zwidth import Map
from .labels import label_points
from .style import BAND, LABEL_PT, THEORY, ink, lay_out, looks, new_figure, page

BORDER = "0.6"
"""The colour of the map's border."""
ROOM = 8
"""The largest number of maps labelled at their lines; more are labelled beside the panel, in order of their areas."""
SEEN = 0.02
"""The share of the panel's height below which a limit is written and not drawn."""


@page
def draw(found: ZWidth) -> Figure:
    """Return the picture of the stiffness up to which a wall is more likely stable than not, against damping."""
    maps = found.maps
    scenes = [each.case.scene for each in maps]
    scene, controller, grid = scenes[0], scenes[0].controller, grid_of(scenes[0])
    through = "" if scene.coupling is None else f" behind {scene.coupling.stiffness_n_per_m / 1e3:g} kN/m"
    title = _message(maps) + (
        f"{scene.name}{through}: samples at {controller.sample_hz / 1e3:g} kHz, "
        f"force at {controller.actuation_hz / 1e3:g} kHz; "
        f"map in steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, {grid.damping_step_n_s_per_m:.3g} N s/m"
    )
    picture = new_figure(5.2, title)
    axes = picture.subplots()
    styles = looks([(scene.controller.estimator, scene.estimator_output) for scene in scenes])
    boundaries = [_until_it_ends(each) for each in maps]
    limits = found.linear_limits
    for each, boundary, limit, style in zip(maps, boundaries, limits, styles, strict=True):
        label = f"{each.case.label}: {each.area / 1e3:.0f}"
        axes.plot(*zip(*boundary, strict=True), label=label, **style | {"ms": 3.5})
        low, high = np.array(each.intervals[: len(boundary)]).T / 1e3
        dampings = [damping for damping, _ in boundary]
        axes.fill_between(dampings, low, high, color=style["color"], alpha=BAND, lw=0)
        if limit and np.isfinite(limit).any():
            axes.plot(grid.dampings, np.array(limit) / 1e3, color=style["color"], ls=":", lw=1.1)
    axes.set_xlabel("damping B of the wall (N s/m)")
    axes.set_ylabel("stiffness K up to which half are stable (kN/m)")
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.08 * axes.get_ylim()[1])
    border = _border(axes, grid)
    starts = maps[0].starts
    notes = [f"band: 95 of 100 draws of the {starts} starts of every wall"] if starts > 1 else []
    drawn = [limit for limit in limits if limit and np.isfinite(limit).any()]
    notes += ["dotted: limit of the linear loop without friction, in the colour of its method"] if drawn else []
    endless = [each.case.label for each, limit in zip(maps, limits, strict=True) if limit and limit not in drawn]
    notes += [f"no limit of the linear loop: {', '.join(endless)}"] if endless else []
    if any(each.leaves for each in maps):
        notes.append("a region whose line meets the right or the upper border of the map (grey) goes on beyond it")
    notes += [
        f"{each.case.label}: {worst_variant.told(each.variants, each.boundary)} N s/m" for each in maps if each.variants
    ]
    if scene.coupling is None:
        notes += _passive(axes, scene, grid.dampings)
    picture.supxlabel("\n".join(notes), x=0.01, ha="left", fontsize=LABEL_PT, color=THEORY)
    if len(maps) > ROOM:
        _name_beside(axes, maps)
    else:
        inks = [ink(own.controller.estimator) for own in scenes]
        labels = [(each.case.label, *where) for each, *where in zip(maps, boundaries, inks, strict=True)]
        dotted = [
            [(damping, most / 1e3) for damping, most in zip(grid.dampings, limit, strict=True) if np.isfinite(most)]
            for limit in drawn
        ]
        lay_out(picture)
        label_points(axes, labels, lines=[*dotted, border])
    return picture


def _message(maps: Sequence[Map]) -> str:
    """Return which of several methods has the largest region, how much larger than the next, as a line of the title."""
    if len(maps) == 1 or maps[0].variants:
        return ""
    largest, next_one = sorted(maps, key=lambda each: each.area)[:-3:-1]
    if not next_one.area:
        return f"Only {largest.case.label} has stable walls\n"
    times = f"{largest.area / next_one.area:.2f} times that of {next_one.case.label}"
    return f"{largest.case.label} has the largest region of stable walls: {times}\n"


def _until_it_ends(each: Map) -> list[tuple[float, float]]:
    """Return the boundary as (B, K in kN/m), to the first B behind the last stable wall."""
    points = [(point.damping_n_s_per_m, point.stable_n_per_m / 1e3) for point in each.boundary]
    stable = [number for number, (_, stiffness) in enumerate(points) if stiffness]
    return points[: max(stable, default=0) + 2]


def _border(axes: Axes, grid: Grid) -> list[tuple[float, float]]:
    """Draw the upper and the right border of the map, as far as the panel shows them; return their corners."""
    first, last, top = grid.dampings[0], grid.dampings[-1], grid.rows * grid.stiffness_step_n_per_m / 1e3
    corners = [(first, top), (last, top), (last, 0.0)]
    axes.plot(*zip(*corners, strict=True), color=BORDER, lw=0.8, zorder=1.5)
    return corners


def _passive(axes: Axes, scene: Scene, dampings: list[float]) -> list[str]:
    """Draw the passivity limits if they are high enough to be seen; return a description of them."""
    colgate = np.array([theory.colgate_schenkel_n_per_m(scene, damping) for damping in dampings]) / 1e3
    abbott = theory.abbott_okamura_n_per_m(scene) / 1e3
    top = axes.get_ylim()[1]
    passive = np.flatnonzero(colgate > 0)
    if not len(passive):
        own = scene.handle.viscous_n_s_per_m
        what = "none on this map" + f", for each B is more than the handle's own {own:g} N s/m" * (dampings[0] > own)
    elif colgate.max() < SEEN * top:
        last = dampings[passive[-1]]
        what = f"up to {colgate.max():.2g} kN/m and {last:g} N s/m, too low to be seen"
    else:
        axes.plot(dampings, colgate, color=THEORY, ls="-.", lw=1.3)
        what = f"below the dash-dotted line, up to {colgate.max():.3g} kN/m"
    if abbott >= SEEN * top:
        axes.plot([0], [abbott], "_", color=THEORY, ms=14, mew=2, clip_on=False)
    shown = ", the mark on the axis" if abbott >= SEEN * top else ", too low to be seen"
    return [
        f"passive walls (Colgate, Schenkel): {what}",
        f"passive without damping (Abbott, Okamura): up to {abbott:.3g} kN/m{shown}",
    ]


def _name_beside(axes: Axes, maps: Sequence[Map]) -> None:
    """Write the names of many maps beside the panel, with their areas, the largest first."""
    handles, labels = axes.get_legend_handles_labels()
    order = sorted(range(len(maps)), key=lambda index: -maps[index].area)
    axes.legend(
        [handles[index] for index in order],
        [labels[index] for index in order],
        loc="upper left",
        bbox_to_anchor=(1.0, 1.02),
        title="area (kN/m N s/m)",
        title_fontsize=LABEL_PT,
        frameon=False,
        fontsize=LABEL_PT,
    )
