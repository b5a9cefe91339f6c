"""The picture of a fit of sines to a hit, and its derivatives: the founding paper's Figure 4."""

import numpy as np
from matplotlib.figure import Figure

from ..studies.lipschitz import Lipschitz


def plot_lipschitz(found: Lipschitz) -> Figure:
    """Return the picture: position, velocity and acceleration of the fit, beside what was."""
    picture = Figure(figsize=(10, 8), layout="constrained")
    axes = picture.subplots(3, 1, sharex=True)
    milliseconds = found.times_s * 1e3
    acceleration = np.gradient(found.velocities_m_per_s, found.times_s)
    shown = (
        ("position (mm)", found.positions_m * 1e3, 1e3, "recorded counts"),
        ("velocity (mm/s)", found.velocities_m_per_s * 1e3, 1e3, "the handle's"),
        ("acceleration (m/s²)", acceleration, 1.0, "the handle's, between the points"),
    )
    for order, (axis, (label, true, scale, name)) in enumerate(zip(axes, shown, strict=True)):
        axis.plot(milliseconds, true, color="black", lw=1.1, label=name)
        axis.plot(milliseconds, found.fitted(order) * scale, color="tab:red", lw=1.1, label="the fit's")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.margins(x=0)
    bound = found.bound_m_per_s2
    for side in (-bound, bound):
        axes[2].axhline(side, color="tab:red", ls="--", lw=0.9, label=f"C = {bound:.3g} m/s²" if side > 0 else None)
    for axis in axes:
        axis.legend(fontsize=8, loc="upper right")
    axes[2].set_xlabel("time after the contact (ms)")
    wall = found.scene.wall
    axes[0].set_title(
        f"{found.scene.name}: {len(found.sines.rad_per_s)} sines fitted to a hit of "
        f"{wall.stiffness_n_per_m / 1e3:g} kN/m, {wall.damping_n_s_per_m:g} N s/m"
    )
    return picture
