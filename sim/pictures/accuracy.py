"""Pictures of accuracy: estimates of a motion over time, the founding paper's Figure 1, and error against rate."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..estimates import signals
from ..estimates.accuracy import axis_spec, encoder_of, errors_of, exact_velocity, said_of
from ..estimates.figures import lower_bound_m_per_s, window_floor_m_per_s
from ..estimates.playback import velocities
from ..studies.accuracy import Accuracy
from ..studies.rendered_setting import rate_text
from ..walls.methods import Curve
from .labels import label_right
from .style import LABEL_PT, MARK, THEORY, TRUTH, ink, looks, name_above, new_figure, page

PIECES = {"from the start": (0.0, 0.06), "where it turns": (1.2, 1.28)}
"""The pieces of Figure 1 that are enlarged, s."""
LEAST_MM_S = 1e-6
"""The least error that is drawn, also for smaller errors: a logarithmic axis has no zero."""


@page
def draw(accuracy: Accuracy) -> Figure:
    """Return the founding paper's Figure 1 if it was measured, else the picture of the error against the rate."""
    if accuracy.figure == 1:
        return _figure_1(accuracy.curves, accuracy.rows)
    return _against_rate(accuracy.rows, accuracy.labels)


def _figure_1(curves: list[Curve], rows: list[dict]) -> Figure:
    """Return the paper's Figure 1: estimates of a decaying sine over time, their error, and enlarged pieces.

    Args:
        curves: the estimators.
        rows: results of `accuracy.measure`, one for every curve, with its rate, backend, gains and encoder.
    """
    signal, backend, sample_hz = signals.load("paper"), rows[0]["backend"], rows[0]["sample_hz"]
    title = f"50 exp(-t) sin(2πt) mm, counts of 1 µm at {sample_hz / 1e3:g} kHz, {backend}"
    picture = new_figure(7.0, title)
    panels = picture.subplot_mosaic("aa;ee;bc", height_ratios=(1.1, 1, 1.2))
    times = np.arange(int(signal.seconds * sample_hz)) / sample_hz
    exact = exact_velocity(signal.motion, times) * 1e3
    drawn = [panels["a"], panels["b"], panels["c"]]
    for axes in drawn:
        axes.plot(times, exact, label="exact derivative", **TRUTH)
    styles = looks([(curve.estimator, curve.output) for curve in curves])
    for index, (curve, row, style) in enumerate(zip(curves, rows, styles, strict=True)):
        spec = axis_spec(row["estimator"], sample_hz, row["acceleration_max_mm_s2"] / 1e3, row["gains"])
        parts = velocities(signal, spec, row["output"], backend, *errors_of(encoder_of(row)))
        estimate = np.concatenate([part for _, part, _ in parts]) * 1e3
        # The first curve is on top, as a chattering curve would hide a lagging curve; the others are translucent.
        line = {"color": style["color"], "lw": 0.9, "zorder": 3 - index / len(curves), "alpha": 0.5 if index else 1.0}
        for axes in drawn:
            axes.plot(times, estimate, label=curve.label, **line)
        panels["e"].plot(times, estimate - exact, label=f"{curve.label}: RMS {row['rms_mm_s']:.3g} mm/s", **line)
    # An estimate begins far off, so the error is framed from where it is judged.
    judged = times >= signal.judged_from_s
    _frame(panels["e"], [line.get_ydata()[judged] for line in panels["e"].lines])
    for axes in panels.values():
        axes.set_xlabel("time (s)")
        axes.set_ylabel("error (mm/s)" if axes is panels["e"] else "velocity (mm/s)")
    for name, columns in (("a", 3), ("e", 1)):
        name_above(panels[name], columns)
        panels[name].set_xlim(0, signal.seconds)
    panels["e"].axvline(signal.judged_from_s, color=MARK, lw=0.9, ls="--")
    panels["e"].annotate(
        "judged from here", (signal.judged_from_s, 0.97), (3, 0), xycoords=("data", "axes fraction"), va="top",
        textcoords="offset points", color=MARK, fontsize=LABEL_PT, bbox={"fc": "white", "lw": 0, "pad": 1},
    )  # fmt: skip
    for axes, (title, (begin, end)) in zip((panels["b"], panels["c"]), PIECES.items(), strict=True):
        inside = exact[(times >= begin) & (times <= end)]
        axes.set_title(title, fontsize=LABEL_PT)
        axes.set_xlim(begin, end)
        axes.set_ylim(inside.min() - 3, inside.max() + 3)
    panels["b"].set_ylim(0, 400)
    return picture


