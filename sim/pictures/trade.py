"""The picture of what moves the edge of the stable walls: the area with every setting that moves it, beside chance."""

import math

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.shortcuts import SCATTER
from ..studies.trade import Point, Trade
from ..walls import methods
from .style import LABEL_PT, THEORY, ink, lay_out, looks, new_figure, page

ROWS = 12
"""The largest number of settings in the picture: the ones that move the edge most."""
MOST = 4.0
"""The ratio of areas at which an interval is cut off that has no end, or a far one."""
LEAST = 0.05
"""The ratio of areas at which an interval is cut off that goes on to zero."""
TICKS = 0.1, 0.2, 0.5, 1, 2, 4
"""The ratios of areas that an axis names."""
APART = 0.3
"""The distance of two estimators in a row, in rows."""


@page
def draw(trade: Trade) -> Figure:
    """Return a row for every setting that moves the edge: the areas of the estimators over the reference's."""
    rows = moving(trade)
    controller, grid = trade.scene.controller, trade.scene.zwidth
    title = (
        f"{_message(rows)}\n{trade.scene.name}: samples at "
        f"{controller.sample_hz / 1e3:g} kHz, force at {controller.actuation_hz / 1e3:g} kHz; "
        f"B of {grid.damping_from_n_s_per_m:g} to {grid.damping_to_n_s_per_m:g} N s/m, K by "
        f"{grid.stiffness_step_n_per_m / 1e3:g} kN/m, {trade.starts} starts"
    )
    picture = new_figure(1.5 + 0.3 * len(rows), title)
    axes = picture.subplots()
    curves = [methods.methods()[label] for label in trade.labels]
    styles = looks([(curve.estimator, curve.output) for curve in curves])
    for number, (label, curve, style) in enumerate(zip(trade.labels, curves, styles, strict=True)):
        shift = APART * (number - (len(curves) - 1) / 2)
        _draw(axes, [point.moves[label] for point in rows], shift, style | {"label": curve.label})
    axes.axvline(1, color=THEORY, lw=1, zorder=1)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    ticks = [each for each in TICKS if low <= each <= high]
    axes.set_xticks(ticks, [f"{each:g}" for each in ticks])
    axes.set_xlim(low, high)
    axes.minorticks_off()
    axes.set_yticks(range(len(rows)), [point.shortcut.label for point in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("area of the stable walls (1: the area with all parts)")
    for text, color in zip(_names(axes), [ink(curve.estimator) for curve in curves], strict=True):
        text.set_color(color)
    notes = (
        "bars: 95 of 100 draws of the starts; the last row, of handles hardly heavier or lighter, is what chance does"
    )
    picture.supxlabel(notes, x=0.01, ha="left", fontsize=LABEL_PT, color=THEORY)
    lay_out(picture)
    return picture


def moving(trade: Trade) -> list[Point]:
    """Return the points that are drawn: single settings that move an edge, by their areas, and the worst control."""
    single = [point for point in trade.points[1:] if " + " not in point.shortcut.label]
    controls = [point for point in single if point.shortcut.axis == SCATTER]
    moved = [point for point in single if point not in controls and any(move.moved for move in point.moves.values())]
    chosen = sorted(moved, key=_farthest)[-ROWS:]
    return [*sorted(chosen, key=_area, reverse=True), *sorted(controls, key=_farthest)[-1:]]


def _farthest(point: Point) -> float:
    """Return by how much a setting moves the edge of some estimator, as a logarithm."""
    return max(abs(math.log(max(move.area, LEAST))) for move in point.moves.values())


def _area(point: Point) -> float:
    """Return the product of a setting's areas: the settings are shown in this order."""
    return math.prod(max(move.area, LEAST) for move in point.moves.values())


def _message(rows: list[Point]) -> str:
    """Return which of some settings gives the largest area, and which takes most, as a title."""
    moved = [point for point in rows if point.shortcut.axis != SCATTER]
    areas = [(move.area, point.shortcut.label) for point in moved for move in point.moves.values()]
    if not areas:
        return "No setting moves the edge of the stable walls"
    (most, gain), (least, loss) = max(areas), min(areas)
    return f"Most walls are stable {gain} ({most:.2g} times the area);\nfewest: {loss} ({least:.2g} times)"


def _draw(axes: Axes, moves: list, shift: float, style: dict) -> None:
    """Draw the areas of an estimator with their intervals, a row each."""
    places = [row + shift for row in range(len(moves))]
    areas = [min(max(move.area, LEAST), MOST) for move in moves]
    below = [max(area - max(move.low, LEAST), 0) for area, move in zip(areas, moves, strict=True)]
    above = [max(min(move.high, MOST) - area, 0) for area, move in zip(areas, moves, strict=True)]
    axes.errorbar(areas, places, xerr=[below, above], elinewidth=1.0, **style | {"ls": "", "ms": 5})


def _names(axes: Axes) -> list:
    """Write the names of the estimators above the panel; return their texts."""
    legend = axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=2, frameon=False, borderaxespad=0.2)
    return legend.get_texts()
