"""The command `rivals`."""

from functools import partial
from typing import Annotated

import typer

from ..sim.estimates.accuracy import errors_of
from ..sim.jobs.store import Store
from ..sim.studies import rivals
from .accuracy import FILE
from .errors import BadInput
from .options import BackendOption
from .readings import READING, ReadingOptions, say
from .scenes import EncoderSetOption, encoder_of, rates_of
from .study import study


@study("workers", *READING, kind=ReadingOptions)
def command(
    options: ReadingOptions,
    sample_rate: Annotated[
        float, typer.Option(metavar="HZ", help="sample rate of the known motions, 1e3 to 1e7 Hz")
    ] = 1e6,
    recordings: Annotated[
        list[str] | None,
        typer.Option("--signal", metavar="FILE:COLUMN", help="also a recording, FILE:COLUMN; or a capture, FILE"),
    ] = None,
    backend: BackendOption = "fixed",
    assignments: EncoderSetOption = None,
) -> None:
    (sample_hz,) = rates_of(str(sample_rate), "--sample-rate")
    encoders = {"perfect": {}, "real": encoder_of(assignments) or rivals.REAL}
    matches = {name: FILE.fullmatch(name) for name in recordings or []}
    for name, match in matches.items():
        if match is None:
            raise BadInput(f"--signal must be FILE:COLUMN, or FILE, with a suffix such as .csv, not {name!r}")
    if options.given and not matches:
        raise BadInput(f"{', '.join(options.given)} must be absent without a recording")
    try:
        errors_of(encoders["real"])
        readings = [options.read(match["file"], match["column"]) for match in matches.values() if match]
        run = partial(options.results, store=Store("rivals"))
        result = rivals.study(rivals.Bench(sample_hz, backend, encoders, run), readings)
    except ValueError as error:
        raise BadInput(str(error)) from None
    for each in readings:
        say(each)
    options.finish(result)
