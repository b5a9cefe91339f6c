"""The command `accuracy`."""

import re
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import typer

from ..sim.estimates import figures, signals
from ..sim.estimates.accuracy import PHASE, errors_of
from ..sim.estimates.replay_plan import ReplayError
from ..sim.jobs.store import Store
from ..sim.studies import accuracy
from .errors import BadInput
from .options import BackendOption, EstimatorsOption, within
from .readings import READING, ReadingOptions, say
from .scenes import EncoderSetOption, curves_of, encoder_of, rates_of
from .study import study

ACCELERATIONS_M_PER_S2 = 1e-9, 1e6
"""The least and the largest bound C: one that shows after minutes, and one beyond any motor."""
JERKS_M_PER_S3 = 1e-9, 1e12
"""The least and the largest bound on the jerk."""
DRAWN_HZ_MAX = 100_000
"""The highest rate at which Figure 1 is drawn, sample by sample."""


FILE = re.compile(
    r"(?P<file>.+?\.(?:csv|tsv|txt|dat|log|npz|npy|mat|parquet|pq|sr|vcd)(?:\.gz)?)(?::(?P<column>.*))?", re.IGNORECASE
)
"""A recording, by the suffix of its file, and its column, which may have colons."""


@dataclass(frozen=True, kw_only=True)
class AccuracyOptions(ReadingOptions):
    """The options of a recording, of a study, and of the bounds that set the gains."""

    acceleration_max: Annotated[
        float | None,
        typer.Option(metavar="C", help="bound that sets the gains, 1e-9 to 1e6 m/s^2", show_default="the signal's own"),
    ] = None
    jerk_max: Annotated[
        float | None,
        typer.Option(
            metavar="J",
            help="bound that sets the gains, 1e-9 to 1e12 m/s^3",
            show_default="the swing's; none for kalman",
        ),
    ] = None

    @property
    def bounds(self) -> dict[str, float]:
        """The bounds that are given, as for `measure`.

        Raises:
            BadInput: if one is out of range.
        """
        given = {}
        if self.acceleration_max is not None:
            within(self.acceleration_max, "--acceleration-max", *ACCELERATIONS_M_PER_S2, "m/s^2")
            given["acceleration_max_m_per_s2"] = self.acceleration_max
        if self.jerk_max is not None:
            within(self.jerk_max, "--jerk-max", *JERKS_M_PER_S3, "m/s^3")
            given["jerk_max_m_per_s3"] = self.jerk_max
        return given


@study("workers", "plot", "acceleration_max", "jerk_max", *READING, kind=AccuracyOptions)
def command(
    options: AccuracyOptions,
    figure: Annotated[int | None, typer.Option(min=1, max=2, help="reproduce this figure of the paper")] = None,
    signal: Annotated[
        list[str] | None,
        typer.Option(
            help="paper, sweep, stop, flicker, hit or steady:MM_PER_S; or a recording, FILE:COLUMN; or a capture, FILE",
            show_default="paper",
        ),
    ] = None,
    wanted: EstimatorsOption = None,
    rates: Annotated[str | None, typer.Option(metavar="HZ,...", help="sample rates, 1e3 to 1e7 Hz each")] = None,
    backend: BackendOption = "float",
    encoder_phase_error: Annotated[
        float, typer.Option(metavar="COUNTS", help="phase error of channel B, -0.95 to 0.95 counts")
    ] = 0.0,
    assignments: EncoderSetOption = None,
) -> None:
    if figure and signal:
        raise BadInput(f"--figure {figure} has a signal of its own: give it or --signal, not both")
    curves = figures.curves(figure) if wanted is None and figure else curves_of(wanted)
    known, recorded = _signals(list(dict.fromkeys(signal or ["paper"])))
    encoder = _encoder(assignments, encoder_phase_error)
    of_all: dict[str, Any] = {"backend": backend}
    if bounds := options.bounds:
        of_all["bounds"] = bounds
    if not known and (rates is not None or encoder or bounds):
        raise BadInput(
            "--rates, --encoder-phase-error, --acceleration-max, --jerk-max and --set are for known motions: a "
            "recording has its own"
        )
    if options.given and not recorded:
        hint = ": the rates of known motions are --rates" if options.rate is not None else ""
        raise BadInput(f"{', '.join(options.given)} must be absent without a recording{hint}")
    at = figures.RATES_HZ[figure or 2] if rates is None else rates_of(rates, "--rates")
    if options.plot and (recorded or len(known) > 1):
        raise BadInput(
            "--plot draws the error of one known motion against the rate: give one --signal, not a recording"
        )
    if options.plot and figure == 1 and (len(at) > 1 or at[0] > DRAWN_HZ_MAX):
        raise BadInput(f"--figure 1 is drawn at one rate of at most {DRAWN_HZ_MAX:g} Hz, not {rates!r}")
    if encoder:
        of_all["encoder"] = encoder
    run = partial(options.results, store=Store("accuracy"))
    try:
        errors_of(encoder)
        motions = accuracy.jobs(curves, known, at, of_all)
        readings = [options.read(*each) for each in recorded]
        result = accuracy.study(figure, curves, motions, readings, backend, run)
    except (ValueError, ReplayError) as error:
        raise BadInput(str(error)) from None
    for each in readings:
        say(each)
    options.finish(result)


def _encoder(assignments: list[str] | None, phase_error_counts: float) -> dict[str, Any]:
    """Return the errors of the encoder, as for `measure`."""
    encoder = encoder_of(assignments)
    if phase_error_counts and PHASE in encoder:
        raise BadInput(f"--encoder-phase-error must be absent beside --set {PHASE}: both set the same error")
    return encoder | ({PHASE: phase_error_counts} if phase_error_counts else {})


def _signals(names: list[str]) -> tuple[list[str], list[tuple[str, str | None]]]:
    """Return the known motions, and (file, column) of every recording `FILE:COLUMN`, without a column of a capture."""
    known, recorded = [], []
    for name in names:
        if match := FILE.fullmatch(name):
            recorded.append((match["file"], match["column"]))
            continue
        try:
            signals.load(name)
        except ValueError as error:
            raise BadInput(f"--signal: {error}, or FILE:COLUMN, FILE with a suffix such as .csv") from None
        known.append(name)
    return known, recorded
