"""The picture of the area of the stable region over Levant's gains."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ..studies.gains import Search
from ..studies.lipschitz import least_alpha_m_per_s2
from .labels import label_points
from .style import lay_out, new_figure, page

ROWS = {False: "stable walls", True: "stable walls that are in place"}
MARKS = {"proposed": "o", "adjusted": "s", "best": "*", "best in place": "D", "best within the condition": "P"}
"""The markers of the gains that have a name; a pair with several names has the marker of the first."""
OUTLINE = [withStroke(linewidth=2, foreground="black")]


@page
def draw(search: Search) -> Figure:
    """Return the picture: a column for every output, with the paper's area above and the area in place below."""
    controller, grid = search.scene.controller, search.coarse_grid
    title = (
        f"Levant's gains on {search.scene.name}: samples at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; maps in steps of {grid.stiffness_step_n_per_m / 1e3:g} kN/m, "
        f"{grid.damping_step_n_s_per_m:g} N s/m"
    )
    picture = new_figure(6.8, title)
    panels = picture.subplots(len(ROWS), len(search.maps), sharex=True, sharey=True)
    colours = mpl.colormaps["viridis"].with_extremes(bad="0.8")
    # The areas in place are never larger than these.
    found = [search.areas(output, False) for output in search.maps]
    found += [search.areas_between(output, False)[:, 2] for output in search.maps]
    largest = np.nanmax(np.concatenate([areas.ravel() for areas in found])) / 1e3 or 1.0
    for row, (in_place, text) in zip(panels, ROWS.items(), strict=True):
        for axes, output in zip(row, search.maps, strict=True):
            area = search.areas(output, in_place) / 1e3
            scale = {"cmap": colours, "vmin": 0, "vmax": largest}
            mesh = axes.pcolormesh(search.lambdas, search.alphas, area, **scale)
            lambdas, alphas, between = search.areas_between(output, in_place).T
            axes.scatter(lambdas, alphas, 9, between / 1e3, edgecolors="white", linewidths=0.3, **scale)
            axes.grid(visible=False)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_title(f"output {output}: {text}")
    picture.colorbar(mesh, ax=panels, label="area of the stable region (kN/m N s/m)", aspect=40, pad=0.02)
    for axes in panels[-1]:
        axes.set_xlabel(r"$\lambda$ (m$^{1/2}$/s)")
    for axes in panels[:, 0]:
        axes.set_ylabel(r"$\alpha$ (m/s²)")
    lay_out(picture)
    for row in panels:
        for axes, output in zip(row, search.maps, strict=True):
            _mark(axes, search, output)
    return picture


def _mark(axes: Axes, search: Search, output: str) -> None:
    """Draw the boundary of the sufficient condition and the gains that have a name, with labels."""
    bound = search.bound_m_per_s2
    lambdas = np.geomspace(search.lambdas[0], search.lambdas[-1], 500)
    least = np.array([least_alpha_m_per_s2(each, bound) or np.nan for each in lambdas])
    least[least > search.alphas[-1]] = np.nan
    axes.plot(lambdas, least, color="white", lw=1.5, path_effects=OUTLINE)
    curve = [(lam, alpha) for lam, alpha in zip(lambdas, least, strict=True) if np.isfinite(alpha)]
    named: dict[tuple[float, float], list[str]] = {}
    for name in MARKS:
        if pick := search.picks[output].get(name):
            named.setdefault((pick.gains.lambda_sqrt_m_per_s, pick.gains.alpha_m_per_s2), []).append(name)
    for point, names in named.items():
        axes.plot(*point, ls="", marker=MARKS[names[0]], ms=8, mfc="white", mec="black")
    labels = [(_together(names), point, "white") for point, names in named.items()]
    if curve:
        text = f"above and right of it,\nsufficient for convergence\n(C = {bound:g} m/s²)"
        labels.append((text, curve[len(curve) // 3 :: 10], "white"))
    label_points(axes, labels, lines=[curve] if curve else [], ground="black")


def _together(names: list[str]) -> str:
    """Return the names of one pair as a label, one a line: `best, in place, within the condition`."""
    first, *others = names
    return ",\n".join([first, *(other.removeprefix("best ") if first == "best" else other for other in others)])
