"""Pictures of accuracy: the founding paper's two figures, and error against rate."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..estimates import signals
from ..estimates.accuracy import axis_spec, exact_velocity
from ..estimates.figures import lower_bound_m_per_s, window_floor_m_per_s
from ..estimates.playback import velocities
from ..walls.methods import Curve, label
from ..world.encoder import offsets
from .style import MARKERS

REACHING_S = (0.0, 0.06)
TURNING_S = (1.2, 1.28)
LEAST_MM_S = 1e-6
"""What is less is drawn as this: an axis of decades has no zero."""


def figure_1(curves: list[Curve], rows: list[dict]) -> Figure:
    """Return the paper's first figure: estimates of a decaying sine over time, and two pieces of it enlarged.

    Args:
        curves: what to draw.
        rows: of `accuracy.measure`, one for each: at which rate, on which backend, with which gains and encoder.
    """
    signal, backend, sample_hz = signals.load("paper"), rows[0]["backend"], rows[0]["sample_hz"]
    picture = Figure(figsize=(10, 7), layout="constrained")
    panels = picture.subplot_mosaic("aa;bc", height_ratios=(1, 1.2))
    times = np.arange(int(signal.seconds * sample_hz)) / sample_hz
    exact = exact_velocity(signal.motion, times)
    for index, (curve, row) in enumerate(zip(curves, rows, strict=True)):
        spec = axis_spec(row["estimator"], sample_hz, row["acceleration_max_mm_s2"] / 1e3, row["gains"])
        parts = velocities(signal, spec, row["output"], backend, offsets(row["encoder_phase_error_counts"]))
        estimate = np.concatenate([part for _, part, _ in parts])
        for axes in panels.values():
            # The first on top: what chatters hides what lags.
            axes.plot(times, estimate * 1e3, lw=0.9, label=curve.label, zorder=3 - index / len(curves))
    for axes in panels.values():
        axes.plot(times, exact * 1e3, color="black", lw=0.9, label="exact derivative", zorder=4)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("velocity (mm/s)")
        axes.grid(alpha=0.3)
    panels["a"].set_title(f"50 exp(-t) sin(2πt) mm, counts of 1 µm at {sample_hz / 1e3:g} kHz, {backend}")
    panels["a"].legend(fontsize=8)
    panels["a"].margins(x=0)
    for name, (begin, end), title in (("b", REACHING_S, "from the start"), ("c", TURNING_S, "where it turns")):
        inside = (times >= begin) & (times <= end)
        low, high = exact[inside].min() * 1e3, exact[inside].max() * 1e3
        panels[name].set_xlim(begin, end)
        panels[name].set_title(title)
        panels[name].set_ylim(low - 3, high + 3)
    panels["b"].set_ylim(0, 400)
    return picture


def against_rate(rows: list[dict], labels: list[str]) -> Figure:
    """Return the picture of the RMS error against the sample rate, a curve for each label.

    Args:
        rows: of `accuracy.measure`, all of one signal.
        labels: what each row is called.
    """
    picture = Figure(figsize=(10, 8), layout="constrained")
    axes = picture.subplots()
    names = list(dict.fromkeys(labels))
    colours = mpl.colormaps["tab20"].colors
    for index, name in enumerate(names):
        points = [
            (row["sample_hz"], max(row["rms_mm_s"], LEAST_MM_S))
            for row, of in zip(rows, labels, strict=True)
            if of == name
        ]
        style = {"color": colours[index % 20], "marker": MARKERS[index % len(MARKERS)], "ms": 4, "lw": 1.3}
        axes.plot(*zip(*sorted(points), strict=True), label=name, **style)
    _bounds(axes, rows)
    first = rows[0]
    phase = first["encoder_phase_error_counts"]
    encoder = f", encoder out of phase by {phase:g} counts" if phase else ""
    axes.set_title(f"signal {first['signal']}, counts of 1 µm, {first['backend']}{encoder}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("sample rate (Hz)")
    axes.set_ylabel("RMS error (mm/s)")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=7.5, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return picture


def _bounds(axes: Axes, rows: list[dict]) -> None:
    """Draw the two lines of theory."""
    signal = signals.load(rows[0]["signal"])
    rates = sorted({row["sample_hz"] for row in rows})
    bound = lower_bound_m_per_s(signal.acceleration_max_m_per_s2) * 1e3
    floor = [window_floor_m_per_s(signal, rate) * 1e3 for rate in rates]
    axes.axhline(bound, color="black", ls="--", lw=1, label=f"2√(Cε) = {bound:.3g}: no smaller largest error is sure")
    axes.plot(rates, floor, color="black", ls=":", lw=1.3, label="difference over 2√(ε/C): RMS by its formula")


def what_a_bit_buys(rows: list[dict]) -> Figure:
    """Return the picture of error against the velocity's width, and against logic, a curve for each estimator's output.

    Args:
        rows: of `bits.bit`.
    """
    picture = Figure(figsize=(12, 6), layout="constrained")
    by_width, by_logic = picture.subplots(1, 2, sharey=True)
    names = list(dict.fromkeys((row["estimator"], row["output"]) for row in rows))
    colours = mpl.colormaps["tab20"].colors
    for index, (estimator, output) in enumerate(names):
        own = [row for row in rows if (row["estimator"], row["output"]) == (estimator, output)]
        errors = [row["rms_mm_s"] for row in own]
        style = {"color": colours[index % 20], "marker": MARKERS[index % len(MARKERS)], "ms": 4, "lw": 1.2}
        by_width.plot([row["velocity_bits"] for row in own], errors, label=label(estimator, output), **style)
        by_logic.plot([row["lut4"] for row in own], errors, **style)
        # The widths that follow from the spec.
        for axes, key in ((by_width, "velocity_bits"), (by_logic, "lut4")):
            axes.plot(own[0][key], errors[0], marker="o", ms=9, mfc="none", mec=style["color"])
    by_width.set_xlabel("bits of the velocity")
    by_logic.set_xlabel("LUT4 of the estimator alone (ECP5)")
    by_width.set_ylabel("RMS error (mm/s)")
    by_width.set_yscale("log")
    for axes in (by_width, by_logic):
        axes.grid(alpha=0.3, which="both")
    picture.suptitle(f"the paper's signal at {rows[0]['sample_hz'] / 1e6:g} MHz; circles: the derived widths")
    picture.legend(loc="outside right center", fontsize=8)
    return picture
