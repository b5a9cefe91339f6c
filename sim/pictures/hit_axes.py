"""The picture of the hits of several axes."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..walls.hit import Hit
from ..walls.hit_axes import AxesHit
from .style import FORCE, MARK, WALL, length_text, new_figure, page

ROW_IN, TITLE_IN = 1.3, 0.8
"""The heights of an axis's row, and of the title."""


@page
def draw(result: AxesHit) -> Figure:
    """Return the picture of hits with traces: a row for each axis, position on the left and force on the right.

    A row has the samples of the whole run at equal distances; its force is the range from each of them to the next.
    """
    scene, spec = result.scene, result.scene.spec
    stable = sum(each.stable for each in result.hits.values())
    figure = new_figure(
        TITLE_IN + ROW_IN * len(result.hits),
        f"{scene.name}: {len(result.hits)} axes, {spec.estimator} on {result.backend}; samples at "
        f"{spec.sample_hz / 1e3:g} kHz, force at {spec.actuation_hz / 1e3:g} kHz\n"
        f"{stable} of {len(result.hits)} walls are stable",
    )
    rows = figure.subplots(len(result.hits), 2, sharex=True, squeeze=False)
    for (position, force), (name, each) in zip(rows, result.hits.items(), strict=True):
        _position(position, name, each)
        _force(force, each)
    rows[0, 0].legend(loc="lower right", ncols=2)
    for panel in rows[-1]:
        panel.set_xlabel("time (s)")
    figure.align_ylabels(rows[:, 0])
    figure.align_ylabels(rows[:, 1])
    return figure


def _position(panel: Axes, name: str, each: Hit) -> None:
    """Draw where a handle is, the wall, and from when on it is judged."""
    trace = each.overview
    panel.plot(trace.time_s, trace.position_m * 1e3, color="black", lw=1)
    low, high = panel.get_ylim()
    panel.axhspan(0, max(high, 0), color=WALL, alpha=0.12, lw=0, label="wall")
    panel.set_ylim(low, high)
    panel.axvline(each.scene.protocol.settle_s, color=MARK, lw=0.9, ls="--", label="judged from here")
    panel.set_title(name)
    panel.set_ylabel("position (mm)")


def _force(panel: Axes, each: Hit) -> None:
    """Draw the range of the wall's force, with the verdict beside it."""
    trace, wall = each.overview, each.scene.wall
    panel.fill_between(trace.time_s, trace.force_least_n, trace.force_largest_n, step="post", color=FORCE, lw=0.9)
    moves = length_text(each.rms_m)
    settled = moves if moves == "at rest" else f"RMS {moves}"
    verdict = f"{each.verdict}, {settled}"
    panel.set_title(f"{wall.stiffness_n_per_m / 1e3:g} kN/m, {wall.damping_n_s_per_m:g} N s/m: {verdict}", loc="right")
    panel.set_ylabel("force (N)")
