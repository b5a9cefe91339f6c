"""A picture of a replay: the recorded counts, the velocities over the whole recording, and a piece of it enlarged."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..estimates.reference import judged_from
from ..estimates.replay import Replay, ReplayError
from .style import SUFFIXES, save

DETAIL_S = 0.4
BACKEND_NAMES = {"float": "float64", "fixed": "bit-accurate model", "rtl": "hardware, through its pins"}
ESTIMATE, BASELINE, REFERENCE = "tab:blue", "0.75", "black"


def figure(result: Replay) -> Figure:
    """Return the picture."""
    recording, count = result.recording, result.coarsen or 1
    time_s = recording.time_s
    fig = Figure(figsize=(9, 9), layout="constrained")
    counts, whole, detail = fig.subplots(3, 1, height_ratios=(1, 1.5, 1.7))

    counts.plot(time_s, recording.counts, color="black", linewidth=0.9, rasterized=True)
    counts.set_ylabel(f"{recording.column} (counts)")
    name = result.estimator if result.estimator == "fdm" else f"{result.estimator}, output {result.output}"
    seen = "" if count == 1 else f", seen {count} times coarser"
    counts.set_title(
        f"{Path(recording.file).name}: {recording.column} at {recording.rate_hz:g} Hz{seen}\n"
        f"{name} ({BACKEND_NAMES[result.backend]})"
    )

    def rms(value: float | None) -> str:
        return "" if value is None else f", RMS error {value:.0f} counts/s"

    lines = [
        ("finite difference" + rms(result.rms_fdm_counts_per_s), result.difference_counts_per_s, BASELINE, 0.8),
        (name + rms(result.rms_counts_per_s), result.velocity_counts_per_s, ESTIMATE, 1.0),
        (f"zero-phase reference, {result.reference_hz:g} Hz", result.reference_counts_per_s, REFERENCE, 1.4),
    ]
    if result.estimator == "fdm":
        lines.pop(0)
    first, last = _interesting(result)
    for axes, part in ((whole, slice(None)), (detail, slice(first, last))):
        for label, values, colour, width in lines:
            style = "steps-post" if axes is detail and colour != REFERENCE else "default"
            axes.plot(
                time_s[part],
                values[part],
                color=colour,
                linewidth=width if axes is detail else 0.6 * width,
                drawstyle=style,
                label=label,
                rasterized=axes is whole,
            )
        axes.set_ylabel("velocity (counts/s)")
        axes.margins(x=0)
    counts.margins(x=0)
    counts.sharex(whole)
    whole.axvspan(time_s[first], time_s[last - 1], color="tab:orange", alpha=0.25, linewidth=0, label="enlarged below")
    legend = whole.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize="small", frameon=False)
    for handle in legend.legend_handles[: len(lines)]:
        handle.set_linewidth(2)
    for axes in (whole, detail):
        axes.set_xlabel("time (s)")
    for axes in (counts, whole, detail):
        axes.grid(alpha=0.3)
        axes.ticklabel_format(axis="y", style="plain", useOffset=False)
    return fig


def _interesting(result: Replay) -> tuple[int, int]:
    """Return the ends of the piece over which the reference changes most, after the first second if there is more."""
    reference, rate = result.reference_counts_per_s, result.recording.rate_hz
    length = min(max(round(DETAIL_S * rate), 2), len(reference))
    begin = judged_from(rate) if len(reference) > judged_from(rate) + length else 0
    pieces = np.lib.stride_tricks.sliding_window_view(reference[begin:], length)
    first = begin + int(np.argmax(np.abs(pieces[:, -1] - pieces[:, 0])))
    return first, first + length


def plot_replay(result: Replay, path: str | Path) -> None:
    """Write the picture of a replay to a file.

    Args:
        result: the replay.
        path: ends in one of `SUFFIXES`.

    Raises:
        ReplayError: for another ending.
        OSError: if the file cannot be written.
    """
    if Path(path).suffix not in SUFFIXES:
        raise ReplayError(f"the name of a plot must end in {', '.join(SUFFIXES)}, not {str(path)!r}")
    save(figure(result), Path(path))
