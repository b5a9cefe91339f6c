"""The rows of a table of hits, from their reports."""

from collections.abc import Mapping
from typing import Any

from ...model.runtime.result import text_of

REST_MM = 1e-6
"""The RMS of position (mm) below which a handle is called at rest: one nanometre."""
NUMBERS = ("K (N/m)", "B (N s/m)", "wall", "RMS (mm)", "peak force (N)", "velocity error (mm/s)", "force words")
"""The headings of a row behind its name."""
NEVER = "never touched"
"""The text in place of the verdict, for a wall that the handle never reached or felt."""
NOTES = (
    "RMS: distance of the handle from its line over the judged window (literal protocol: from its mean before); "
    "less than a nanometre is at rest. A handle that the wall does not hold, so that it leaves the device's travel at "
    "its drift, is unstable, whatever the RMS.",
    "velocity error: RMS of the estimate against the true velocity while the handle is in the wall for the first time, "
    "0.1 s at most; known of hits with --plot or --trace.",
    "force words: the first digits of the SHA-256 of every force word; runs of equal words took the same path.",
)


def row_of(name: str, report: Mapping[str, Any]) -> list[str]:
    """Return the cells of a hit's row: its name, and the numbers of its report (`hit.Hit.report`)."""
    error, touched = report["estimate_rms_mm_per_s"], report["touched"]
    rms = "at rest" if report["rms_mm"] < REST_MM else f"{report['rms_mm']:.3g}"
    return [
        name,
        f"{report['stiffness_n_per_m']:g}",
        f"{report['damping_n_s_per_m']:g}",
        report["verdict"] if touched else NEVER,
        rms if touched else text_of(None),
        f"{report['max_force_n']:.3f}",
        text_of(error if error is None else float(f"{error:.3g}")),
        (report["force_sha256"] or "")[:8],
    ]
