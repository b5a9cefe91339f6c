"""The picture of a hit: position, velocity, error of the estimate, and force, over the whole run and the contact."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..loop.record import Overview, Trace
from ..walls.hit import Hit
from .style import FORCE, LABEL_PT, MARK, THEORY, TRUTH, WALL, length_text, looks, name_above, new_figure, page

OFFSET = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "fontsize": LABEL_PT}
TRUTH_SHARE = 0.025
"""The width of the line of the truth as a share of a panel's height; an estimate that scatters more hides that line."""
OVER = {"color": "black", "lw": 0.8, "zorder": 3}
"""The style of the truth over an estimate that would hide it."""
UNITS = ("position (mm)", "velocity (m/s)", "error (mm/s)", "force (N)")


@page
def draw(hit: Hit) -> Figure:
    """Return the picture of a hit with traces: the whole run on the left, its first contact on the right.

    The whole run has more samples than the picture has points. So its estimate and its force are drawn as the range
    from each kept sample up to the next.

    Below the estimate is its error, together with the error of the finite difference of counts without encoder errors:
    the baseline that an estimator should beat.
    """
    figure = new_figure(7.5, _title(hit))
    axes = figure.subplots(4, 2, sharex="col", width_ratios=(1, 1.25), height_ratios=(1, 1.2, 1, 1))
    _column(axes[:, 0], hit.overview, hit.overview.time_s, hit, zoomed=False)
    settle = hit.scene.protocol.settle_s
    axes[0, 0].axvline(settle, color=MARK, lw=0.9, ls="--")
    axes[0, 0].annotate(
        "judged from here", (settle, 0.05), xycoords=("data", "axes fraction"), color=MARK, rotation=90, ha="right",
        fontsize=LABEL_PT,
    )  # fmt: skip
    axes[0, 0].set_title("whole run")
    axes[-1, 0].set_xlabel("time (s)")
    for panel, unit in zip(axes[:, 0], UNITS, strict=True):
        panel.set_ylabel(unit)
    figure.align_ylabels(axes[:, 0])
    if len(hit.detail.time_s):
        contact = _first_contact(hit)
        _column(axes[:, 1], contact, (contact.time_s - hit.contact_s) * 1e3, hit, zoomed=True)
        axes[0, 1].set_title(f"first contact, at {hit.contact_s:.4f} s")
        axes[-1, 1].set_xlabel("time after contact (ms)")
    else:
        for panel in axes[:, 1]:
            panel.set_axis_off()
        axes[0, 1].set_title("the handle never reached the wall")
    return figure


def _first_contact(hit: Hit) -> Trace:
    """Return the trace until the handle has left the wall for a quarter of the contact's length."""
    if hit.contact is None:
        return hit.detail
    begin, end = hit.contact.start, hit.contact.stop
    last = end + (end - begin) // 4
    return Trace(**{key: array[:last] for key, array in vars(hit.detail).items()})


def _title(hit: Hit) -> str:
    scene, spec = hit.scene, hit.scene.spec
    moves = length_text(hit.rms_m)
    settled = moves if moves == "at rest" else f"RMS of position {moves}"
    through = "" if scene.coupling is None else f" behind {scene.coupling.stiffness_n_per_m / 1e3:g} kN/m"
    return (
        f"{scene.name}: {scene.controller.estimator}, output {scene.estimator_output}, on {hit.backend}; samples at "
        f"{spec.sample_hz / 1e3:g} kHz, force at {spec.actuation_hz / 1e3:g} kHz\n"
        f"wall of {scene.wall.stiffness_n_per_m / 1e3:g} kN/m, {scene.wall.damping_n_s_per_m:g} N s/m{through}: "
        f"{hit.verdict}; "
        f"{settled} (the threshold is {length_text(scene.protocol.threshold_mm * 1e-3)})"
    )


def _column(axes: np.ndarray, trace: Trace, time: np.ndarray, hit: Hit, zoomed: bool) -> None:
    """Fill one column of four panels; the names of the lines are in the right column, which has room for them."""
    position, velocity, error, force = axes
    position.plot(time, trace.position_m * 1e3, color="black", lw=1)
    low, high = position.get_ylim()
    position.axhspan(0, max(high, 0), color=WALL, alpha=0.12, lw=0)
    position.set_ylim(low, high)
    if zoomed:
        position.annotate("wall", (1, high), (-4, -4), color=WALL, va="top", ha="right", **OFFSET)

    name = hit.scene.controller.estimator
    (style,) = looks([(name, "u")])
    line = {"color": style["color"], "lw": 0.9, "zorder": 2.2}
    true, least, largest = trace.velocity_m_per_s, *_error(trace)
    _frame(velocity, true, true + least, true + largest)
    hidden = np.quantile(largest, 0.9) - np.quantile(least, 0.1) > TRUTH_SHARE * np.ptp(velocity.get_ylim())
    velocity.plot(time, true, label="true", **(OVER if hidden else TRUTH))
    label = f"estimate ({name} {hit.scene.estimator_output})"
    _draw(velocity, time, true + least, true + largest, label=label, **line)

    if zoomed and name != "fdm":
        q, rate = hit.scene.spec.count_m, hit.scene.spec.sample_hz
        baseline = np.diff(np.floor(trace.position_m / q)) * (q * rate) - true[1:]
        # The smaller of the two errors lies on top.
        below = np.std(baseline) > np.std(least)
        error.plot(
            time[1:], baseline * 1e3, label="plain difference", color="0.6", lw=0.7, zorder=2.1 if below else 2.3
        )
    rms = hit.estimate_rms_m_per_s
    label = "estimate" if rms is None else f"RMS in the wall {rms * 1e3:.3g} mm/s"
    _draw(error, time, least * 1e3, largest * 1e3, label=label, **line)
    error.axhline(0, color="black", lw=0.6)
    _frame(error, least * 1e3, largest * 1e3)

    _draw(force, time, *_force(trace), step=True, color=FORCE, lw=0.9, label=_drive_label(hit))
    force.axhline(-hit.scene.protocol.push_n, color=THEORY, lw=0.9, ls=":", label="balance of the push")
    if zoomed:
        for panel in (velocity, error, force):
            name_above(panel)


def _error(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest error of the estimate from each sample of a trace up to the next."""
    if isinstance(trace, Overview):
        return trace.error_least_m_per_s, trace.error_largest_m_per_s
    return (trace.estimate_m_per_s - trace.velocity_m_per_s,) * 2


def _force(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest force from each sample of a trace up to the next."""
    return (trace.force_least_n, trace.force_largest_n) if isinstance(trace, Overview) else (trace.force_n,) * 2


def _draw(axes: Axes, time: np.ndarray, least: np.ndarray, largest: np.ndarray, step: bool = False, **style) -> None:
    """Draw the range of a quantity over time; where it has no width, as a line."""
    if least is largest or np.array_equal(least, largest):
        axes.plot(time, least, drawstyle="steps-post" if step else "default", **style)
    else:
        axes.fill_between(time, least, largest, step="post" if step else None, **style)


def _drive_label(hit: Hit) -> str:
    if hit.scene.delay_samples:
        return f"wall (acts {hit.scene.amplifier.delay_s * 1e3:g} ms later)"
    return "wall"


def _frame(axis: Axes, *curves: np.ndarray) -> None:
    """Set the limits of a panel by these curves alone; other curves may leave it."""
    low, high = min(map(np.min, curves)), max(map(np.max, curves))
    margin = 0.08 * max(high - low, 1e-9)
    axis.set_ylim(low - margin, high + margin)
