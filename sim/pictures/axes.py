"""The picture of what several axes take and how fast each of them is, with the lines of the part's limit."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.axes import AxesCosts
from .style import LABEL_PT, THEORY, looks, name_above, new_figure, page, plain_decades


@page
def draw(costs: AxesCosts) -> Figure:
    """Return the picture, with a panel of the logic and one of the rate, and a line in them for every kind of axes."""
    rows = costs.rows
    numbers = sorted({row["axes"] for row in rows})
    # No rota ends sooner than a clock for each axis, and no netlist here has a faster clock than this one.
    clock_mhz = max(row["fmax_mhz"] for row in rows)
    open_ones = "" if all(row["supervised"] for row in rows) else "; open: without supervisors"
    title = f"several axes in one pipeline on {rows[0]['device']}, placed alone{open_ones}"
    picture = new_figure(5.8, title)
    logic, rate = picture.subplots(2, 1, sharex=True)
    estimators = list(dict.fromkeys(row["estimator"] for row in rows))
    styles = dict(zip(estimators, looks([(name, "u") for name in estimators]), strict=True))
    for name, own in costs.kinds().items():
        drawn = styles[own[0]["estimator"]] | ({} if own[0]["supervised"] else {"mfc": "white", "ls": "--"})
        of = [row["axes"] for row in own]
        logic.plot(of, [row["lut4"] for row in own], label=name, **drawn)
        rate.plot(of, [row["max_sample_hz"] / 1e6 for row in own], **drawn)
    most = rows[0]["available"]["lut4"]
    logic.axhline(most, color=THEORY, lw=1, ls="--")
    _say(logic, f"the part has {most:,} LUT4".replace(",", " "), (numbers[0], most), (8, -10))
    rate.plot(numbers, [clock_mhz / number for number in numbers], color=THEORY, lw=1, ls="--", zorder=1.5)
    _say(rate, f"a clock for each axis, at {clock_mhz:.0f} MHz", (numbers[0], clock_mhz), (12, 2))
    logic.set_ylim(0, 1.08 * most)
    rate.set_yscale("log")
    rate.set_xscale("log", base=2)
    plain_decades(rate.yaxis)
    rate.set_xticks(numbers, map(str, numbers))
    rate.minorticks_off()
    rate.set_xlabel("axes in the pipeline (N)")
    logic.set_ylabel("LUT4")
    rate.set_ylabel("samples a second of an axis (M/s)")
    name_above(logic, 3)
    return picture


def _say(axes: Axes, text: str, begin: tuple[float, float], away: tuple[float, float]) -> None:
    """Write what a limit is, beside the point where its line begins."""
    axes.annotate(text, begin, away, textcoords="offset points", color=THEORY, fontsize=LABEL_PT, va="center")
