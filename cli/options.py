"""The options that commands of every kind share, and the checks of their values."""

import math
import os
import stat
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ..model.axes.axis import AXES_MAX
from ..model.checks import shown
from ..model.estimators import registry
from .errors import BadInput
from .plain_numbers import plain_number

Estimator = Literal[tuple(registry.ESTIMATORS)]
Backend = Literal["float", "fixed", "rtl"]

EstimatorOption = Annotated[
    Estimator | None,
    typer.Option(
        metavar="NAME", help=f"velocity estimator: {', '.join(registry.ESTIMATORS)}", show_default="the scene's"
    ),
]
OutputOption = Annotated[
    str | None, typer.Option(help="output of the estimator, e.g. u or u1", show_default="its first output")
]
EstimatorsOption = Annotated[
    str | None,
    typer.Option(
        "--estimators", metavar="NAME[:OUTPUT],...", help="estimators to compare, or `all`", show_default="all"
    ),
]


def methods_option(default: str) -> Any:
    """Return the option for estimators by name or by the founding paper's methods, with its default in words."""
    listed = "NAME[:OUTPUT],..."
    return typer.Option(
        "--estimators", metavar=listed, help="estimators, or methods of the paper, as for zwidth", show_default=default
    )


BackendOption = Annotated[
    Backend, typer.Option(help="float: float64 algorithm; fixed: bit-accurate model; rtl: the RTL in Verilator")
]
ModelOption = Annotated[
    Literal["float", "fixed"], typer.Option(help="float: float64 algorithm; fixed: bit-accurate model")
]
AxesOption = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=AXES_MAX,
        metavar="N",
        help="number of axes that share one pipeline, each at the scene's rates",
        show_default="one axis without a pipeline",
    ),
]
SeedsOption = Annotated[int, typer.Option(min=1, max=99, help="number of placements; fmax is the median")]
RateOption = Annotated[float, typer.Option(metavar="HZ", help="sample rate, 1e3 to 1e7 Hz")]

WorkersOption = Annotated[
    int | None, typer.Option(min=1, max=1024, help="number of threads", show_default="one per core")
]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="run on the workers of the Dask cluster at this address")
]
StartsOption = Annotated[
    int,
    typer.Option(
        min=1, max=10_000, metavar="N", help="number of starting points for each hit near the stability limit"
    ),
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="continue an interrupted run")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="change a key of the scene, e.g. wall.stiffness_n_per_m=2e3; an empty value removes it",
    ),
]
PlotOption = Annotated[Path | None, typer.Option(metavar="FILE", help="draw the result into a .png, .svg or .pdf")]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON on stdout, and nothing else")]


def numbers_of(text: str, option: str, least: float, most: float, unit: str, whole: bool = False) -> list[float]:
    """Return the numbers, or whole numbers, of a list given with an option, each once; raise BadInput if one is not
    `least` to `most`."""
    numbers = []
    for word in text.split(","):
        try:
            number = plain_number(word)
        except ValueError:
            number = math.nan
        if not least <= number <= most or (whole and number != int(number)):
            kind = "whole numbers" if whole else "numbers"
            raise BadInput(f"{option} must be {kind} of {least:g} to {most:g} {unit}, not {shown(word)}")
        numbers.append(number)
    return list(dict.fromkeys(numbers))


def within(value: float, option: str, least: float, most: float, unit: str) -> float:
    """Return the number that was given with an option; raise BadInput if it is not `least` to `most`."""
    if not least <= value <= most:
        raise BadInput(f"{option} must be {least:g} to {most:g} {unit}, not {value!r}")
    return value


def output_file(
    path: Path | None, option: str, suffixes: tuple[str, ...], other_than: Path | None = None
) -> Path | None:
    """Return the path of an output file; raise BadInput if the file could not be written.

    Nothing is left of the trial: the folder of the file is made when the file is written.

    Args:
        path: the file; None for none.
        option: the option that gave it.
        suffixes: the accepted ends of its name.
        other_than: a file that is read, and must not be overwritten.
    """
    if path is None:
        return None
    if path.suffix not in suffixes:
        raise BadInput(f"{option} must end in {' or '.join(suffixes)}, not {shown(str(path))}")
    with suppress(OSError):
        if other_than is not None and path.samefile(other_than):
            raise BadInput(f"{option} must be another file than the recording, not {shown(str(path))}")
    try:
        # A link is followed, as it is when the file is written.
        real = Path(os.path.realpath(path))
        with suppress(FileNotFoundError, NotADirectoryError):
            if not stat.S_ISREG(real.lstat().st_mode):
                raise BadInput(f"{option} must be a regular file, not {shown(str(path))}")
            with real.open("ab"):
                pass
        with tempfile.TemporaryFile(dir=next(folder for folder in real.parents if folder.exists())):
            pass
    except OSError as error:
        raise BadInput(f"{option} {shown(str(path))} cannot be written: {error.strerror}") from None
    return path
