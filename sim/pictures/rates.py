"""Pictures of what the rate buys: the largest stable stiffness and the parts that limit it, and beside it the error."""

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ..studies.rates import Rates
from .labels import label_points, label_right
from .style import THEORY, ink, lay_out, looks, new_figure, page

STYLES = "-", "--", "-.", ":"
OWN = 0.45
"""The abscissa of the stiffness at the scene's own rates, as a share of the lowest rate."""
TOP_KN_PER_M = 1500.0
LOW_PASS = "butterworth"
"""The plain filter that is compared with the estimator that gains most by the rate."""

Curves = Mapping[str, list[tuple[float, float]]]
"""The points of curves, (rate in kHz, value), by the label of an estimator and its output."""


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


@page
def draw_beside_errors(accuracy: Mapping[str, Any], rates: Mapping[str, Any]) -> Figure:
    """Return the picture of the velocity's error against the rate, and of the largest stable stiffness beside it.

    Args:
        accuracy: the report of `hardwall accuracy` on one signal.
        rates: the report of `hardwall rates`, with some of the same estimators.
    """
    errors = _errors(accuracy["rows"])
    stiffest = {
        each["label"]: [
            (rate / 1e3, k / 1e3) for rate, k in zip(each["rates_hz"], each["largest_stiffness_n_per_m"], strict=True)
        ]
        for each in rates["methods"]
    }
    figure = new_figure(3.9, _message(errors, stiffest))
    left, right = figure.subplots(1, 2)
    left.set_yscale("log")
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    left.set_title("error of the velocity")
    left.set_ylabel("RMS error (mm/s)")
    right.set_title("stiffness of the wall")
    right.set_ylabel("largest stable stiffness (kN/m)")
    for axes, curves in ((left, errors), (right, stiffest)):
        _against_rate(axes, curves)
    right.set_ylim(0, 1.1 * max(k for points in stiffest.values() for _, k in points))
    for axes, curves in ((left, errors), (right, stiffest)):
        label_right(axes, [(name, points[-1][1], ink(name.split()[0])) for name, points in curves.items()])
    return figure


def _errors(rows: list[dict[str, Any]]) -> Curves:
    """Return the RMS errors (mm/s) of an accuracy report over the rate."""
    curves: dict[str, list[tuple[float, float]]] = {}
    for row in sorted(rows, key=lambda row: row["sample_hz"]):
        name = row["estimator"] if row["output"] == "u" else f"{row['estimator']} {row['output']}"
        curves.setdefault(name, []).append((row["sample_hz"] / 1e3, row["rms_mm_s"]))
    return curves


def _against_rate(axes: Axes, curves: Curves) -> None:
    """Draw curves over a logarithmic axis of rates."""
    names = [(name.split()[0], "".join(name.split()[1:]) or "u") for name in curves]
    for points, style in zip(curves.values(), looks(names), strict=True):
        axes.plot(*zip(*points, strict=True), **style)
    axes.set_xscale("log")
    axes.set_xticks([1, 10, 100, 1000], ["1", "10", "100", "1000"])
    axes.minorticks_off()
    axes.set_xlabel("sample rate (kHz)")


def _message(errors: Curves, stiffest: Curves) -> str:
    """Return what the numbers say: whose error changes most with the rate, and where a plain low pass is better."""
    times = {name: points[-1][1] / points[0][1] for name, points in errors.items()}
    worst, best = max(times, key=times.__getitem__), min(times, key=times.__getitem__)
    first, last = (_rate(next(iter(errors.values()))[place][0]) for place in (0, -1))
    wins = [_where(curves, best, sign) for curves, sign in ((errors, 1), (stiffest, -1))]
    return (
        f"From {first} to {last} the error of {worst} grows {times[worst]:.3g} times, and {best} gets "
        f"{1 / times[best]:.3g} times better\n"
        f"{LOW_PASS}, a plain low pass, has less error than {best} {wins[0]}, and stiffer walls {wins[1]}"
    )


def _where(curves: Curves, other: str, sign: int) -> str:
    """Return at which rates the low pass has the lesser (sign 1) or the larger (-1) value than another estimator."""
    pairs = zip(curves.get(LOW_PASS, []), curves.get(other, []), strict=True)
    wins = [(rate, sign * (value - of_other) < 0) for (rate, value), (_, of_other) in pairs]
    where = [rate for rate, better in wins if better]
    if len(where) in (0, len(wins)):
        return "at every rate" if where else "at none"
    if all(better for rate, better in wins if rate <= where[-1]):
        return f"up to {_rate(where[-1])}"
    return f"at {', '.join(map(_rate, where))}"


def _rate(rate_khz: float) -> str:
    return f"{rate_khz / 1e3:g} MHz" if rate_khz >= 1e3 else f"{rate_khz:g} kHz"
