"""Pictures of what a wall renders: stiffness and damping against frequency, and rate-hardness at contact."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.rendered import Rendered
from ..studies.rendered_setting import Setting, Spread, rate_text, slow_hz
from .labels import label_points
from .style import LABEL_PT, THEORY, lay_out, looks, new_figure, page, plain_decades

EXACT = {"color": THEORY, "ls": "--", "lw": 1.1, "zorder": 3.5}
"""The style of what the exact velocity would render."""
COMMANDED = {"color": "black", "ls": ":", "lw": 1.1, "zorder": 1.5}
"""The style of what is commanded."""
INKS = "#CC79A7", "#D55E00", "#0072B2", "#009E73", "#56B4E9", "#E69F00", "#444444", "#999933"
"""The colours of rates, from the slowest on; more rates begin anew."""
STIFFNESS, DAMPING, HARDNESS = (0.4, 1.6), (-0.75, 1.75), (0.0, 2.3)
"""The range of the panels, as a fraction of the commanded value; a line that leaves a panel is cut."""
APART = 0.7
"""The room of all estimators at a rate, as a part of the distance of two rates."""


@page
def draw(rendered: Rendered) -> dict[str, Figure]:
    """Return the pictures `impedance`, `bandwidth` and `contact`."""
    return {"impedance": _impedance(rendered), "bandwidth": _bandwidth(rendered), "contact": _contact(rendered)}


def _rates(rendered: Rendered) -> list[list[Setting]]:
    """Return the settings of every rate, in the order of the estimators."""
    rates = list(dict.fromkeys(each.rate_hz for each in rendered.settings))
    return [[each for each in rendered.settings if each.rate_hz == rate] for rate in rates]


def _looks(settings: list[Setting]) -> list[dict]:
    return looks([(each.curve.estimator, each.curve.output) for each in settings])


def _impedance(rendered: Rendered) -> Figure:
    """Return the picture of K and B against frequency, a line for each rate, with the first of the estimators."""
    settings, wall = [rate[0] for rate in _rates(rendered)], rendered.scene.wall
    picture = new_figure(3.6, _late(rendered, settings))
    left, right = picture.subplots(1, 2, sharex=True)
    _draw(left, settings, "stiffness", wall.stiffness_n_per_m, 1e3, STIFFNESS)
    lines = _draw(right, settings, "damping", wall.damping_n_s_per_m, 1.0, DAMPING)
    left.set_ylabel("K rendered (kN/m)")
    right.set_ylabel("B rendered (N s/m)")
    right.axhline(0, color="0.5", lw=0.8, zorder=1)
    for axes in (left, right):
        axes.set_xscale("log")
        plain_decades(axes.xaxis)
        axes.set_xlabel("frequency of the handle (Hz)")
    lay_out(picture)
    low, high = right.get_ylim()
    shown = [[(x, y) for x, y in line if low < y < high] for line in lines]
    named = [
        (_name(setting), points, _ink(number))
        for number, (setting, points) in enumerate(zip(settings, shown, strict=True))
        if points
    ]
    label_points(right, named, lines=shown)
    return picture


def _late(rendered: Rendered, settings: list[Setting]) -> str:
    """Return the title of a picture of some rates: what is rendered of the damping at a low frequency."""
    commanded, waves = rendered.scene.wall.damping_n_s_per_m, settings[0].waves
    title = f"{rendered.scene.name} with {settings[0].curve.label}, by the rate of the force"
    if waves:
        hz = slow_hz(waves)
        ends = sorted(setting.damping(hz).median for setting in settings)
        said = (
            f"A late spring takes damping: of {commanded:g} N s/m, {ends[0]:.3g} to {ends[-1]:.3g} are left at {hz} Hz"
        )
        title = f"{said}\n{title}"
    return title + "\ndotted: as commanded; dashed: the exact velocity, as late; bars: all starts"


def _name(setting: Setting) -> str:
    """Return the rate of a setting's force."""
    return f"{rate_text(setting.scene.controller.actuation_hz)}{', own, late' * (setting.rate_hz is None)}"


