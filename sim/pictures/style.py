"""The style of all pictures: sizes of a page, fonts, colours of estimators, and files.

A picture is `PAGE_IN` wide, for a page that shows it 700 pixels wide. Its smallest letters are then as high as a
footnote's. The colours are from Okabe and Ito and from Tol: colour-blind people can distinguish them. A marker repeats
the meaning of the colour. An estimator has the same colour and marker in every picture.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ...model.runtime.whole_file import whole_file
from . import SUFFIXES

PAGE_IN = 7.0
DPI = 150
TEXT_PT, LABEL_PT = 9.0, 8.0
"""The sizes of the letters of titles and axes, and of labels and ticks."""
SETTINGS = {
    "font.size": TEXT_PT,
    "axes.titlesize": TEXT_PT,
    "axes.titlelocation": "left",
    "axes.labelsize": TEXT_PT,
    "figure.titlesize": TEXT_PT,
    "legend.fontsize": LABEL_PT,
    "legend.framealpha": 0.9,
    "xtick.labelsize": LABEL_PT,
    "ytick.labelsize": LABEL_PT,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.88",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "path.simplify": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "hardwall",
}

TRUTH = {"color": "0.72", "lw": 3.0}
"""The style of true values: a broad pale line that stays visible on both sides of a thin estimate."""
THEORY = "0.35"
"""The colour of theory, which comes from no run."""
BAND = 0.2
"""The opacity of the interval of a line."""
WALL, FORCE, MARK = "#D55E00", "#000000", "#009E73"
COLOURS = {
    "fdm": "#444444",
    "levant": "#D55E00",
    "butterworth": "#0072B2",
    "kalman": "#009E73",
    "tracking-loop": "#117733",
    "period": "#999933",
    "period-count": "#B08900",
    "mt": "#7A5C00",
    "mt-divisionless": "#C4A35A",
    "levant-edge": "#E69F00",
    "edge-kalman": "#661100",
    "count-kalman": "#4D9221",
    "levant-semi-implicit": "#AA4499",
    "levant-implicit": "#882255",
    "levant-adaptive": "#332288",
    "levant-2": "#F06292",
    "levant-3": "#7570B3",
    "levant-2-filtering": "#66A61E",
    "levant-3-filtering": "#C2185B",
    "levant-2-implicit": "#8D6E63",
    "levant-3-implicit": "#5E35B1",
    "window": "#CC79A7",
    "foaw": "#3FA7D6",
    "least-squares": "#1F4E79",
}
MARKERS = dict(zip(COLOURS, [*"ovsDd<>12^8HphX34|_", "$2$", "$3$", *"P*x"], strict=True))
OTHER = {"color": "#000000", "marker": "."}
"""The style of an estimator that has no colour here yet."""
FADED = 0.5
"""The share of white in the palest of several lines of one estimator."""
AT_REST_M = 1e-9
"""The RMS of position below which a handle is called at rest."""


def looks(curves: Sequence[tuple[str, str]]) -> list[dict]:
    """Return the line styles of the (estimator, output) pairs of a picture.

    Several lines of one estimator's output, with other gains, go from pale to full in their order. A second output is
    dashed, and its markers are open.
    """
    styles = []
    for index, (estimator, output) in enumerate(curves):
        after = list(curves[index + 1 :]).count((estimator, output))
        before = list(curves[:index]).count((estimator, output))
        white = FADED * after / (before + after) if after else 0.0
        colour = mpl.colors.to_hex((1 - white) * np.array(mpl.colors.to_rgb(ink(estimator))) + white)
        second = output not in ("u", "z1", "end-fit")
        filled = {"mfc": "white", "ls": "--"} if second else {"mfc": colour, "ls": "-"}
        styles.append({"color": colour, "marker": MARKERS.get(estimator, OTHER["marker"]), "mec": colour} | filled)
    return styles


def ink(estimator: str) -> str:
    """Return the colour in which an estimator is written: the full colour, even where its line is pale."""
    return COLOURS.get(estimator, OTHER["color"])


def page(draw: Callable) -> Callable:
    """Decorate a function that returns a figure, or figures by name, so that it draws in the style of all pictures."""

    @wraps(draw)
    def drawn(*arguments, **options):
        with mpl.rc_context(SETTINGS):
            return draw(*arguments, **options)

    return drawn


def new_figure(height_in: float, title: str) -> Figure:
    """Return a figure as wide as a page, empty except for its title."""
    figure = Figure(figsize=(PAGE_IN, height_in), dpi=DPI)
    FigureCanvasAgg(figure)  # a canvas that can measure text
    figure.suptitle(title, x=0.01, ha="left")
    return figure


def lay_out(figure: Figure) -> None:
    """Give the panels of a figure their places, so that all that is written has room.

    This is the constrained layout with the places rounded. Its solver takes the equations in the order of the memory's
    addresses. So the last bits of its answer, and the names in an SVG, vary from run to run. A figure does not own its
    layout, because it would then be laid out for each drawing, and be drawn twice to be saved.
    """
    ConstrainedLayoutEngine().execute(figure)
    for axes in figure.axes:
        axes.set_position(np.round(axes.get_position(original=True).bounds, 9))
        axes.set_in_layout(True)  # an axes that was placed is otherwise left out of the next layout


def name_above(axes: Axes, columns: int = 2) -> None:
    """Write the names of a panel's lines above the panel, where they hide nothing."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 0.98),
        ncols=columns,
        frameon=False,
        borderaxespad=0.0,
        borderpad=0.2,
        handlelength=1.4,
        columnspacing=1.2,
    )


def plain_decades(axis: Axis) -> None:
    """Give a logarithmic axis ticks with plain numbers instead of powers of ten."""
    axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def length_text(length_m: float) -> str:
    """Return a length as text, in a unit that shows its significant digits; `at rest` for less than `AT_REST_M`."""
    if length_m < AT_REST_M:
        return "at rest"
    return f"{length_m * 1e3:.3g} mm" if length_m >= 1e-4 else f"{length_m * 1e6:.3g} µm"


def save(figure: Figure, path: Path) -> None:
    """Write a picture, with text as text, and without anything that varies from run to run.

    Raises:
        ValueError: if the name of the file does not end in one of `SUFFIXES`.
        OSError: if the file cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise ValueError(f"the name of a picture must end in {', '.join(SUFFIXES)}, not {str(path)!r}")
    metadata = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}[path.suffix]
    with mpl.rc_context(SETTINGS), whole_file(path) as part:
        lay_out(figure)
        figure.savefig(part, format=path.suffix[1:], dpi=DPI, metadata=metadata)


def save_all(drawn: Figure | dict[str, Figure], path: Path) -> list[Path]:
    """Write the result of a picture module's `draw`, several figures as STEM-NAME.SUFFIX; return the written files.

    Raises:
        ValueError: if the path does not end in one of `SUFFIXES`.
        OSError: if a file cannot be written.
    """
    if isinstance(drawn, Figure):
        save(drawn, path)
        return [path]
    paths = {name: path.with_stem(f"{path.stem}-{name}") for name in drawn}
    for name, figure in drawn.items():
        save(figure, paths[name])
    return list(paths.values())