def _frame(axes: Axes, curves: list[np.ndarray]) -> None:
    """Set the limits of a panel by these curves, symmetric about zero."""
    largest = 1.1 * max(float(np.abs(curve).max()) for curve in curves)
    axes.set_ylim(-largest, largest)
    axes.axhline(0, color="black", lw=0.6)


def _against_rate(rows: list[dict], labels: list[str]) -> Figure:
    """Return the picture of the RMS error against the sample rate, with a curve for every label.

    Args:
        rows: results of `accuracy.measure`, all of one signal.
        labels: labels of the rows.
    """
    first = rows[0]
    phase = first["encoder_phase_error_counts"]
    encoder = f", encoder out of phase by {phase:g} counts" if phase else ""
    if "encoder" in first:
        encoder = f",\nencoder with {said_of(encoder_of(first))}"
    said = f'RMS error on the signal "{first["signal"]}", counts of 1 µm, {first["backend"]}{encoder}'
    picture = new_figure(6.0, _message(rows, labels) + said)
    axes = picture.subplots()
    curves = {label: (row["estimator"], row["output"]) for row, label in zip(rows, labels, strict=True)}
    ends = []
    for (name, (estimator, _)), style in zip(curves.items(), looks(list(curves.values())), strict=True):
        points = [
            (row["sample_hz"], max(row["rms_mm_s"], LEAST_MM_S))
            for row, label in zip(rows, labels, strict=True)
            if label == name
        ]
        points.sort()
        axes.plot(*zip(*points, strict=True), **style)
        ends.append((name, points[-1][1], ink(estimator)))
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends += _bounds(axes, rows)
    axes.set_xlabel("sample rate (Hz)")
    axes.set_ylabel("RMS error (mm/s)")
    axes.margins(x=0.02)
    axes.set_ylim(*axes.get_ylim())
    label_right(axes, ends)
    return picture


def _message(rows: list[dict], labels: list[str]) -> str:
    """Return a line of the title: the estimator whose error grows most with the rate, and the best one; none for one
    rate."""
    first, last = (pick(row["sample_hz"] for row in rows) for pick in (min, max))
    errors = {(label, row["sample_hz"]): row["rms_mm_s"] for row, label in zip(rows, labels, strict=True)}
    if first == last or not all((label, hz) in errors for label in labels for hz in (first, last)):
        return ""
    times = {label: errors[label, last] / max(errors[label, first], LEAST_MM_S) for label in labels}
    worst, best = max(times, key=times.__getitem__), min(labels, key=lambda label: errors[label, last])
    ends = f"from {rate_text(first)} to {rate_text(last)}"
    return f"{best} has the least error at {rate_text(last)}; that of {worst} grows {times[worst]:.3g} times {ends}\n"


def _bounds(axes: Axes, rows: list[dict]) -> list[tuple[str, float, str]]:
    """Draw the two lines of theory; return their labels, heights and colours."""
    signal = signals.load(rows[0]["signal"])
    rates = sorted({row["sample_hz"] for row in rows})
    bound = lower_bound_m_per_s(signal.acceleration_max_m_per_s2) * 1e3
    floor = [window_floor_m_per_s(signal, rate) * 1e3 for rate in rates]
    axes.axhline(bound, color=THEORY, ls="--", lw=1)
    axes.plot(rates, floor, color=THEORY, ls=":", lw=1.3)
    return [
        (f"2√(Cε) = {bound:.3g}: no smaller\nlargest error is sure", bound, THEORY),
        ("difference over 2√(ε/C):\nRMS by its formula", floor[-1], THEORY),
    ]
