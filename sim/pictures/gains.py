"""The picture of the area of the stable region over Levant's gains."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..studies.gains import Search
from ..studies.lipschitz import least_alpha_m_per_s2

ROWS = {False: "stable", True: "stable, and in place at rest"}
MARKS = {
    "proposed": {"marker": "o", "ms": 9, "mfc": "none", "mec": "white", "mew": 2},
    "adjusted": {"marker": "s", "ms": 9, "mfc": "none", "mec": "white", "mew": 2},
    "best": {"marker": "*", "ms": 22, "mfc": "tab:red", "mec": "white"},
    "best in place": {"marker": "D", "ms": 10, "mfc": "tab:orange", "mec": "black"},
    "best within the condition": {"marker": "P", "ms": 7, "mfc": "white", "mec": "black"},
}
"""From the largest to the smallest, so that those of one pair are seen together."""


def plot_gains(search: Search, backend: str) -> Figure:
    """Return the picture: a column an output; above the paper's area, below that of the walls in place.

    Args:
        search: what was found.
        backend: that the maps were made on.
    """
    picture = Figure(figsize=(12, 10.5), layout="constrained")
    panels = picture.subplots(len(ROWS), len(search.maps), sharex=True, sharey=True)
    colours = mpl.colormaps["viridis"].with_extremes(bad="0.8")
    # The areas in place are parts of these.
    largest = max(np.nanmax(search.areas(output, in_place=False)) for output in search.maps) / 1e3 or 1.0
    for row, (in_place, text) in zip(panels, ROWS.items(), strict=True):
        for axes, output in zip(row, search.maps, strict=True):
            area = search.areas(output, in_place) / 1e3
            mesh = axes.pcolormesh(search.lambdas, search.alphas, area, cmap=colours, vmin=0, vmax=largest)
            _mark(axes, search, output)
            axes.set_title(f"output {output}: walls that are {text}", fontsize=10)
    picture.colorbar(mesh, ax=panels, label="area (kN/m N s/m)", aspect=40)
    for axes in panels[-1]:
        axes.set_xlabel(r"$\lambda$ (m$^{1/2}$/s)")
    for axes in panels[:, 0]:
        axes.set_ylabel(r"$\alpha$ (m/s²)")
    controller, grid = search.scene.controller, search.coarse_grid
    picture.suptitle(
        f"Levant's gains on {search.scene.name}, {backend}: estimator at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, "
        f"{grid.damping_step_n_s_per_m:g} N s/m"
    )
    picture.legend(
        *panels[0, 0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=3,
        fontsize=10,
        facecolor="0.55",
        labelcolor="white",
        borderpad=0.8,
    )
    return picture


def _mark(axes: Axes, search: Search, output: str) -> None:
    """Draw the sufficient condition's boundary, and the gains that have a name."""
    bound = search.bound_m_per_s2
    lambdas = np.geomspace(search.lambdas[0], search.lambdas[-1], 2000)
    least = np.array([least_alpha_m_per_s2(each, bound) or np.nan for each in lambdas])
    least[least > search.alphas[-1]] = np.nan
    label = f"sufficient for convergence above it, C = {bound:g} m/s²"
    axes.plot(
        lambdas, least, color="white", lw=2, label=label, path_effects=[withStroke(linewidth=4, foreground="black")]
    )
    for name, mark in MARKS.items():
        if pick := search.picks[output].get(name):
            axes.plot(pick.gains.lambda_sqrt_m_per_s, pick.gains.alpha_m_per_s2, ls="", label=name, **mark)
    axes.set_xscale("log")
    axes.set_yscale("log")
