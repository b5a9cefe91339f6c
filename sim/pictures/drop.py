"""Pictures of why a stable region ends in a drop, one for every experiment."""

import math

import numpy as np
from matplotlib.figure import Figure

from ..studies.drop import ENOUGH, PAPERS, STARTS, STIFFNESSES_N_PER_M
from ..studies.drop_result import STIFFNESS_N_PER_M, Drop, Law
from ..walls.grid import grid_of
from .labels import label_points
from .style import (
    AT_REST_M,
    COLOURS,
    LABEL_PT,
    THEORY,
    ink,
    lay_out,
    length_text,
    looks,
    new_figure,
    page,
    plain_decades,
)

OUTSIDE = ("mass", "count", "delay", "stiffness")
"""The changed quantities that are not in the law."""
LAWS = (
    {"marker": "o", "color": COLOURS["levant"], "ms": 5},
    {"marker": "s", "color": COLOURS["butterworth"], "ms": 5},
)
"""The styles of the paper's two gains."""
BAND = 2.0
"""The factor of error above which a law is labelled with its name."""
COLUMNS = 3
"""The number of columns of panels."""


@page
def draw(drop: Drop) -> dict[str, Figure]:
    """Return the pictures: `rest`, `law`, `ends` and `maps`."""
    return {"rest": _rest(drop), "law": _law(drop), "ends": _ends(drop), "maps": _maps(drop)}


def _inks(drop: Drop) -> dict[str, str]:
    """Return the colours in which the methods are written, by name."""
    return {name: ink(each.case.scene.controller.estimator) for name, each in drop.maps.items()}


def _setting(drop: Drop) -> str:
    controller, handle = drop.scene.controller, drop.scene.handle
    return (
        f"{drop.scene.name}: samples at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz, friction {handle.coulomb_n:g} N, push {drop.scene.protocol.push_n:g} N"
    )


def _predicted(drop: Drop) -> dict[str, float]:
    """Return the B up to which the handle is predicted to rest, by method; infinite without end."""
    return {each.method: each.predicted_n_s_per_m for each in drop.laws if each.factor == "none"}


def _rest(drop: Drop) -> Figure:
    """Return the picture of the hits of one wall: a row for every method, B along it, and the outcome of every hit."""
    title = (
        f"What becomes of the handle in a wall of K = {STIFFNESS_N_PER_M / 1e3:g} kN/m and more and more damping, "
        f"two hits each\n{_setting(drop)}"
    )
    picture = new_figure(4.5, title)
    axes = picture.subplots()
    threshold_m = drop.scene.protocol.threshold_mm * 1e-3
    kinds = {
        "at rest": {"marker": "o", "mfc": "white", "mec": "0.5", "ms": 5},
        f"shaken, by less than {length_text(threshold_m)}: stable": {"marker": "o", "color": COLOURS["levant-edge"]},
        f"shaken, by more than {length_text(threshold_m)}: unstable": {"marker": "X", "color": COLOURS["levant"]},
    }
    rows, inks, predicted = list(drop.maps), _inks(drop), _predicted(drop)
    for kind, style in zip(range(len(kinds)), kinds.values(), strict=True):
        spots = []
        for row, name in enumerate(rows):
            # The two hits of a wall are drawn one above the other.
            hits = [each for each in drop.shaken if each.method == name]
            for number, each in enumerate(hits):
                if _kind(each.rms_m, threshold_m) == kind:
                    spots.append((each.damping_n_s_per_m, row + (0.17 if number % 2 else -0.17)))
        axes.plot(*np.array(spots).reshape(-1, 2).T, ls="", **{"ms": 5.5} | style)
    for row, name in enumerate(rows):
        end = predicted.get(name, math.inf)
        if end < math.inf:
            axes.plot([end, end], [row - 0.42, row + 0.42], color="black", lw=2)
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_yticks(range(len(rows)), [drop.maps[name].case.label for name in rows])
    for text, name in zip(axes.get_yticklabels(), rows, strict=True):
        text.set_color(inks[name])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("damping B of the wall (N s/m)")
    for name, style in kinds.items():
        axes.plot([], [], ls="", label=name, **{"ms": 5.5} | style)
    axes.plot([], [], ls="", marker="|", ms=9, mew=2, color="black", label="predicted: rests up to here")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.35, 1.0), ncols=2, frameon=False, borderaxespad=0.2)
    return picture


def _kind(rms_m: float | None, threshold_m: float) -> int:
    """Return 0 if a handle is at rest, 1 if it is shaken below the threshold, 2 if above or if it fled."""
    if rms_m is None or rms_m >= threshold_m:
        return 2
    return int(rms_m >= AT_REST_M)


def _finite(law: Law) -> bool:
    return law.predicted_n_s_per_m < math.inf and 0 < law.measured_n_s_per_m < math.inf


