"""The picture of two hits side by side, and the same in motion: a handle, its position and the wall's force.

The handle is drawn to scale, and a film shows it in real time. Force and position come from the traces, which keep a
sample about every millisecond. The force is drawn as its range from one kept sample to the next.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from matplotlib.transforms import Bbox, TransformedBbox
from PIL import Image

from ...model.runtime.whole_file import whole_file
from ..scene.schema import Scene
from ..studies.rendered_setting import rate_text
from ..walls.hit import UNDECIDED, Hit
from ..walls.hit_beside import Beside
from .style import LABEL_PT, PAGE_IN, THEORY, lay_out, length_text, new_figure, page

HEIGHT_IN = 4.7
HEADLINE_PT = 14.0
HANDLE = "0.25"
ACCENTS = "#D55E00", "#0072B2"
"""The colour of each side; all else is black and grey."""
KNOB_SHARE, ROOM_SHARE = 0.09, 0.16
"""The length of the handle's carriage, and the room for the wall, as shares of the way to the wall."""
BOUNCES_M = 1e-4
"""How far a handle leaves an unstable wall to be called bouncing."""
FILM_PX = 760
FRAME_S, HOLD_S = 0.04, 3.0
"""The time of a frame of a film, and for how long its last frame stays."""
COLOURS = 64


@dataclass
class _Side:
    """The moving parts of one side: parts of the handle by their offsets (mm) from its front, curves, the verdict."""

    hit: Hit
    parts: list[tuple[Rectangle | Line2D, float]]
    curves: list[tuple[Axes, Line2D | PolyCollection]]
    verdict: Text

    @property
    def moving(self) -> list[Artist]:
        """All artists that `show` changes."""
        return [*(part for part, _ in self.parts), *(curve for _, curve in self.curves), self.verdict]

    def show(self, time_s: float) -> None:
        """Show the hit as it is at a time: the handle there, the curves up to there, and at the end the verdict."""
        trace = self.hit.overview
        at_mm = float(np.interp(time_s, trace.time_s, trace.position_m)) * 1e3
        for part, offset_mm in self.parts:
            if isinstance(part, Rectangle):
                part.set_x(at_mm + offset_mm)
            else:
                part.set_xdata([at_mm + offset_mm] * len(part.get_ydata()))
        for axes, curve in self.curves:
            (left, _), (low, high) = axes.get_xlim(), axes.get_ylim()
            curve.set_clip_box(TransformedBbox(Bbox([[left, low], [time_s, high]]), axes.transData))
        self.verdict.set_visible(time_s >= trace.time_s[-1])


@page
def draw(result: Beside) -> Figure:
    """Return the picture of two hits with traces, as they are at their ends."""
    return _drawn(result)[0]


@page
def film(result: Beside, path: Path) -> None:
    """Write two hits with traces as a film in real time, a looping GIF.

    Raises:
        OSError: if the file cannot be written.
    """
    figure, sides = _drawn(result)
    figure.suptitle(f"{figure.get_suptitle()}; in real time", x=0.01, ha="left")
    figure.set_dpi(FILM_PX / PAGE_IN)
    lay_out(figure)
    moving = [artist for side in sides for artist in side.moving]
    for artist in moving:
        artist.set_animated(True)
    figure.canvas.draw()
    still = figure.canvas.copy_from_bbox(figure.bbox)

    def at(time_s: float) -> Image.Image:
        figure.canvas.restore_region(still)
        for side in sides:
            side.show(time_s)
        for artist in moving:
            figure.draw_artist(artist)
        return Image.fromarray(np.array(figure.canvas.buffer_rgba())).convert("RGB")

    end_s = max(side.hit.overview.time_s[-1] for side in sides)
    last = at(end_s).quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    frames = [
        at(time_s).quantize(palette=last, dither=Image.Dither.NONE) for time_s in np.arange(0, end_s, FRAME_S).tolist()
    ]
    lasts_ms = [round(FRAME_S * 1e3)] * len(frames) + [round(HOLD_S * 1e3)]
    with whole_file(path) as part:
        frames[0].save(part, "GIF", save_all=True, append_images=[*frames[1:], last], duration=lasts_ms, loop=0)


