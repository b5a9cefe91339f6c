"""The picture of stable virtual masses: a panel for every wall and rate, a row for every estimator."""

from matplotlib.figure import Figure

from ..studies.mass import Masses, rate_text
from .style import BAND, THEORY, ink, new_figure, page

ROW_IN = 0.22
"""The height of an estimator's row, inches."""


@page
def draw(masses: Masses) -> Figure:
    """Return the picture: a disc where all starts are stable, a ring where none is, in grey the range of theory."""
    columns = list(masses.theory)
    rates, walls = (list(dict.fromkeys(each)) for each in zip(*columns, strict=True))
    curves = list(dict.fromkeys((setting.curve.label, setting.curve.estimator) for setting in masses.settings))
    title = f"{masses.scene}: stable virtual masses (discs; rings: none is), and in theory (grey)"
    picture = new_figure(1.0 + len(walls) * (0.6 + ROW_IN * len(curves)), title)
    panels = picture.subplots(len(walls), len(rates), sharex=True, sharey=True, squeeze=False)
    for row, (curve, rate_hz, wall) in enumerate(masses.settings):
        panel, estimator = panels[walls.index(wall)][rates.index(rate_hz)], curve.estimator
        height = [name for name, _ in curves].index(curve.label)
        for share, stable in zip(masses.shares, masses.stable[row], strict=True):
            part = stable / masses.starts
            panel.scatter(share, height, s=26, facecolor="none", edgecolor=ink(estimator), lw=0.8)
            panel.scatter(share, height, s=26, color=ink(estimator), alpha=part, lw=0)
    for (rate_hz, wall), shares in masses.theory.items():
        panel = panels[walls.index(wall)][rates.index(rate_hz)]
        if shares is not None:
            panel.axvspan(*shares, color=THEORY, alpha=BAND, lw=0)
        panel.set_title(f"{rate_text(rate_hz)}: {wall}")
        panel.set_yticks(range(len(curves)), [name for name, _ in curves])
        panel.set_ylim(len(curves) - 0.5, -0.5)
        panel.set_xlim(-1.05, 1.05)
    for panel in panels[-1]:
        panel.set_xlabel("virtual mass / mass of the handle (ratio)")
    return picture
