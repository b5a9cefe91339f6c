"""What pictures share: how they are written, and how their lines are told apart."""

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from ..jobs.whole_file import whole_file

SUFFIXES = (".pdf", ".png", ".svg")
MARKERS = "osv^<>DPX*hpd"


def line_style(index: int, size: float) -> dict:
    """Return colour and marker of line number `index`, markers of a size in points."""
    return {"color": mpl.colormaps["tab10"](index % 10), "marker": MARKERS[index % len(MARKERS)], "ms": size}


def save(figure: Figure, path: Path) -> None:
    """Write a picture: text as text, and nothing in it that varies from run to run.

    Raises:
        OSError: if the file cannot be written.
    """
    metadata = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}[path.suffix]
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "hardwall"}), whole_file(path) as part:
        figure.savefig(part, format=path.suffix[1:], dpi=150, metadata=metadata)
