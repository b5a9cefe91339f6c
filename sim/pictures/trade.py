"""The picture of speed against accuracy: what each shortcut of a simulation costs, and how wrong it is."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from ..studies.trade import HIT, MAP, Point, Question, Trade
from ..walls import methods
from .style import line_style

NUMBER_PT = 8
"""Size of a point's number."""
AROUND_PT = [
    radius * NUMBER_PT * np.array([np.sin(angle), np.cos(angle)])
    for radius in np.arange(1.5, 20.0, 0.5)
    for angle in np.linspace(0, 2 * np.pi, 16, endpoint=False)
]
"""Places for it, seen from the point, the nearest first."""


def plot_trade(trade: Trade) -> Figure:
    """Return the picture: a row an estimator; on the left its verdicts on walls, on the right the edge of its map."""
    picture = Figure(figsize=(14, 9.5), layout="constrained")
    panels = picture.subplots(len(trade.walls), 2, sharex="col", squeeze=False)
    for row, label in zip(panels, trade.walls, strict=True):
        for axes, question in zip(row, (HIT, MAP), strict=True):
            _draw(axes, trade, question, label)
        name = methods.methods()[label].label
        row[0].set_title(f"{name}: a hit, and {trade.walls[label]} walls around the edge", fontsize=10)
        row[0].set_ylabel("verdicts that differ (%)")
        row[1].set_title(f"{name}: a map, and its edge", fontsize=10)
        row[1].set_ylabel("error of K at the edge, largest over B (%)")
    panels[-1, 0].set_xlabel("time of a hit (ms)")
    panels[-1, 1].set_xlabel("time of the maps of all estimators, in one process (s)")
    controller, grid = trade.scene.controller, trade.scene.zwidth
    picture.suptitle(
        f"{trade.scene.name}: estimators at {controller.sample_hz / 1e3:g} kHz, force at "
        f"{controller.actuation_hz / 1e3:g} kHz; B of {grid.damping_from_n_s_per_m:g} to "
        f"{grid.damping_to_n_s_per_m:g} N s/m, K by {grid.stiffness_step_n_per_m / 1e3:g} kN/m"
    )
    keys = [
        Line2D([], [], label=f"{number}  {point.shortcut.label}", ls="", **_style(trade, point))
        for number, point in enumerate(trade.points, 1)
    ]
    keys += [
        Line2D([], [], label="none faster is as right", color="black", lw=1.2),
        Line2D([], [], label="within the scatter", color="0.88", lw=9),
    ]
    picture.legend(handles=keys, loc="outside right center", fontsize=8.5)
    picture.draw_without_rendering()
    for row, label in zip(panels, trade.walls, strict=True):
        for axes, question in zip(row, (HIT, MAP), strict=True):
            _number(axes, trade, question, label)
    return picture


def _style(trade: Trade, point: Point) -> dict:
    """Return colour and shape of a point, those of its axis."""
    index = list(dict.fromkeys(each.shortcut.axis for each in trade.points)).index(point.shortcut.axis)
    return line_style(index, 6)


def _spot(point: Point, question: Question, label: str) -> tuple[float, float]:
    """Return where a point is: time (ms of a hit, s of maps) and error (%)."""
    return question.cost_s(point) * (1e3 if question is HIT else 1.0), question.error(point, label) * 100


def _shown(trade: Trade, question: Question) -> list[Point]:
    """Return a panel's points: a map's steps are nothing to a hit."""
    return [point for point in trade.points if question is MAP or point.shortcut.coarser == 1]


def _draw(axes: Axes, trade: Trade, question: Question, label: str) -> None:
    """Draw a panel's points, the line through the best, and the scatter."""
    axes.axhspan(-100, trade.scatter(question, label) * 100, color="0.88", lw=0)
    best = [_spot(point, question, label) for point in trade.best(question, label)]
    axes.plot(*zip(*best, strict=True), color="black", lw=1.2, marker="o", ms=13, mfc="none")
    shown = _shown(trade, question)
    for point in shown:
        axes.plot(*_spot(point, question, label), ls="", alpha=0.8, **_style(trade, point))
    axes.set_xscale("log")
    axes.grid(alpha=0.3, which="both")
    most = max(_spot(point, question, label)[1] for point in shown)
    axes.set_ylim(-0.1 * most - 0.5, 1.15 * most + 1)


def _number(axes: Axes, trade: Trade, question: Question, label: str) -> None:
    """Number a panel's points, each in the nearest place that is free, with a line to its own."""
    numbered = [(number, point) for number, point in enumerate(trade.points, 1) if point in _shown(trade, question)]
    spots = [_spot(point, question, label) for _, point in numbered]
    places = [axes.transData.transform(spot) * 72 / axes.figure.dpi for spot in spots]
    taken = list(places)
    for (number, point), spot, own in zip(numbered, spots, places, strict=True):
        offset = next(each for each in AROUND_PT if _free(own + each, taken))
        taken.append(own + offset)
        colour = _style(trade, point)["color"]
        style = {"fontsize": NUMBER_PT, "color": colour, "ha": "center", "va": "center", "textcoords": "offset points"}
        line = {"arrowstyle": "-", "color": colour, "lw": 0.5, "shrinkA": 0, "shrinkB": 0}
        edge = [withStroke(linewidth=2, foreground="white")]
        axes.annotate(str(number), spot, offset, arrowprops=line, path_effects=edge, **style)


def _free(place: np.ndarray, taken: list[np.ndarray]) -> bool:
    """Return whether a number has room at a place, points."""
    return all(abs(place[0] - x) > 1.4 * NUMBER_PT or abs(place[1] - y) > 1.1 * NUMBER_PT for x, y in taken)
