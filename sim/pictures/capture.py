"""The picture of a capture: position, velocity or acceleration, and force around its trigger, and the flags."""

from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from ...host.capture import Captured
from .style import FORCE, MARK, WALL, new_figure, page

FLAG_HEIGHT = 0.7
"""The height of a set flag's bar, as a fraction of its room."""


class Shows(Protocol):
    """A result with a capture."""

    captured: Captured


@page
def draw(shows: Shows) -> Figure:
    """Return the picture of a capture."""
    result = shows.captured
    time_ms, shown = 1e3 * result.time_s, [name for name in result.flag_names if result.flag(name).any()]
    figure = new_figure(6.4, _title(result))
    position, motion, force, flags = panels = figure.subplots(
        4, 1, sharex=True, height_ratios=(1.2, 1.2, 1.2, 0.2 + 0.16 * len(shown))
    )
    position.plot(time_ms, 1e3 * result.position_m, color="black", lw=1, drawstyle="steps-post")
    position.set_ylabel("position (mm)")
    if result.velocity_m_per_s is not None:
        motion.plot(time_ms, 1e3 * result.velocity_m_per_s, color=WALL, lw=0.9)
        motion.set_ylabel("velocity (mm/s)")
    if result.acceleration_m_per_s2 is not None:
        motion.plot(time_ms, result.acceleration_m_per_s2, color=WALL, lw=0.9)
        motion.set_ylabel("acceleration (m/s²)")
    force.plot(time_ms, result.force_n, color=FORCE, lw=0.9, drawstyle="steps-post")
    force.set_ylabel("force (N)")
    for row, name in enumerate(shown):
        edges = np.flatnonzero(np.diff(result.flag(name).astype(int), prepend=0, append=0)).reshape(-1, 2)
        spans = [(time_ms[begin], time_ms[min(end, len(time_ms) - 1)] - time_ms[begin]) for begin, end in edges]
        flags.broken_barh(spans, (row - FLAG_HEIGHT / 2, FLAG_HEIGHT), color="0.45")
    flags.set_yticks(range(len(shown)), shown)
    flags.set_ylim(len(shown) - 0.4, -0.6)
    flags.set_xlabel("time after the trigger (ms)")
    for axes in panels:
        axes.margins(x=0)
        axes.axvline(0, color=MARK, lw=0.9, ls="--")
    figure.align_ylabels(panels[:3])
    return figure


def _title(result: Captured) -> str:
    step_s = result.time_s[1] - result.time_s[0]
    return (
        f"capture of the board {result.identity}: {len(result.time_s)} records at {1e-3 / step_s:g} kHz\n"
        f"{result.place} of them before the trigger"
    )