def _drawn(result: Beside) -> tuple[Figure, list[_Side]]:
    """Return the picture of two hits as they are at their ends, and what moves in it."""
    figure = new_figure(HEIGHT_IN, _title(result))
    panels = figure.subplots(3, 2, height_ratios=(0.75, 1.2, 1), sharey="row")
    sides = []
    for hit, accent, column in zip(result.hits, ACCENTS, panels.T, strict=True):
        handle, position, force = column
        parts = _handle(handle, hit, accent)
        verdict = position.set_title(_verdict(hit), loc="right", color=accent, fontsize=LABEL_PT)
        trace = hit.overview
        (line,) = position.plot(trace.time_s, trace.position_m * 1e3, color="black", lw=1)
        area = force.fill_between(
            trace.time_s, -trace.force_largest_n, -trace.force_least_n, step="post", color=accent, lw=0.8
        )
        position.axhspan(0, 1e3, color=accent, alpha=0.15, lw=0)
        position.axvline(hit.scene.protocol.settle_s, color=THEORY, lw=0.8, ls="--")
        position.sharex(force)
        position.tick_params(labelbottom=False)
        force.set_xlim(0, hit.scene.samples / hit.scene.spec.sample_hz)
        force.set_xlabel("time (s)")
        sides.append(_Side(hit, parts, [(position, line), (force, area)], verdict))
    panels[1, 1].annotate(
        "judged from here", (hit.scene.protocol.settle_s, 0.06), (-3, 0), xycoords=("data", "axes fraction"),
        textcoords="offset points", color=THEORY, rotation=90, ha="right", fontsize=LABEL_PT,
    )  # fmt: skip
    _, position, force = panels[:, 0]
    low_mm = min(_lowest_m(hit) for hit in result.hits) * 1e3
    position.set_ylim(1.1 * low_mm, -0.15 * low_mm)
    position.set_ylabel("position (mm)")
    force.set_ylabel("force of\nthe wall (N)")
    figure.align_ylabels(panels[:, 0])
    for side in sides:
        side.show(side.hit.overview.time_s[-1])
    return figure, sides


def _handle(panel: Axes, hit: Hit, accent: str) -> list[tuple[Rectangle | Line2D, float]]:
    """Draw the headline, the rail and the wall; return the parts of the handle, and where they are from its front."""
    way_mm = -hit.scene.protocol.start_m * 1e3
    knob, room = KNOB_SHARE * way_mm, ROOM_SHARE * way_mm
    panel.set_xlim(-way_mm - 2 * knob, room)
    panel.set_ylim(0, 1)
    panel.set_axis_off()
    panel.set_title(_headline(hit), color=accent, fontsize=HEADLINE_PT, fontweight="bold", pad=16)
    panel.annotate(
        _loop(hit.scene), (0, 1), (0, 5), xycoords="axes fraction", textcoords="offset points", fontsize=LABEL_PT
    )
    panel.plot([-way_mm - 2 * knob, 0], [0.2, 0.2], color="0.75", lw=2, zorder=1)
    wall = Rectangle((0, 0), room, 1, fc="white", ec=accent, hatch="////", lw=1.2)
    panel.add_patch(wall)
    bar_mm = 10.0 ** np.floor(np.log10(way_mm / 2))
    panel.plot([-way_mm, bar_mm - way_mm], [0.06, 0.06], color=THEORY, lw=1.2)
    panel.annotate(
        f"{bar_mm:g} mm", (bar_mm - way_mm, 0.06), (4, 0), textcoords="offset points", va="center", color=THEORY,
        fontsize=LABEL_PT,
    )  # fmt: skip
    carriage = Rectangle((0, 0.2), knob, 0.3, color=HANDLE, zorder=3)
    panel.add_patch(carriage)
    (stem,) = panel.plot([0, 0], [0.5, 0.72], color=HANDLE, lw=3, zorder=3)
    (grip,) = panel.plot([0], [0.78], color=HANDLE, marker="o", ms=13, zorder=3)
    return [(carriage, -knob), (stem, -knob / 2), (grip, -knob / 2)]


def _title(result: Beside) -> str:
    """Return what both sides have in common."""
    one, other = (hit.scene for hit in result.hits)
    if one.wall != other.wall:
        return f"Two walls: {_wall(one)} beside {_wall(other)}"
    who = "The same handle hits" if one.handle == other.handle else "Two handles hit"
    return f"{who} the same wall ({_wall(one)}), rendered by two loops"


def _wall(scene: Scene) -> str:
    return f"{scene.wall.stiffness_n_per_m / 1e3:g} kN/m, {scene.wall.damping_n_s_per_m:g} N s/m"


def _headline(hit: Hit) -> str:
    return f"Force at {rate_text(hit.scene.spec.actuation_hz)}: {_does(hit)}"


def _does(hit: Hit) -> str:
    """Return what the handle does in the end, in the words of the verdict."""
    if not hit.touched:
        return "never touched"
    if hit.stable:
        return "it stands"
    if hit.verdict == UNDECIDED:
        return "undecided"
    trace = hit.overview
    settled = trace.position_m[trace.time_s >= hit.scene.protocol.settle_s]
    return "it bounces" if settled.min(initial=0.0) < -BOUNCES_M else "it buzzes"


def _loop(scene: Scene) -> str:
    """Return the estimator and the rates of a loop."""
    spec = scene.spec
    late = f", {scene.amplifier.delay_s * 1e3:g} ms late" if scene.delay_samples else ""
    sampled, actuated = rate_text(spec.sample_hz), rate_text(spec.actuation_hz)
    return f"{scene.controller.estimator}: velocity at {sampled}, force at {actuated}{late}"


def _verdict(hit: Hit) -> str:
    moves = length_text(hit.rms_m)
    return f"verdict: {hit.verdict}, {moves if moves == 'at rest' else f'RMS {moves}'}"


def _lowest_m(hit: Hit) -> float:
    """Return the lowest position after the first contact, which is below the wall."""
    position = hit.overview.position_m
    inside = np.flatnonzero(position > 0)
    return min(position[inside[0] :].min() if len(inside) else position.min(), -BOUNCES_M)
