"""The picture of speed against accuracy: the time of a map, and how far every setting moves its edge."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.shortcuts import SCATTER
from ..studies.trade import Point, Trade
from ..walls import methods
from .labels import label_points
from .style import COLOURS, LABEL_PT, THEORY, lay_out, new_figure, page, plain_decades

NAMED = 9
"""The largest number of settings of a panel that are labelled."""
BEST, PLAIN, SAME = COLOURS["butterworth"], "0.25", "0.65"
MOST = 3.0
"""The ratio of areas at which an interval is cut off that has no end, or a far one."""


@page
def draw(trade: Trade) -> Figure:
    """Return a panel for every estimator: the area of a setting's map over the reference's, against time."""
    controller, grid = trade.scene.controller, trade.scene.zwidth
    title = (
        f"What moves the edge of the stable walls, and what it costs\n{trade.scene.name}: samples at "
        f"{controller.sample_hz / 1e3:g} kHz, force at {controller.actuation_hz / 1e3:g} kHz; "
        f"B of {grid.damping_from_n_s_per_m:g} to {grid.damping_to_n_s_per_m:g} N s/m, K by "
        f"{grid.stiffness_step_n_per_m / 1e3:g} kN/m, {trade.starts} starts"
    )
    picture = new_figure(0.9 + 3.4 * len(trade.labels), title)
    panels = picture.subplots(len(trade.labels), sharex=True, squeeze=False)[:, 0]
    for axes, label in zip(panels, trade.labels, strict=True):
        axes.set_title(methods.methods()[label].label)
        axes.set_ylabel("area (of that with all parts)")
        _draw(axes, trade, label)
    panels[-1].set_xlabel("time of both maps, in one process (s)")
    picture.align_ylabels(panels)
    notes = (
        "bars: 95 of 100 draws of the starts; grey: the same area, as far as these tell\n"
        "blue: no map is both faster and as surely right; those without a name are in the command's table"
    )
    picture.supxlabel(notes, x=0.01, ha="left", fontsize=LABEL_PT, color=THEORY)
    lay_out(picture)
    for axes, label in zip(panels, trade.labels, strict=True):
        _name(axes, trade, label)
    return picture


def named(trade: Trade, label: str) -> list[Point]:
    """Return the points of a panel that are labelled, at most `NAMED`.

    They are the reference, the best, and of the others those that move the edge most.
    """
    others = [point for point in trade.points if point.shortcut.axis != SCATTER]
    chosen = [trade.points[0], *trade.best(label), *sorted(others, key=lambda point: -abs(point.moves[label].area - 1))]
    distinct = [point for number, point in enumerate(chosen) if point not in chosen[:number]]
    return distinct[:NAMED]


def _colour(point: Point, best: list[Point], label: str) -> str:
    return BEST if point in best else PLAIN if point.moves[label].moved else SAME


def _draw(axes: Axes, trade: Trade, label: str) -> None:
    """Draw the points of a panel with their intervals, and the line of the reference."""
    best = trade.best(label)
    axes.axhline(1, color="0.85", lw=1, zorder=0)
    for point in trade.points:
        move, colour = point.moves[label], _colour(point, best, label)
        below, above = max(move.area - move.low, 0), max(min(move.high, MOST) - move.area, 0)
        axes.errorbar(
            *(point.map_s, move.area),
            yerr=[[below], [above]],
            fmt="o",
            ms=5,
            color=colour,
            ecolor=colour,
            elinewidth=0.8,
        )
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    moves = [point.moves[label] for point in trade.points]
    most = max(max(move.area, min(move.high, MOST)) for move in moves)
    least = min(move.low for move in moves)
    room = 0.12 * (most - least) + 0.02
    axes.set_ylim(least - room, most + room)
    axes.margins(x=0.12)


def _name(axes: Axes, trade: Trade, label: str) -> None:
    """Write labels beside the points of a panel."""
    best, names = trade.best(label), named(trade, label)

    def spot(point: Point) -> tuple[float, float]:
        return point.map_s, point.moves[label].area

    labels = [(point.shortcut.label, spot(point), _colour(point, best, label)) for point in names]
    label_points(axes, labels, avoid=[spot(point) for point in trade.points if point not in names])
