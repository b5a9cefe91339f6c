"""The picture of what the rate buys: the largest stable stiffness against the rate, and the parts that limit it."""

from matplotlib.figure import Figure

from ..studies.rates import Rates
from .labels import label_points, label_right
from .style import THEORY, ink, lay_out, looks, new_figure, page

STYLES = "-", "--", "-.", ":"
OWN = 0.45
"""The abscissa of the stiffness at the scene's own rates, as a share of the lowest rate."""
TOP_KN_PER_M = 1500.0


@page
def draw(rates: Rates) -> Figure:
    """Return the picture of the largest stable stiffness against the rate."""
    gains, limits = rates.gains, rates.limits
    scene = gains[0].own.case.scene
    rates_khz = [rate / 1e3 for rate in gains[0].rates_hz]
    title = (
        f"{scene.name}: what rate buys, and which part of the device ends it\n"
        "grey: the linear loop without friction; open, at the left: at the scene's own rates of estimator and force"
    )
    picture = new_figure(5.6, title)
    axes = picture.subplots()
    scenes = [gain.own.case.scene for gain in gains]
    ends = []
    for gain, own, style in zip(
        gains, scenes, looks([(own.controller.estimator, own.estimator_output) for own in scenes]), strict=True
    ):
        largest = [k / 1e3 for k in gain.largest_n_per_m]
        axes.plot(rates_khz, largest, **style)
        from_own = [OWN * rates_khz[0], rates_khz[0]], [gain.own.largest_n_per_m / 1e3, largest[0]]
        axes.plot(*from_own, **style | {"ls": ":", "lw": 0.8, "marker": ""})
        axes.plot(from_own[0][0], from_own[1][0], **style | {"ls": "", "mfc": "white"})
        ends.append((gain.label, largest[-1], ink(own.controller.estimator)))
    axes.set_xscale("log")
    axes.set_yscale("log")
    controller = scene.controller
    label = f"its own,\n{controller.sample_hz / 1e3:g}/{controller.actuation_hz / 1e3:g}"
    axes.set_xticks([OWN * rates_khz[0], *rates_khz], [label, *(f"{rate:g}" for rate in rates_khz)])
    axes.minorticks_off()
    axes.set_yticks([10, 20, 50, 100, 200, 500, 1000], ["10", "20", "50", "100", "200", "500", "1000"])
    axes.set_xlim(0.8 * OWN * rates_khz[0], 1.1 * rates_khz[-1])
    axes.set_ylim(10, TOP_KN_PER_M)
    axes.set_xlabel("rate of estimator and force (kHz)")
    axes.set_ylabel("largest stable stiffness K of the map (kN/m)")
    leaving = []
    for style, (parts, limit) in zip(STYLES, limits.items(), strict=True):
        values = [k / 1e3 for k in limit]
        axes.plot(rates_khz, values, color=THEORY, ls=style, lw=1, zorder=1.5)
        if values[-1] < TOP_KN_PER_M:
            ends.append((f"linear: {parts}", values[-1], THEORY))
        else:
            leaving.append(
                (f"linear: {parts}\n(leaves the picture)", list(zip(rates_khz, values, strict=True)), THEORY)
            )
    label_right(axes, ends)
    inside = [list(zip(rates_khz, [k / 1e3 for k in gain.largest_n_per_m], strict=True)) for gain in gains]
    inside += [list(zip(rates_khz, [k / 1e3 for k in limit], strict=True)) for limit in limits.values()]
    named = [points for _, points, _ in leaving]
    lay_out(picture)
    label_points(axes, leaving, lines=[line for line in inside if line not in named])
    return picture
