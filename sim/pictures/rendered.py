"""Pictures of what a wall renders: stiffness and damping against frequency, and rate-hardness at contact."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.rendered import Rendered
from ..studies.rendered_setting import Setting, Spread, rate_text
from .style import LABEL_PT, THEORY, lay_out, looks, new_figure, page, plain_decades

EXACT = {"color": THEORY, "ls": "--", "lw": 1.1, "zorder": 3.5}
"""The style of what the exact velocity would render."""
COMMANDED = {"color": "black", "ls": ":", "lw": 1.1, "zorder": 1.5}
"""The style of what is commanded."""
STIFFNESS, DAMPING, HARDNESS = (0.4, 1.6), (-0.75, 1.75), (0.0, 2.3)
"""What the panels show, in parts of what is commanded; a line that leaves a panel is cut."""
APART = 0.7
"""The room of all estimators at a rate, as a part of the distance of two rates."""


@page
def draw(rendered: Rendered) -> dict[str, Figure]:
    """Return the pictures `impedance` and `contact`."""
    return {"impedance": _impedance(rendered), "contact": _contact(rendered)}


def _rates(rendered: Rendered) -> list[list[Setting]]:
    """Return the settings of every rate, in the order of the estimators."""
    rates = list(dict.fromkeys(each.rate_hz for each in rendered.settings))
    return [[each for each in rendered.settings if each.rate_hz == rate] for rate in rates]


def _looks(settings: list[Setting]) -> list[dict]:
    return looks([(each.curve.estimator, each.curve.output) for each in settings])


def _impedance(rendered: Rendered) -> Figure:
    """Return the picture of K and B against frequency, a row of panels for each rate."""
    rates, wall = _rates(rendered), rendered.scene.wall
    title = (
        f"{rendered.scene.name}: what a wall of {wall.stiffness_n_per_m / 1e3:g} kN/m and "
        f"{wall.damping_n_s_per_m:g} N s/m (dotted) renders to {rendered.moving.amplitude_m * 1e3:g} mm;\n"
        "dashed: with the exact velocity, as late; bars: all starts; what leaves a panel is cut"
    )
    picture = new_figure(1.3 + 1.75 * len(rates), title)
    panels = picture.subplots(len(rates), 2, sharex=True, squeeze=False)
    for (left, right), settings in zip(panels, rates, strict=True):
        _draw(left, settings, "stiffness", wall.stiffness_n_per_m, 1e3, STIFFNESS)
        _draw(right, settings, "damping", wall.damping_n_s_per_m, 1.0, DAMPING)
        left.set_title(_name(settings[0]), fontsize=LABEL_PT)
        left.set_ylabel("K rendered (kN/m)")
        right.set_ylabel("B rendered (N s/m)")
        right.axhline(0, color="0.5", lw=0.8, zorder=1)
    for axes in panels[-1]:
        axes.set_xscale("log")
        plain_decades(axes.xaxis)
        axes.set_xlabel("frequency of the handle (Hz)")
    _name_lines(picture, panels[0, 0])
    picture.align_ylabels(panels)
    lay_out(picture)
    return picture


def _name_lines(picture: Figure, axes: Axes) -> None:
    """Write the names of the lines of a panel below all panels."""
    handles, names = axes.get_legend_handles_labels()
    picture.legend(
        handles, names, loc="outside lower left", ncols=4, frameon=False, handlelength=1.6, columnspacing=1.2
    )


def _name(setting: Setting) -> str:
    """Return the rate of a setting as the title of its panel."""
    controller = setting.scene.controller
    rate = f"force at {rate_text(controller.actuation_hz)}"
    if setting.rate_hz is None:
        rate = f"its own rates, samples at {rate_text(controller.sample_hz)}, {rate}"
    return f"{rate}: {setting.delay_s * 1e3:.3g} ms late with {setting.curve.label}"


def _draw(
    axes: Axes, settings: list[Setting], part: str, commanded: float, unit: float, shown: tuple[float, float]
) -> None:
    """Draw the stiffness or the damping that settings of one rate render."""
    for setting, style in zip(settings, _looks(settings), strict=True):
        frequencies = list(setting.waves)
        values = [getattr(setting, part)(frequency) for frequency in frequencies]
        axes.errorbar(frequencies, _medians(values, unit), _ends(values, unit), label=setting.curve.label, **style)
    frequencies = list(settings[0].waves)
    key = "stiffness_n_per_m" if part == "stiffness" else "damping_n_s_per_m"
    exact = [settings[0].expected(frequency, exact=True)[key] / unit for frequency in frequencies]
    axes.plot(frequencies, exact, **EXACT)
    axes.axhline(commanded / unit, **COMMANDED)
    most = commanded or max((abs(value) for value in exact), default=0.0) * unit or unit
    axes.set_ylim(*(end * most / unit for end in shown))


def _medians(values: list[Spread], unit: float) -> list[float]:
    return [value.median / unit for value in values]


def _ends(values: list[Spread], unit: float) -> list[list[float]]:
    """Return how far the ends of spreads are below and above their medians."""
    return [
        [(value.median - value.low) / unit for value in values],
        [(value.high - value.median) / unit for value in values],
    ]


def _contact(rendered: Rendered) -> Figure:
    """Return the picture of the rate-hardness against the rate, a panel for each speed."""
    rates, speeds = _rates(rendered), rendered.moving.speeds_m_per_s
    hardest, stiffness = rendered.hardest_n_per_m, rendered.scene.wall.stiffness_n_per_m
    title = (
        f"{rendered.scene.name}: rate-hardness over W = {rendered.moving.window_s * 1e3:g} ms, by speed at contact\n"
        f"dotted: as commanded, K + B/W = {hardest / 1e3:g} kN/m; dashed: K alone;\n"
        "bars: all starts; what leaves a panel is cut"
    )
    picture = new_figure(1.3 + 1.65 * len(speeds), title)
    panels = picture.subplots(len(speeds), 1, sharex=True, squeeze=False)[:, 0]
    for axes, speed in zip(panels, speeds, strict=True):
        for place, settings in enumerate(rates):
            for number, (setting, style) in enumerate(zip(settings, _looks(settings), strict=True)):
                value = [setting.hardness(speed)]
                at = place + APART * ((number + 0.5) / len(settings) - 0.5)
                named = {"label": setting.curve.label} if place == 0 else {}
                axes.errorbar([at], _medians(value, 1e3), _ends(value, 1e3), **style | named | {"ls": ""})
        axes.axhline(hardest / 1e3, **COMMANDED)
        axes.axhline(stiffness / 1e3, **EXACT)
        axes.set_ylim(*(end * hardest / 1e3 for end in HARDNESS))
        axes.set_title(f"{speed * 1e3:g} mm/s", fontsize=LABEL_PT)
        axes.set_ylabel("hardness (kN/m)")
    panels[-1].set_xticks(range(len(rates)), [settings[0].name for settings in rates])
    panels[-1].set_xlabel("rate of estimator and force (own: the scene's rates)")
    _name_lines(picture, panels[0])
    lay_out(picture)
    return picture
