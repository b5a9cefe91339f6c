"""Pictures of what the rate buys: the largest stable stiffness and the parts that limit it, and beside it the error."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ..studies.rates import Rates
from ..studies.rendered_setting import rate_text
from .labels import label_points, label_right
from .style import BAND, THEORY, ink, lay_out, looks, new_figure, page

STYLES = "-", "--", "-.", ":"
OWN = 0.45
"""The abscissa of the stiffness at the scene's own rates, as a share of the lowest rate."""
TOP_KN_PER_M = 1500.0
LOW_PASS = "butterworth"
"""The plain filter that is compared with the estimator that gains most by the rate."""


class Point(NamedTuple):
    """A value at a rate (Hz), and the ends of its interval."""

    rate_hz: int
    value: float
    low: float
    high: float


Curves = Mapping[str, list[Point]]
"""The points of curves by the label of an estimator and its output."""


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
    errors, stiffest = _errors(accuracy["rows"]), _stiffest(rates["methods"])
    figure = new_figure(3.9, _message(errors, stiffest))
    left, right = figure.subplots(1, 2)
    left.set_yscale("log")
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    left.set_title("error of the velocity")
    left.set_ylabel("RMS error (mm/s)")
    right.set_title("stiffness of the wall; bands: the starts")
    right.set_ylabel("largest stable stiffness (kN/m)")
    for axes, curves in ((left, errors), (right, stiffest)):
        _against_rate(axes, curves)
    right.set_ylim(0, 1.1 * max(point.high for points in stiffest.values() for point in points))
    for axes, curves in ((left, errors), (right, stiffest)):
        label_right(axes, [(name, points[-1].value, ink(name.split()[0])) for name, points in curves.items()])
    return figure


def _errors(rows: list[dict[str, Any]]) -> Curves:
    """Return the RMS errors (mm/s) of an accuracy report over the rate."""
    curves: dict[str, list[Point]] = {}
    for row in sorted(rows, key=lambda row: row["sample_hz"]):
        name = row["estimator"] if row["output"] == "u" else f"{row['estimator']} {row['output']}"
        curves.setdefault(name, []).append(Point(row["sample_hz"], *[row["rms_mm_s"]] * 3))
    return curves


def _stiffest(methods: list[dict[str, Any]]) -> Curves:
    """Return the largest stable stiffness (kN/m) over the rate, with the interval of the starts."""
    return {
        each["label"]: [
            Point(rate_hz, k / 1e3, low / 1e3, high / 1e3)
            for rate_hz, k, (low, high) in zip(
                each["rates_hz"],
                each["largest_stiffness_n_per_m"],
                each["largest_stiffness_interval_n_per_m"],
                strict=True,
            )
        ]
        for each in methods
    }


def _against_rate(axes: Axes, curves: Curves) -> None:
    """Draw curves, and their intervals as bands, over a logarithmic axis of rates."""
    names = [(name.split()[0], "".join(name.split()[1:]) or "u") for name in curves]
    for points, style in zip(curves.values(), looks(names), strict=True):
        rates_khz = [point.rate_hz / 1e3 for point in points]
        axes.plot(rates_khz, [point.value for point in points], **style)
        ends = [point.low for point in points], [point.high for point in points]
        axes.fill_between(rates_khz, *ends, color=style["color"], alpha=BAND, lw=0)
    axes.set_xscale("log")
    axes.set_xticks([1, 10, 100, 1000], ["1", "10", "100", "1000"])
    axes.minorticks_off()
    axes.set_xlabel("sample rate (kHz)")


def _message(errors: Curves, stiffest: Curves) -> str:
    """Return what the numbers say: whose error changes most with the rate, and where a plain low pass is better."""
    times = {name: points[-1].value / points[0].value for name, points in errors.items()}
    # Of those whose walls are known, too.
    both = [name for name in times if name in stiffest] or [*times]
    worst, best = max(times, key=times.__getitem__), min(both, key=times.__getitem__)
    first, last = (rate_text(errors[worst][place].rate_hz) for place in (0, -1))
    wins = [_where(curves, best, lower) for curves, lower in ((errors, True), (stiffest, False))]
    return (
        f"From {first} to {last} the error of {worst} grows {times[worst]:.3g} times, and {best} gets "
        f"{1 / times[best]:.3g} times better\n"
        f"{LOW_PASS}, a plain low pass, has less error than {best} {wins[0]}, and stiffer walls {wins[1]}"
    )


def _where(curves: Curves, other: str, lower: bool) -> str:
    """Return the rates at which the interval of the low pass is below (`lower`) or above another estimator's."""
    pairs = zip(curves.get(LOW_PASS, []), curves.get(other, []), strict=True)
    wins = [(ours.rate_hz, ours.high < its.low if lower else ours.low > its.high) for ours, its in pairs]
    where = [rate_hz for rate_hz, better in wins if better]
    if len(where) in (0, len(wins)):
        return "at every rate" if where else "at none"
    if all(better for rate_hz, better in wins if rate_hz <= where[-1]):
        return f"up to {rate_text(where[-1])}"
    return f"at {', '.join(map(rate_text, where))}"
