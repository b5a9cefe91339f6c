"""The picture of what a bit buys: error against the velocity's width, and against logic."""

from matplotlib.figure import Figure

from ..studies.bits import Bits
from ..walls.methods import label
from .labels import label_right
from .style import looks, new_figure, page


@page
def draw(bits: Bits) -> Figure:
    """Return the picture, with a curve for every output of an estimator."""
    rows = bits.rows
    title = f"the paper's signal at {rows[0]['sample_hz'] / 1e6:g} MHz; circles: the derived widths"
    picture = new_figure(5.5, title)
    by_width, by_logic = picture.subplots(1, 2, sharey=True)
    curves = list(dict.fromkeys((row["estimator"], row["output"]) for row in rows))
    ends = []
    for curve, style in zip(curves, looks(curves), strict=True):
        own = [row for row in rows if (row["estimator"], row["output"]) == curve]
        errors = [row["rms_mm_s"] for row in own]
        for axes, key in ((by_width, "velocity_bits"), (by_logic, "lut4")):
            axes.plot([row[key] for row in own], errors, label=label(*curve), **style)
            # The circle marks the widths that follow from the spec.
            axes.plot(own[0][key], errors[0], marker="o", ms=9, mfc="none", mec=style["color"])
        # The right end of the curve is where its logic is largest.
        ends.append((label(*curve), max(own, key=lambda row: row["lut4"])["rms_mm_s"], style["color"]))
    by_width.set_xlabel("bits of the velocity")
    by_logic.set_xlabel("LUT4 of the estimator alone (ECP5)")
    by_width.set_ylabel("RMS error (mm/s)")
    by_width.set_yscale("log")
    by_logic.set_ylim(*by_logic.get_ylim())
    label_right(by_logic, ends)
    return picture
