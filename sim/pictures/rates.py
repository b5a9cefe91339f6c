"""The picture of what rate buys: the largest stable stiffness against the rate, and what ends it."""

from matplotlib.figure import Figure

from ..scene.schema import Scene
from ..studies.rates import Gain
from .style import line_style

STYLES = "-", "--", "-.", ":"
OWN = 0.55
"""Where the stiffness at the scene's own rates stands, as a share of the lowest rate."""


def plot_rates(gains: list[Gain], limits: dict[str, list[float]], scene: Scene, backend: str) -> Figure:
    """Return the picture.

    Args:
        gains: by method.
        limits: of `rates.linear_limits`, at the same rates.
        scene: named in the title.
        backend: that the maps were made on.
    """
    rates_khz = [rate / 1e3 for rate in gains[0].rates_hz]
    picture = Figure(figsize=(10, 7), layout="constrained")
    axes = picture.subplots()
    for style, (left, limit) in zip(STYLES, limits.items(), strict=True):
        axes.plot(rates_khz, [k / 1e3 for k in limit], color="0.55", ls=style, lw=1.2, label=f"linear loop, {left}")
    for index, gain in enumerate(gains):
        style = line_style(index, 6)
        largest = [k / 1e3 for k in gain.largest_n_per_m]
        axes.plot(rates_khz, largest, label=gain.label, lw=1.5, **style)
        axes.plot(OWN * rates_khz[0], gain.own.largest_n_per_m / 1e3, mfc="none", ls="", **style)
    axes.set_xscale("log")
    axes.set_yscale("log")
    own = scene.controller
    label = f"own:\n{own.sample_hz / 1e3:g}/{own.actuation_hz / 1e3:g}"
    axes.set_xticks([OWN * rates_khz[0], *rates_khz], [label, *(f"{rate:g}" for rate in rates_khz)], minor=False)
    axes.minorticks_off()
    axes.set_yticks([10, 20, 50, 100, 200, 500, 1000], ["10", "20", "50", "100", "200", "500", "1000"])
    axes.set_ylim(10, 1500)
    axes.set_xlabel("rate of estimator and force (kHz); open: the scene's own, estimator / force")
    axes.set_ylabel("largest stable stiffness K of the map (kN/m)")
    axes.set_title(f"{scene.name}, {backend}: what rate buys, and which part ends it")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, ncols=2, loc="lower right")
    return picture