def _ink(number: int) -> str:
    """Return the colour of a rate by its number."""
    return INKS[number % len(INKS)]


def _draw(
    axes: Axes, settings: list[Setting], part: str, commanded: float, unit: float, shown: tuple[float, float]
) -> list[list[tuple[float, float]]]:
    """Draw the stiffness or the damping that settings render, a line for each; return their points."""
    key, lines, most = "stiffness_n_per_m" if part == "stiffness" else "damping_n_s_per_m", [], 0.0
    for number, setting in enumerate(settings):
        frequencies = list(setting.waves)
        values = [getattr(setting, part)(frequency) for frequency in frequencies]
        axes.errorbar(frequencies, _medians(values, unit), _ends(values, unit), color=_ink(number), marker=".")
        exact = [setting.expected(frequency, exact=True)[key] / unit for frequency in frequencies]
        axes.plot(frequencies, exact, **EXACT | {"color": _ink(number)})
        lines.append(list(zip(frequencies, _medians(values, unit), strict=True)))
        most = max(most, *map(abs, exact), 0.0)
    axes.axhline(commanded / unit, **COMMANDED)
    most = commanded / unit or most or 1.0
    axes.set_ylim(*(end * most for end in shown))
    return lines


def _bandwidth(rendered: Rendered) -> Figure:
    """Return the picture of the frequencies up to which K and B are rendered: a row an estimator, a panel a rate."""
    rates = _rates(rendered)
    picture = new_figure(1.2 + 0.2 * len(rates[0]), _furthest(rendered, rates[-1]))
    panels = picture.subplots(1, len(rates), sharex=True, sharey=True, squeeze=False)[0]
    frequencies = sorted({hz for settings in rates for setting in settings for hz in setting.waves})
    for axes, settings in zip(panels, rates, strict=True):
        for row, (setting, style) in enumerate(zip(settings, _looks(settings), strict=True)):
            for hz, shape, filled in ((setting.stiffness_to_hz, "s", True), (setting.damping_to_hz, "o", False)):
                colour = style["color"]
                if hz is not None:
                    axes.plot([hz], [row], shape, color=colour, mfc=colour if filled else "none", ms=4 if filled else 8)
        axes.set_title(_name(settings[0]), fontsize=LABEL_PT)
        axes.set_xlabel("frequency (Hz)")
    if frequencies:
        panels[0].set_xscale("log")
        panels[0].set_xlim(0.7 * frequencies[0], 1.5 * frequencies[-1])
        decades = [10**power for power in range(5) if frequencies[0] <= 10**power <= frequencies[-1]]
        panels[0].set_xticks(decades, map(str, decades))
    panels[0].set_yticks(range(len(rates[0])), [setting.curve.label for setting in rates[0]])
    panels[0].invert_yaxis()
    lay_out(picture)
    return picture


def _furthest(rendered: Rendered, settings: list[Setting]) -> str:
    """Return the title of the picture of some rates: which estimator reaches furthest at the last of them."""
    reached = {
        setting.curve.label: min(setting.stiffness_to_hz or 0, setting.damping_to_hz or 0) for setting in settings
    }
    best = max(reached, key=reached.__getitem__)
    said = f"At {_name(settings[0])} {best} renders both furthest, to {reached[best]} Hz"
    return (
        f"{said if reached[best] else 'No estimator renders both'} ({rendered.scene.name})\n"
        "the frequency up to which every start renders K (squares) and B (rings) within a tenth; no mark: nowhere"
    )


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
    handles, names = panels[0].get_legend_handles_labels()
    picture.legend(
        handles, names, loc="outside lower left", ncols=4, frameon=False, handlelength=1.6, columnspacing=1.2
    )
    lay_out(picture)
    return picture
