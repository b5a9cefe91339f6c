"""The picture of samples a second against logic: the board with each estimator, and what others have published."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from ..studies.costs import Costs
from ..studies.published import LOOPS
from .labels import label_points
from .style import LABEL_PT, THEORY, ink, lay_out, looks, new_figure, page

LOWEST_HZ, HIGHEST_HZ = 8e3, 60e6


@page
def draw(costs: Costs) -> Figure:
    """Return the picture, with a panel for every part, and a point for every estimator whose board fits."""
    devices = list(dict.fromkeys(row["device"] for row in costs.rows))
    title = (
        "samples a second against logic: one axis with supervisor, link and capture memory, as placed and routed\n"
        "grey: published haptic loops on FPGAs, whose logic is not published"
    )
    picture = new_figure(0.7 + 2.9 * len(devices), title)
    panels = picture.subplots(len(devices), 1, squeeze=False)[:, 0]
    for axes, device in zip(panels, devices, strict=True):
        _draw(axes, [row for row in costs.rows if row["device"] == device])
    lay_out(picture)
    for axes, device in zip(panels, devices, strict=True):
        placed = [row for row in costs.rows if row["device"] == device and row["board"]]
        names = [(row["estimator"], _spot(row), ink(row["estimator"])) for row in placed]
        ends = axes.get_xlim()
        label_points(axes, names, lines=[[(end, loop.sample_hz) for end in ends] for loop in LOOPS])
    return picture


def _spot(row: dict[str, Any]) -> tuple[float, float]:
    """Return the coordinates of an estimator: LUT4, and samples a second."""
    return row["board"]["lut4"], row["board"]["max_sample_hz"]


def _draw(axes: Axes, rows: list[dict[str, Any]]) -> None:
    """Draw the panel of a part."""
    placed, large = [row for row in rows if row["board"]], [row["estimator"] for row in rows if not row["board"]]
    without = f"; too large for it: {', '.join(large)}" if large else ""
    axes.set_title(f"{rows[0]['device']}{without}", wrap=True)
    for row, style in zip(placed, looks([(row["estimator"], "u") for row in placed]), strict=True):
        axes.plot(*_spot(row), **style | {"ls": "", "ms": 6})
    for loop in LOOPS:
        axes.axhline(loop.sample_hz, color=THEORY, lw=1, ls="--")
        axes.annotate(
            f"{loop.source}, {loop.sample_hz / 1e3:g} kHz",
            (0.01, loop.sample_hz),
            (0, 2),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            color=THEORY,
            fontsize=LABEL_PT,
        )
    axes.set_yscale("log")
    axes.set_ylim(LOWEST_HZ, HIGHEST_HZ)
    axes.yaxis.set_major_formatter(EngFormatter(sep=" "))
    axes.set_xlabel("LUT4 of the board")
    axes.set_ylabel("sample rate (Hz)")
    axes.margins(x=0.15)
