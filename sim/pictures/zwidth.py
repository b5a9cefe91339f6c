"""Pictures of Z-width maps: the stable region of each method, and what theory says of it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ..scene.schema import Scene
from ..walls.boundary import Grid
from ..walls.theory import abbott_okamura_n_per_m, colgate_schenkel_n_per_m
from ..walls.zwidth import Map
from .style import line_style

ROOM = 8
"""For the names of so many maps; those of more stand beside the picture."""


def plot_zwidth(
    maps: Sequence[Map], limits: Sequence[list[float] | None], scene: Scene, grid: Grid, backend: str
) -> Figure:
    """Return the picture of the largest stable stiffness against damping.

    Args:
        maps: of one scene.
        limits: for each, the linear loop's limit (N/m) at every B of the grid, or None where there is none.
        scene: whose handle and rates the theory is for.
        grid: of the maps.
        backend: that the maps were made on.
    """
    picture = Figure(figsize=(10, 7), layout="constrained")
    axes = picture.subplots()
    dampings = grid.dampings
    for index, (each, limit) in enumerate(zip(maps, limits, strict=True)):
        style = line_style(index, 4)
        edge = [(edge.damping_n_s_per_m, edge.stable_n_per_m / 1e3) for edge in each.edges]
        axes.plot(*zip(*edge, strict=True), label=each.case.label, lw=1.4, **style)
        if limit:
            axes.plot(dampings, np.array(limit) / 1e3, color=style["color"], ls="--", lw=0.9)
    if any(limits):
        axes.plot([], [], color="0.4", ls="--", lw=0.9, label="linear loop, no friction, exact (same colour)")
    colgate = [colgate_schenkel_n_per_m(scene, damping) / 1e3 for damping in dampings]
    axes.plot(
        dampings,
        colgate,
        color="black",
        ls=":",
        lw=1.4,
        label="passive: Colgate, Schenkel (0: none is)",
    )
    abbott = abbott_okamura_n_per_m(scene) / 1e3
    axes.plot(
        [0], [abbott], "k_", ms=16, mew=2, clip_on=False, label=f"passive at B = 0: Abbott, Okamura ({abbott:.3g} kN/m)"
    )
    controller = scene.controller
    axes.set_title(
        f"{scene.name}, {backend}: estimators at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m"
    )
    axes.set_xlabel("damping B of the wall (N s/m)")
    axes.set_ylabel("largest stable stiffness K (kN/m)")
    axes.set_xlim(0, None)
    axes.set_ylim(0, None)
    axes.grid(alpha=0.3)
    if len(maps) > ROOM:
        picture.legend(fontsize=8, loc="outside right upper")
    else:
        axes.legend(fontsize=8, loc="upper left")
    return picture
