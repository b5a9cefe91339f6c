"""The command `table`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from ..jobs.result import table_of, text_of
from .errors import BadInput
from .terminal import log, show

REST_MM = 1e-6
"""The RMS of position (mm) below which a handle is called at rest: one nanometre."""
NUMBERS = ("K (N/m)", "B (N s/m)", "wall", "RMS (mm)", "peak force (N)", "velocity error (mm/s)", "force words")
NOTES = (
    "RMS: distance of the handle from its mean once it has settled in the wall; less than a nanometre is at rest.",
    "velocity error: RMS of the estimate against the true velocity while the handle is in the wall for the first time, "
    "0.1 s at most; known of hits with --plot or --trace.",
    "force words: the first digits of the SHA-256 of every force word; runs of equal words took the same path.",
)


def command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="JSON reports of `hardwall hit --json`")],
) -> None:
    rows = []
    for file in files:
        try:
            rows.append(_row(json.loads(file.read_text())))
        except FileNotFoundError:
            raise BadInput(f"{file}: no such file") from None
        except (OSError, ValueError, KeyError, TypeError):
            raise BadInput(f"{file}: not a JSON report of `hardwall hit --json`") from None
    show(table_of(("run",), NUMBERS, rows))
    for note in NOTES:
        log.print(note)


def _row(report: dict) -> list[str]:
    error = report["estimate_rms_mm_per_s"]
    return [
        f"{report['estimator']} {report['output']}, {report['backend']}, {report['scene']}",
        f"{report['stiffness_n_per_m']:g}",
        f"{report['damping_n_s_per_m']:g}",
        "stable" if report["stable"] else "unstable",
        "at rest" if report["rms_mm"] < REST_MM else f"{report['rms_mm']:.3g}",
        f"{report['max_force_n']:.3f}",
        text_of(error if error is None else float(f"{error:.3g}")),
        (report["force_sha256"] or "")[:8],
    ]
