"""Pictures of a hit."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..loop.record import Trace
from ..walls.hit import Hit
from .style import save

ESTIMATE, TRUE, BASELINE, FORCE = "tab:blue", "black", "0.8", "tab:red"


def plot_hit(hit: Hit, path: Path) -> None:
    """Draw position, velocities and force of a hit: the whole run on the left, its first contact on the right.

    Beside the estimate stands the finite difference of counts without encoder errors, the baseline it is to beat.

    Args:
        hit: a run with traces.
        path: ends in one of `picture.SUFFIXES`.

    Raises:
        OSError: if the file cannot be written.
    """
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(11, 7.5), layout="constrained")
        axes = figure.subplots(3, 2, sharex="col", width_ratios=(1, 1.25))
        figure.suptitle(_title(hit))
        whole, contact = hit.overview, hit.detail
        settle = hit.scene.protocol.settle_s
        _column(axes[:, 0], whole, whole.time_s, hit, zoomed=False)
        axes[0, 0].axvline(settle, color="tab:green", lw=0.8, ls="--")
        mark = {"xycoords": ("data", "axes fraction"), "rotation": 90, "ha": "right", "va": "bottom", "fontsize": 7}
        axes[0, 0].annotate("measured from here", (settle, 0.04), color="tab:green", **mark)
        axes[0, 0].set_title("whole run")
        axes[2, 0].set_xlabel("time (s)")
        if len(contact.time_s):
            contact = _first_contact(contact)
            _column(axes[:, 1], contact, (contact.time_s - hit.contact_s) * 1e3, hit, zoomed=True)
            axes[0, 1].set_title(f"first contact, at {hit.contact_s:.4f} s")
            axes[2, 1].set_xlabel("time after contact (ms)")
        else:
            for axis in axes[:, 1]:
                axis.set_axis_off()
            axes[0, 1].set_title("the handle never reached the wall")
        save(figure, path)


def _first_contact(trace: Trace) -> Trace:
    """Return the trace up to a quarter of the contact's length after the handle has left the wall again."""
    inside = trace.position_m > 0
    entered = int(np.argmax(inside))
    left = entered + int(np.argmin(inside[entered:]))
    if left == entered:
        return trace
    last = left + (left - entered) // 4
    return Trace(**{key: array[:last] for key, array in vars(trace).items()})


def _title(hit: Hit) -> str:
    scene, spec = hit.scene, hit.scene.spec
    verdict = "stable" if hit.stable else "unstable"
    return (
        f"{scene.name}: {scene.controller.estimator} (output {scene.estimator_output}), {hit.backend} backend, "
        f"{spec.sample_hz / 1e3:g} kHz sampling, {spec.actuation_hz / 1e3:g} kHz actuation\n"
        f"wall {scene.wall.stiffness_n_per_m / 1e3:g} kN/m, {scene.wall.damping_n_s_per_m:g} N s/m: {verdict}, "
        f"RMS {hit.rms_m * 1e3:.5f} mm (threshold {scene.protocol.threshold_mm:g} mm)"
    )


def _column(axes: np.ndarray, trace: Trace, time: np.ndarray, hit: Hit, zoomed: bool) -> None:
    """Fill one column of three panels."""
    position, velocity, force = axes
    position.plot(time, trace.position_m * 1e3, color=TRUE, lw=1, label="handle")
    low, high = position.get_ylim()
    position.axhspan(0, max(high, 0), color="tab:red", alpha=0.08, lw=0, label="wall")
    position.set_ylim(low, high)
    position.set_ylabel("position (mm)")

    if zoomed and hit.scene.controller.estimator != "fdm":
        q, rate = hit.scene.spec.count_m, hit.scene.spec.sample_hz
        difference = np.diff(np.floor(trace.position_m / q)) * (q * rate)
        velocity.plot(time[1:], difference, color=BASELINE, lw=0.6, label="finite difference of ideal counts", zorder=1)
    name = hit.scene.controller.estimator
    velocity.plot(
        time, trace.estimate_m_per_s, color=ESTIMATE, lw=0.8, label=f"estimate ({name} {hit.scene.estimator_output})"
    )
    velocity.plot(time, trace.velocity_m_per_s, color=TRUE, lw=1, label="true")
    velocity.set_ylabel("velocity (m/s)")
    _frame(velocity, trace.velocity_m_per_s, trace.estimate_m_per_s)

    force.plot(time, trace.force_n, color=FORCE, lw=0.8, drawstyle="steps-post", label=_drive_label(hit))
    force.axhline(-hit.scene.protocol.push_n, color="0.5", lw=0.8, ls=":", label="balance of the motor's push")
    force.set_ylabel("force (N)")
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.legend(loc="best", fontsize=7, framealpha=0.9)


def _drive_label(hit: Hit) -> str:
    if hit.scene.delay_samples:
        return f"drive, wall on handle; it acts {hit.scene.amplifier.delay_s * 1e3:g} ms later"
    return "drive, wall on handle"


def _frame(axis: Axes, *curves: np.ndarray) -> None:
    """Frame a panel by these curves alone; the rest may leave it."""
    low, high = min(map(np.min, curves)), max(map(np.max, curves))
    margin = 0.08 * max(high - low, 1e-9)
    axis.set_ylim(low - margin, high + margin)