def _law(drop: Drop) -> Figure:
    """Return the picture of the law: measured against predicted B, one change at a time; far ones are named."""
    known = [each for each in drop.laws if each.method in PAPERS and _finite(each)]
    inside = [each for each in known if each.factor not in (*OUTSIDE, "none")]
    right = [each for each in inside if _is_near(each)]
    title = (
        f"Where rest ends is predicted from the estimator alone: within a factor of {BAND:g} in {len(right)} of "
        f"{len(inside)} loops\n{_setting(drop)}; one thing changed at a time"
    )
    picture = new_figure(4.9, title)
    axes = picture.subplots()
    ends = [value for each in known for value in _spot(each)] or [1.0, 2.0]
    line = np.array([min(ends) / 1.5, max(ends) * 1.5])
    axes.fill_between(line, line / BAND, line * BAND, color="0.92", lw=0)
    axes.plot(line, line, color="black", lw=1)
    for name, style in zip(PAPERS, LAWS, strict=True):
        for changed, filled in ((True, {}), (False, {"mfc": "none"})):
            spots = [_spot(each) for each in known if each.method == name and (each.factor not in OUTSIDE) == changed]
            what = "" if changed else f"; changed: {', '.join(OUTSIDE)}, not in the law"
            label = f"{drop.maps[name].case.label}{what}"
            axes.plot(*np.array(spots).reshape(-1, 2).T, ls="", label=label, **style | filled)
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_decades(axes.xaxis)
    plain_decades(axes.yaxis)
    axes.set_xlim(*line)
    axes.set_ylim(*line)
    axes.set_xlabel("predicted: the handle rests up to B (N s/m)")
    axes.set_ylabel("measured in the loop: B (N s/m)")
    picture.legend(*axes.get_legend_handles_labels(), loc="outside lower left", frameon=False)
    lay_out(picture)
    far = [each for each in known if not _is_near(each)]
    labels = [(f"{each.factor} {each.value}", _spot(each), "black") for each in far]
    label_points(axes, labels, avoid=[_spot(each) for each in known if each not in far], lines=[[(x, x) for x in line]])
    return picture


def _is_near(law: Law) -> bool:
    """Return whether a measured B is within the band around the predicted one."""
    return 1 / BAND <= law.measured_n_s_per_m / law.predicted_n_s_per_m <= BAND


def _spot(law: Law) -> tuple[float, float]:
    return law.predicted_n_s_per_m, law.measured_n_s_per_m


def _ends(drop: Drop) -> Figure:
    """Return the picture of the ends of rest and of stability, from soft walls to stiff walls."""
    title = (
        f"Up to which B at least {math.ceil(ENOUGH * STARTS)} of {STARTS} hits come to rest, and are stable, at K of "
        f"{', '.join(f'{k / 1e3:g}' for k in STIFFNESSES_N_PER_M)} kN/m\n{_setting(drop)}"
    )
    picture = new_figure(4.9, title)
    panels = picture.subplots(1, len(PAPERS), sharex=True, sharey=True)
    inks, predicted = _inks(drop), _predicted(drop)
    for axes, name in zip(panels, PAPERS, strict=True):
        boundary = drop.maps[name].boundary
        upper = [(point.damping_n_s_per_m, point.stable_n_per_m / 1e3) for point in boundary]
        axes.plot(*zip(*upper, strict=True), color=inks[name])
        own = [each for each in drop.ends if each.method == name]
        stable = [(each.stable_n_s_per_m, each.stiffness_n_per_m / 1e3) for each in own if each.stable_n_s_per_m]
        rests = [(each.rests_n_s_per_m, each.stiffness_n_per_m / 1e3) for each in own if each.rests_n_s_per_m]
        for ends, style in ((stable, {"marker": "o", "mfc": "none", "ms": 9}), (rests, {"marker": "x", "ms": 6})):
            axes.plot(*np.array(ends).reshape(-1, 2).T, color="black", ls="", **style)
        axes.set_title(drop.maps[name].case.label)
        axes.set_xlabel("damping B of the wall (N s/m)")
        if predicted.get(name, math.inf) < math.inf:
            axes.axvline(predicted[name], color=THEORY, lw=1, ls=":")
    axes.set_xlim(0, None)
    axes.set_ylim(0, 1.1 * axes.get_ylim()[1])
    panels[0].set_ylabel("stiffness K of the wall (kN/m)")
    panels[0].plot([], [], color=inks[PAPERS[0]], label="upper edge of the map")
    panels[0].plot([], [], color=THEORY, ls=":", label="predicted: rests up to here")
    panels[0].plot([], [], color="black", ls="", marker="x", ms=6, label="comes to rest up to here")
    panels[0].plot([], [], color="black", ls="", marker="o", mfc="none", ms=9, label="stable up to here")
    picture.legend(loc="outside lower center", ncols=2, frameon=False)
    return picture


def _maps(drop: Drop) -> Figure:
    """Return the picture of the stable regions: a panel for every method, with the others pale behind it."""
    grid = grid_of(next(iter(drop.maps.values())).case.scene)
    title = (
        "The stable region of each method; in brackets its area, as a multiple of Levant u's, adjusted\n"
        f"{drop.scene.name}, maps in steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, "
        f"{grid.damping_step_n_s_per_m:.3g} N s/m"
    )
    picture = new_figure(6.2, title)
    rows = math.ceil(len(drop.maps) / COLUMNS)
    panels = picture.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False)
    inks = _inks(drop)
    boundaries = {
        name: [(point.damping_n_s_per_m, point.stable_n_per_m / 1e3) for point in each.boundary]
        for name, each in drop.maps.items()
    }
    for axes, (name, each) in zip(panels.flat, drop.maps.items(), strict=False):
        for other in boundaries.values():
            axes.plot(*zip(*other, strict=True), color="0.85", lw=0.9)
        controller = each.case.scene.controller
        (style,) = looks([(controller.estimator, controller.output)])
        axes.plot(*zip(*boundaries[name], strict=True), **style | {"lw": 1.6, "ms": 3.5})
        times = drop.of_papers(name)
        label = each.case.label.replace(", ", ",\n")
        axes.set_title(label if times is None else f"{label} ({times:.2f})", color=inks[name], fontsize=LABEL_PT)
    for axes in panels.flat[len(drop.maps) :]:
        axes.set_axis_off()
    panels[0, 0].set_xlim(0, None)
    panels[0, 0].set_ylim(0, None)
    for axes in panels[-1]:
        axes.set_xlabel("damping B (N s/m)")
    for axes in panels[:, 0]:
        axes.set_ylabel("stiffness K (kN/m)")
    return picture
