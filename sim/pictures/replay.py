"""The picture of a replay: counts and velocities over the recording, an enlarged piece of it, and the error there."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..estimates.replay import Replay
from .style import LABEL_PT, MARK, TRUTH, looks, name_above, new_figure, page

DETAIL_S = 0.4
BACKEND_NAMES = {"float": "float64", "fixed": "bit-accurate model", "rtl": "hardware, through its pins"}


@page
def draw(result: Replay) -> Figure:
    """Return the picture of a replay."""
    recording, time_s = result.recording, result.recording.time_s
    figure = new_figure(8.0, _title(result))
    counts, whole, detail, error = panels = figure.subplots(4, 1, height_ratios=(1, 1.4, 1.4, 1.2))
    counts.plot(time_s, recording.counts, color="black", lw=0.9, rasterized=True)
    counts.set_ylabel(f"{recording.column} (counts)")
    lines, reference = _lines(result), result.reference_counts_per_s
    first, last = _interesting(result)
    for axes, part in ((whole, slice(None)), (detail, slice(first, last))):
        axes.plot(time_s[part], reference[part], label=_reference(result), rasterized=axes is whole, **TRUTH)
        for label, values, style in lines:
            step = {"drawstyle": "steps-post"} if axes is detail else {"rasterized": True}
            axes.plot(time_s[part], values[part], label=label, **style, **step)
        axes.set_ylabel("velocity (counts/s)")
    for _, values, style in lines:
        error.plot(time_s[first:last], (values - reference)[first:last], drawstyle="steps-post", **style)
    error.axhline(0, color="black", lw=0.6)
    error.set_ylabel("error (counts/s)")
    error.set_title("estimate less reference", fontsize=LABEL_PT)
    name_above(whole, columns=1)
    detail.set_title("the marked piece", fontsize=LABEL_PT)
    whole.axvspan(time_s[first], time_s[last - 1], color=MARK, alpha=0.2, lw=0)
    for axes in panels:
        axes.margins(x=0)
        axes.ticklabel_format(axis="y", style="plain", useOffset=False)
    counts.sharex(whole)
    error.sharex(detail)
    for axes in (whole, error):
        axes.set_xlabel("time (s)")
    figure.align_ylabels(panels)
    return figure


def _title(result: Replay) -> str:
    recording, count = result.recording, result.coarsen
    seen = "" if count == 1 else f", seen {count} times coarser"
    return (
        f"{Path(recording.file).name}: {recording.column} at {recording.rate_hz:g} Hz{seen}\n"
        f"{_name(result)} ({BACKEND_NAMES[result.backend]})"
    )


def _name(result: Replay) -> str:
    return result.estimator if result.estimator == "fdm" else f"{result.estimator}, output {result.output}"


def _reference(result: Replay) -> str:
    return f"zero-phase reference, {result.reference_hz:g} Hz"


def _lines(result: Replay) -> list[tuple[str, np.ndarray, dict]]:
    """Return label, velocities and style of the finite difference and of the estimate, which lies on top."""

    def rms(value: float | None) -> str:
        return "" if value is None else f", RMS error {float(f'{value:.3g}'):g} counts/s"

    (own,) = looks([(result.estimator, "u")])
    difference = {"color": "0.55", "lw": 0.7}
    lines = [
        ("finite difference" + rms(result.rms_fdm_counts_per_s), result.difference_counts_per_s, difference),
        (_name(result) + rms(result.rms_counts_per_s), result.velocity_counts_per_s, {"color": own["color"], "lw": 1}),
    ]
    return lines[1:] if result.estimator == "fdm" else lines


def _interesting(result: Replay) -> tuple[int, int]:
    """Return the ends of the piece in which the reference changes most, after the first second of a longer record."""
    reference, rate = result.reference_counts_per_s, result.recording.rate_hz
    length = min(max(round(DETAIL_S * rate), 2), len(reference))
    begin = result.judged_from if len(reference) > result.judged_from + length else 0
    pieces = np.lib.stride_tricks.sliding_window_view(reference[begin:], length)
    first = begin + int(np.argmax(np.abs(pieces[:, -1] - pieces[:, 0])))
    return first, first + length
