"""The command `table`."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from ..model.axes.axis import AXES_MAX
from ..model.checks import shown
from ..model.runtime.regular_file import content_of
from ..model.runtime.result import table_of
from ..sim.walls.hit_rows import NOTES, NUMBERS, row_of
from .errors import BadInput
from .terminal import log, show

BYTES_MAX = 10**6
"""The largest file of a report."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=200)]


class Report(BaseModel):
    """The part of a report of `hardwall hit` that the table needs; `sim.walls.hit.Hit.report` makes the report."""

    model_config = ConfigDict(strict=True)

    estimator: Name
    output: Name
    backend: Name
    scene: Name
    stiffness_n_per_m: Number
    damping_n_s_per_m: Number
    verdict: Literal["stable", "unstable", "undecided"]
    rms_mm: Number
    max_force_n: Number
    estimate_rms_mm_per_s: Number | None
    force_sha256: Name | None
    touched: bool = True
    axis: Name | None = None

    def row(self) -> list[str]:
        """Return the cells of the report's row."""
        axis = "" if self.axis is None else f", {self.axis}"
        return row_of(f"{self.estimator} {self.output}, {self.backend}, {self.scene}{axis}", self.model_dump())


class ReportOfAxes(BaseModel):
    """The reports of all axes in a report of `hardwall hit`, which `sim.walls.hit_axes.AxesHit.report` makes."""

    model_config = ConfigDict(strict=True)

    rows: Annotated[list[Report], Field(min_length=1, max_length=AXES_MAX)]


def command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="reports that `hardwall hit --json` printed")],
) -> None:
    show(table_of(("run",), NUMBERS, [report.row() for file in files for report in _reports(file)]))
    for note in NOTES:
        log.print(note)


def _has_rows(content: bytes) -> bool:
    """Return whether a text is a JSON object with `rows`."""
    try:
        return "rows" in TypeAdapter(dict[str, Any]).validate_json(content)
    except ValidationError:
        return False


def _reports(file: Path) -> list[Report]:
    """Return the report in a file, or the reports of several axes."""
    try:
        content = content_of(file, BYTES_MAX)
        if _has_rows(content):
            return ReportOfAxes.model_validate_json(content).rows
        return [Report.model_validate_json(content)]
    except ValidationError as error:
        first = error.errors()[0]
        what = f"{'.'.join(map(str, first['loc'])) or 'the whole'}: {first['msg']}"
    except OSError as error:
        what = error.strerror
    raise BadInput(f"{shown(str(file))} must be a JSON report of `hardwall hit --json`, and is none: {what}")
