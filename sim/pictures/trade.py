"""Pictures of speed against accuracy: the time and the error of every shortcut of a simulation."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.shortcuts import SCATTER
from ..studies.trade import HIT, MAP, Point, Question, Trade
from ..walls import methods
from .labels import label_points
from .style import COLOURS, LABEL_PT, THEORY, lay_out, new_figure, page, plain_decades

NAMED = 8
"""The largest number of settings of a panel that are labelled."""
BEST, PLAIN = COLOURS["butterworth"], "0.55"
NOTES = (
    "blue, on the line: no setting is both faster and more right; those without a name are in the command's table\n"
    "grey band: so much is chance, for a handle that is 0.1 % heavier or lighter changes as much"
)
QUESTIONS = {
    HIT: ("time of a hit (ms)", "verdicts that differ (%)", "is a wall stable? {walls} walls around the edge"),
    MAP: ("time of both maps, in one process (s)", "largest error of K (%)", "where is the edge?"),
}


@page
def draw(trade: Trade) -> dict[str, Figure]:
    """Return the pictures of the questions, `hit` and `map`: a panel for every estimator, error against time."""
    return {question.name: _picture(trade, question) for question in QUESTIONS}


def _picture(trade: Trade, question: Question) -> Figure:
    """Return the picture of one question."""
    time, error, asked = QUESTIONS[question]
    controller, grid = trade.scene.controller, trade.scene.zwidth
    title = (
        f"What a faster simulation of a {question.name} gets wrong\n{trade.scene.name}: samples at "
        f"{controller.sample_hz / 1e3:g} kHz, force at {controller.actuation_hz / 1e3:g} kHz; "
        f"B of {grid.damping_from_n_s_per_m:g} to {grid.damping_to_n_s_per_m:g} N s/m, K by "
        f"{grid.stiffness_step_n_per_m / 1e3:g} kN/m"
    )
    picture = new_figure(0.9 + 3.2 * len(trade.walls), title)
    panels = picture.subplots(len(trade.walls), sharex=True, squeeze=False)[:, 0]
    for axes, label in zip(panels, trade.walls, strict=True):
        name = methods.methods()[label].label
        axes.set_title(f"{name}: {asked.format(walls=trade.walls[label])}")
        axes.set_ylabel(error)
        _draw(axes, trade, question, label)
    panels[-1].set_xlabel(time)
    picture.align_ylabels(panels)
    picture.supxlabel(NOTES, x=0.01, ha="left", fontsize=LABEL_PT, color=THEORY)
    lay_out(picture)
    for axes, label in zip(panels, trade.walls, strict=True):
        _name(axes, trade, question, label)
    return picture


def _spot(point: Point, question: Question, label: str) -> tuple[float, float]:
    """Return the coordinates of a point: time (ms for a hit, s for maps) and error (%)."""
    return question.cost_s(point) * (1e3 if question is HIT else 1.0), question.error(point, label) * 100


def _shown(trade: Trade, question: Question) -> list[Point]:
    """Return the points of a panel; shortcuts of a map's steps are left out for a hit, which they do not change."""
    return [point for point in trade.points if question is MAP or point.shortcut.coarser == 1]


def named(trade: Trade, question: Question, label: str) -> list[Point]:
    """Return the points of a panel that are labelled, at most `NAMED`.

    They are the reference, the best, the slowest, and the boldest shortcut of every axis, which is the first of the
    axis.
    """
    best, shown = trade.best(question, label), _shown(trade, question)
    chosen = [trade.points[0], best[0], best[-1], max(shown, key=question.cost_s), *best]
    chosen += {point.shortcut.axis: point for point in reversed(shown) if point.shortcut.axis != SCATTER}.values()
    distinct = [point for number, point in enumerate(chosen) if point not in chosen[:number]]
    return distinct[:NAMED]


def _draw(axes: Axes, trade: Trade, question: Question, label: str) -> None:
    """Draw the points of a panel, the line through the best points, and the scatter."""
    scatter = trade.scatter(question, label) * 100
    axes.axhspan(-100, scatter, color="0.92", lw=0)
    best = trade.best(question, label)
    shown = _shown(trade, question)
    axes.plot(*zip(*(_spot(point, question, label) for point in best), strict=True), color=BEST, lw=1.2)
    for point in shown:
        colour = BEST if point in best else PLAIN
        axes.plot(*_spot(point, question, label), ls="", marker="o", ms=5, color=colour)
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    most = max(_spot(point, question, label)[1] for point in shown)
    axes.set_ylim(-0.12 * most - 0.5, 1.2 * most + 1)
    axes.margins(x=0.1)


def _name(axes: Axes, trade: Trade, question: Question, label: str) -> None:
    """Write labels beside the points of a panel."""
    best, names = trade.best(question, label), named(trade, question, label)
    labels = [
        (point.shortcut.label, _spot(point, question, label), BEST if point in best else "0.25") for point in names
    ]
    others = [_spot(point, question, label) for point in _shown(trade, question) if point not in names]
    label_points(axes, labels, avoid=others, lines=[[_spot(point, question, label) for point in best]])
