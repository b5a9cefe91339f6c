"""The picture of why a stable region ends in a drop."""

import math

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.drop import PAPERS, STIFFNESS_N_PER_M, Drop
from ..walls.case import grid_of
from .style import MARKERS

LEAST_M = 1e-9
"""What is less is drawn as this: an axis of decades has no zero."""
FLED_M = 0.1
"""A handle that fled the encoder is drawn here."""
STABLE = {"color": "0.4", "marker": "o", "ls": "", "mfc": "none"}
RESTS = {"color": "0.4", "marker": "x", "ls": ""}
OUTSIDE = ("mass", "count", "delay", "stiffness")
"""What was changed that is not in the law."""


def plot_drop(found: Drop, backend: str) -> Figure:
    """Return the picture: on the left what shakes a handle at rest, on the right the law, and the maps.

    Args:
        found: what `drop.study` gave.
        backend: that it was made on.
    """
    picture = Figure(figsize=(14, 11), layout="constrained")
    (position, law), (ends, maps) = picture.subplots(2, 2)
    colours = {name: mpl.colormaps["tab10"](index) for index, name in enumerate(found.chatters)}
    _draw_shaken(position, found, colours)
    _draw_ends(ends, found, colours)
    _draw_laws(law, found, colours)
    _draw_maps(maps, found, colours)
    controller = found.scene.controller
    picture.suptitle(
        f"{found.scene.name}, {backend}: estimators at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; Coulomb friction {found.scene.handle.coulomb_n:g} N, "
        f"push {found.scene.protocol.push_n:g} N"
    )
    picture.legend(*maps.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    return picture


def _draw_shaken(axes: Axes, found: Drop, colours: dict) -> None:
    for index, (name, colour) in enumerate(colours.items()):
        own = [each for each in found.shaken if each.method == name]
        # The first on top: what is at rest lies on one line.
        style = {"color": colour, "marker": MARKERS[index], "ls": "", "ms": 6, "alpha": 0.8, "zorder": 3 - index / 10}
        moved = [FLED_M if each.rms_m is None else max(each.rms_m, LEAST_M) for each in own]
        axes.plot([each.damping_n_s_per_m for each in own], np.array(moved) * 1e6, **style)
    threshold = found.scene.protocol.threshold_mm * 1e3
    axes.axhline(threshold, color="black", lw=1, ls="--", label=f"threshold, {threshold:g} µm")
    _draw_predicted(axes, found, colours)
    axes.set_title(f"after the settling mark, K = {STIFFNESS_N_PER_M / 1e3:g} kN/m, two hits each")
    axes.set_ylabel(f"RMS of position (µm; {LEAST_M * 1e6:g}: at rest)")
    axes.set_xlabel("damping B of the wall (N s/m)")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8, loc="upper left")


def _draw_predicted(axes: Axes, found: Drop, colours: dict) -> None:
    for each in found.laws:
        if each.factor == "none" and each.predicted_n_s_per_m < math.inf:
            axes.axvline(each.predicted_n_s_per_m, color=colours[each.method], lw=1.2, ls=":")
    axes.plot([], [], color="0.4", ls=":", lw=1.2, label="predicted to rest up to here (same colour)")


def _draw_ends(axes: Axes, found: Drop, colours: dict) -> None:
    for size, name in zip((13, 9), PAPERS, strict=True):
        edges = found.maps[name].edges
        upper = [edge.stable_n_per_m / 1e3 for edge in edges]
        axes.plot([edge.damping_n_s_per_m for edge in edges], upper, color=colours[name], lw=1)
        own = [each for each in found.ends if each.method == name]
        stable = [(each.stable_n_s_per_m, each.stiffness_n_per_m / 1e3) for each in own if each.stable_n_s_per_m]
        rests = [(each.rests_n_s_per_m, each.stiffness_n_per_m / 1e3) for each in own if each.rests_n_s_per_m]
        for ends, style in ((stable, STABLE), (rests, RESTS)):
            axes.plot(*np.array(ends).reshape(-1, 2).T, **style | {"color": colours[name], "ms": size})
    axes.plot([], [], color="0.4", lw=1, label="upper edge of the map")
    axes.plot([], [], **STABLE, label="stable up to here")
    axes.plot([], [], **RESTS, label="comes to rest up to here")
    _draw_predicted(axes, found, colours)
    axes.set_title("where three of four hits still come to rest, and where they are still stable")
    axes.set_xlabel("damping B of the wall (N s/m)")
    axes.set_ylabel("stiffness K of the wall (kN/m)")
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.3 * axes.get_ylim()[1])
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper left", ncols=2)


def _draw_laws(axes: Axes, found: Drop, colours: dict) -> None:
    known = [each for each in found.laws if each.method in PAPERS and _finite(each)]
    factors = list(dict.fromkeys(each.factor for each in known))
    for each in known:
        inside = each.factor not in OUTSIDE
        axes.plot(
            each.predicted_n_s_per_m,
            each.measured_n_s_per_m,
            marker=MARKERS[factors.index(each.factor)],
            color=colours[each.method],
            mfc=colours[each.method] if inside else "none",
            ms=7,
            ls="",
        )
    for index, factor in enumerate(factors):
        text = "as it is" if factor == "none" else factor
        axes.plot([], [], marker=MARKERS[index], color="0.4", ls="", label=text)
    for name in PAPERS:
        axes.plot([], [], color=colours[name], lw=4, label=found.maps[name].case.label)
    axes.plot([], [], marker="o", mfc="none", color="0.4", ls="", label="open: not in the law")
    ends = [value for each in known for value in (each.predicted_n_s_per_m, each.measured_n_s_per_m)] or [1.0, 2.0]
    line = np.array([min(ends), max(ends)])
    axes.plot(line, line, color="black", lw=1, label="measured = predicted")
    axes.fill_between(line, line / 2, line * 2, color="0.5", alpha=0.12, lw=0, label="within a factor of 2")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title("up to which B three of four hits come to rest, one thing changed at a time")
    axes.set_xlabel("predicted from the estimator alone, B (N s/m)")
    axes.set_ylabel("measured in the closed loop, B (N s/m)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8, loc="upper left", ncols=2)


def _finite(each) -> bool:
    return each.predicted_n_s_per_m < math.inf and 0 < each.measured_n_s_per_m < math.inf


def _draw_maps(axes: Axes, found: Drop, colours: dict) -> None:
    for index, (name, each) in enumerate(found.maps.items()):
        edge = [(edge.damping_n_s_per_m, edge.stable_n_per_m / 1e3) for edge in each.edges]
        times = found.of_papers(name)
        label = each.case.label if times is None else f"{each.case.label}: {times:.2f} of the paper's best"
        axes.plot(*zip(*edge, strict=True), color=colours[name], marker=MARKERS[index], ms=4, lw=1.4, label=label)
    grid = grid_of(next(iter(found.maps.values())).case.parsed)
    axes.set_title(f"stable walls, in steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m; areas below")
    axes.set_xlabel("damping B of the wall (N s/m)")
    axes.set_ylabel("largest stable stiffness K (kN/m)")
    axes.set_xlim(0, None)
    axes.set_ylim(0, None)
    axes.grid(alpha=0.3)
