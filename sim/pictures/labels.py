"""Labels beside the ends of lines and beside points, placed so that they touch and hide nothing."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from .style import LABEL_PT, lay_out

LEADING = 1.3
"""The distance between two lines of labels, in heights of their letters."""


def label_right(axes: Axes, labels: Sequence[tuple[str, float, str]]) -> None:
    """Write labels to the right of a panel at the heights where their lines end, moved apart where they would touch.

    The panel's limits must be final.

    Args:
        axes: the panel.
        labels: (text, height in data coordinates, colour) of every label.
    """
    scale = axes.transScale.transform
    low, high = (scale((1.0, value))[1] for value in axes.get_ylim())
    heights = [(scale((1.0, value))[1] - low) / (high - low) for _, value, _ in labels]
    # The first position serves the layout, which needs the widths, and gives the panel its height.
    texts = [
        axes.annotate(
            text,
            (1.0, height),
            (1.04, height),
            xycoords="axes fraction",
            textcoords="axes fraction",
            color=colour,
            fontsize=LABEL_PT,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.6, "relpos": (0, 0.5), "shrinkA": 1, "shrinkB": 1},
        )
        for (text, _, colour), height in zip(labels, heights, strict=True)
    ]
    lay_out(axes.figure)
    room = LEADING * LABEL_PT / 72 * axes.figure.dpi / axes.get_window_extent().height
    sizes = [room * (1 + text.count("\n")) for text, _, _ in labels]
    for text, place in zip(texts, spread(heights, sizes), strict=True):
        text.set_position((1.04, place))


def spread(heights: Sequence[float], sizes: Sequence[float]) -> list[float]:
    """Return heights for labels of these sizes, in the same order and apart, as near as possible to those given.

    None is below 0, where the panel ends.
    """
    groups: list[tuple[float, list[int]]] = []
    for index in sorted(range(len(heights)), key=lambda index: heights[index]):
        group = (heights[index], [index])
        # Groups that would touch become one group, around the mean of their given heights.
        while groups and groups[-1][0] + _half(groups[-1], sizes) > group[0] - _half(group, sizes):
            below = groups.pop()
            members = below[1] + group[1]
            group = (sum(heights[each] for each in members) / len(members), members)
        groups.append(group)
    places = [0.0] * len(heights)
    top = 0.0
    for middle, members in groups:
        top = max(top, middle - _half((middle, members), sizes))
        for index in members:
            places[index] = top + sizes[index] / 2
            top += sizes[index]
    return places


def _half(group: tuple[float, list[int]], sizes: Sequence[float]) -> float:
    """Return half the height of a group of labels."""
    return sum(sizes[index] for index in group[1]) / 2


AROUND = [
    radius * np.array([np.cos(angle), np.sin(angle)])
    for radius in (0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 2.8, 3.5, 4.5, 5.5, 7.0, 8.5, 10.5, 13.0, 16.0)
    for angle in np.linspace(0, 2 * np.pi, 16, endpoint=False)
]
"""The possible offsets of a label, from the point that it names to its own nearest edge, in heights of its letters."""
CLEAR_PX = 5.0
"""The distance, in pixels, between a label and anything that it must not cover."""


def label_points(
    axes: Axes,
    labels: Sequence[tuple[str, Sequence, str]],
    avoid: Sequence[tuple[float, float]] = (),
    lines: Sequence[Sequence[tuple[float, float]]] = (),
    ground: str = "white",
) -> list[Annotation]:
    """Write labels beside points or curves of a panel, at the nearest free position, with a leader where it is far.

    A position is free if it is in the panel, covers nothing, and is nearest to the label's own point or curve. The
    panel's limits must be final, and the figure must be laid out.

    Args:
        axes: the panel.
        labels: (text, target, colour) of every label; the target is a point in data coordinates, or the points of a
            curve.
        avoid: other points, in data coordinates.
        lines: other curves, as points in data coordinates.
        ground: colour behind the letters.
    """
    figure = axes.figure
    renderer, frame = figure.canvas.get_renderer(), axes.get_window_extent()
    height = LABEL_PT / 72 * figure.dpi

    def pixels(points: Sequence) -> np.ndarray:
        return axes.transData.transform(np.asarray(points, float).reshape(-1, 2))

    named = [_along(pixels(points), height) for _, points, _ in labels]
    others = [pixels(avoid), *(_along(pixels(line), height / 2) for line in lines)]
    taken: list[np.ndarray] = []
    texts = []
    for number, (text, _, colour) in enumerate(labels):
        foreign = np.concatenate([*named[:number], *named[number + 1 :], *others])
        panel = _Panel(frame, taken, named[number], foreign)
        anchor, box = _place(_extent(axes, text, renderer), height, panel)
        taken.append(box)
        others.append(_leader(box, anchor))
        near = _gap(box, anchor[None]) < 1.2 * height and panel.nearest(box)
        # The leader begins where the label is nearest to its target.
        begin = np.clip((anchor - box[:2]) / (box[2:] - box[:2]), 0, 1)
        line = {"arrowstyle": "-", "color": colour, "lw": 0.6, "relpos": begin, "shrinkA": 0, "shrinkB": 3}
        written = axes.annotate(
            text,
            axes.transData.inverted().transform(anchor),
            (np.array([box[0], (box[1] + box[3]) / 2]) - anchor) * 72 / figure.dpi,
            textcoords="offset points",
            arrowprops=None if near else line,
            # A box and not an outline: letters with an outline are no longer text in an SVG file.
            bbox={"fc": ground, "lw": 0, "alpha": 0.65, "pad": 0.5},
            annotation_clip=False,
            color=colour,
            fontsize=LABEL_PT,
            va="center",
        )
        written.set_in_layout(False)
        texts.append(written)
    return texts


def _extent(axes: Axes, text: str, renderer: RendererBase) -> np.ndarray:
    """Return the width and the height of a label, in pixels."""
    measured = axes.text(0, 0, text, fontsize=LABEL_PT)
    extent = measured.get_window_extent(renderer)
    measured.remove()
    return np.array([extent.width, extent.height])


class _Panel(NamedTuple):
    """The contents of a panel, in pixels: its frame, the placed labels, the target of a label, and everything else."""

    frame: Bbox
    taken: list[np.ndarray]
    own: np.ndarray
    foreign: np.ndarray

    def free(self, box: np.ndarray) -> bool:
        """Return whether a label has room: within the frame, away from other labels and points."""
        left, bottom, right, top = box
        if left < self.frame.x0 or right > self.frame.x1 or bottom < self.frame.y0 or top > self.frame.y1:
            return False
        x, y = CLEAR_PX, CLEAR_PX / 2
        if any(left < b[2] + x and b[0] < right + x and bottom < b[3] + y and b[1] < top + y for b in self.taken):
            return False
        return _gap(box, self.own) > CLEAR_PX and _gap(box, self.foreign) > CLEAR_PX

    def clear(self, line: np.ndarray) -> bool:
        """Return whether the leader from a label to its target crosses no label, and is not close to other points."""
        if any(_gap(box, line) == 0 for box in self.taken):
            return False
        # Other points may be close to the end of the leader, at the target.
        points = line[: len(line) * 2 // 3]
        return all(_gap(np.tile(point, 2), self.foreign) > CLEAR_PX for point in points)

    def nearest(self, box: np.ndarray) -> bool:
        """Return whether a label is clearly nearer to its target than to anything else."""
        return _gap(box, self.foreign) > 1.5 * _gap(box, self.own)


def _place(size: np.ndarray, height: float, panel: _Panel) -> tuple[np.ndarray, np.ndarray]:
    """Return the point that a label names, and the box of the label: left, bottom, right, top."""
    # Where two curves run together, a label would be ambiguous.
    alone = [point for point in panel.own if _gap(np.tile(point, 2), panel.foreign) > 0.7 * height]
    anchors, led, free = np.array(alone or panel.own), [], []
    for away in AROUND:
        # The text lies on the side of the anchor to which the offset points.
        low = anchors + away * height - size * (1 - np.sign(np.round(away, 6))) / 2
        for anchor, box in zip(anchors, np.hstack([low, low + size]), strict=True):
            if not panel.free(box):
                continue
            line = _leader(box, anchor)
            if panel.nearest(box) and panel.clear(line):
                return anchor, box
            if not led and np.hypot(*(line[-1] - line[0])) > height and panel.clear(line):
                led.append((anchor, box))
            free.append((anchor, box))
    return next(iter([*led, *free]), (anchors[0], np.concatenate([anchors[0], anchors[0] + size])))


def _leader(box: np.ndarray, anchor: np.ndarray) -> np.ndarray:
    """Return points of the leader from a label to its target."""
    begin = np.clip(anchor, box[:2], box[2:])
    return begin + (anchor - begin) * np.linspace(0, 1, 20)[:, None]


def _gap(box: np.ndarray, points: np.ndarray) -> float:
    """Return the distance from a box to the nearest of some points; infinite without points."""
    away = np.maximum(np.maximum(box[:2] - points, points - box[2:]), 0)
    return float(np.hypot(*away.T).min(initial=np.inf))


def _along(corners: np.ndarray, step: float) -> np.ndarray:
    """Return points along a curve, so close together that no label fits between two of them."""
    pieces = [corners]
    for begin, end in pairwise(corners):
        if np.isfinite(begin).all() and np.isfinite(end).all():
            count = min(int(np.hypot(*(end - begin)) / step) + 1, 1000)
            pieces.append(begin + (end - begin) * np.linspace(0, 1, count + 1)[:, None])
    return np.concatenate(pieces)
