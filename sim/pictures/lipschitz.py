"""The picture of a fit of sines to a hit, and its derivatives: the founding paper's Figure 4."""

import numpy as np
from matplotlib.figure import Figure

from ..studies.lipschitz import Lipschitz
from .style import LABEL_PT, TRUTH, WALL, name_above, new_figure, page

FIT = {"color": WALL, "lw": 1.1}


@page
def draw(fit: Lipschitz) -> Figure:
    """Return the picture: position, velocity and acceleration of the fit over the recorded or true values."""
    wall = fit.scene.wall
    title = (
        f"{fit.scene.name}: {len(fit.sines.rad_per_s)} sines fitted to a hit of "
        f"{wall.stiffness_n_per_m / 1e3:g} kN/m, {wall.damping_n_s_per_m:g} N s/m"
    )
    picture = new_figure(6.5, title)
    axes = picture.subplots(3, 1, sharex=True)
    milliseconds = fit.times_s * 1e3
    acceleration = np.gradient(fit.velocities_m_per_s, fit.times_s)
    shown = (
        ("position (mm)", fit.positions_m * 1e3, 1e3, "recorded counts"),
        ("velocity (mm/s)", fit.velocities_m_per_s * 1e3, 1e3, "the handle's"),
        ("acceleration (m/s²)", acceleration, 1.0, "the handle's, between the points"),
    )
    for order, (axis, (label, true, scale, name)) in enumerate(zip(axes, shown, strict=True)):
        axis.plot(milliseconds, true, label=name, **TRUTH)
        axis.plot(milliseconds, fit.fitted(order) * scale, label="the fit's", **FIT)
        axis.set_ylabel(label)
        axis.margins(x=0)
        name_above(axis)
    bound = fit.bound_m_per_s2
    for side in (-bound, bound):
        axes[2].axhline(side, color=WALL, ls="--", lw=0.9)
    mark = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "color": WALL, "ha": "right"}
    axes[2].annotate(f"C = {bound:.3g} m/s²", (1.0, bound), (-2, 3), fontsize=LABEL_PT, **mark)
    axes[2].set_xlabel("time after the contact (ms)")
    picture.align_ylabels(axes)
    return picture
