"""The command `table`."""

from pathlib import Path
from typing import Annotated

import typer
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...model.checks import shown
from ..jobs.regular_file import content_of
from ..jobs.result import table_of, text_of
from .errors import BadInput
from .terminal import log, show

REST_MM = 1e-6
"""The RMS of position (mm) below which a handle is called at rest: one nanometre."""
BYTES_MAX = 10**6
"""The largest file of a report."""
NUMBERS = ("K (N/m)", "B (N s/m)", "wall", "RMS (mm)", "peak force (N)", "velocity error (mm/s)", "force words")
NOTES = (
    "RMS: distance of the handle from its mean once it has settled in the wall; less than a nanometre is at rest.",
    "velocity error: RMS of the estimate against the true velocity while the handle is in the wall for the first time, "
    "0.1 s at most; known of hits with --plot or --trace.",
    "force words: the first digits of the SHA-256 of every force word; runs of equal words took the same path.",
)


Number = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=200)]


class Report(BaseModel):
    """What the table takes of a report of `hardwall hit`, which `sim.walls.hit.Hit.report` makes."""

    model_config = ConfigDict(strict=True)

    estimator: Name
    output: Name
    backend: Name
    scene: Name
    stiffness_n_per_m: Number
    damping_n_s_per_m: Number
    stable: bool
    rms_mm: Number
    max_force_n: Number
    estimate_rms_mm_per_s: Number | None
    force_sha256: Name | None

    def row(self) -> list[str]:
        """Return the cells of the report's row."""
        error = self.estimate_rms_mm_per_s
        return [
            f"{self.estimator} {self.output}, {self.backend}, {self.scene}",
            f"{self.stiffness_n_per_m:g}",
            f"{self.damping_n_s_per_m:g}",
            "stable" if self.stable else "unstable",
            "at rest" if self.rms_mm < REST_MM else f"{self.rms_mm:.3g}",
            f"{self.max_force_n:.3f}",
            text_of(error if error is None else float(f"{error:.3g}")),
            (self.force_sha256 or "")[:8],
        ]


def command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="JSON reports of `hardwall hit --json`")],
) -> None:
    show(table_of(("run",), NUMBERS, [_report(file).row() for file in files]))
    for note in NOTES:
        log.print(note)


def _report(file: Path) -> Report:
    """Return the report in a file."""
    try:
        return Report.model_validate_json(content_of(file, BYTES_MAX))
    except ValidationError as error:
        first = error.errors()[0]
        what = f"{'.'.join(map(str, first['loc'])) or 'the whole'}: {first['msg']}"
    except OSError as error:
        what = error.strerror
    raise BadInput(f"{shown(str(file))} must be a JSON report of `hardwall hit --json`, and is none: {what}")
