"""The command `accuracy`."""

from dataclasses import dataclass, replace
from typing import Annotated, Any

import typer

from ..sim.estimates import figures, recording, signals
from ..sim.estimates.accuracy import COARSEN, PHASE, errors_of, measure, measure_recording, spec_of
from ..sim.estimates.replay import ReplayError, check_length, plan
from ..sim.jobs.store import Store
from ..sim.studies import accuracy
from ..sim.walls.methods import Curve
from .errors import BadInput
from .options import BackendOption, EstimatorsOption, within
from .scenes import EncoderSetOption, curves_of, encoder_of, rates_of
from .study import StudyOptions, study

ACCELERATIONS_M_PER_S2 = 1e-9, 1e6
"""The least and the largest bound C: one that shows after minutes, and one beyond any motor."""
DRAWN_HZ_MAX = 100_000
"""The highest rate at which Figure 1 is drawn, sample by sample."""


@study("workers", "plot")
def command(
    options: StudyOptions,
    figure: Annotated[int | None, typer.Option(min=1, max=2, help="reproduce the founding paper's figure")] = None,
    signal: Annotated[
        list[str] | None,
        typer.Option(
            help="paper, sweep, stop, flicker, hit, steady:MM_PER_S, or FILE.csv:COLUMN", show_default="paper"
        ),
    ] = None,
    wanted: EstimatorsOption = None,
    rates: Annotated[str | None, typer.Option(metavar="HZ,...", help="sample rates, e.g. 1e3,10e3,1e6")] = None,
    backend: BackendOption = "float",
    encoder_phase_error: Annotated[
        float, typer.Option(metavar="COUNTS", help="delay of channel B, -0.95 to 0.95 counts")
    ] = 0.0,
    acceleration_max: Annotated[
        float | None,
        typer.Option(metavar="C", help="acceleration that sets the gains, m/s^2", show_default="the signal's own"),
    ] = None,
    assignments: EncoderSetOption = None,
) -> None:
    if figure and signal:
        raise BadInput(f"--figure {figure} has a signal of its own: give it or --signal, not both")
    curves = figures.curves(figure) if wanted is None and figure else curves_of(wanted)
    known, recorded = _signals(list(dict.fromkeys(signal or ["paper"])))
    encoder = _encoder(assignments, encoder_phase_error)
    if not known and (rates is not None or encoder or acceleration_max is not None):
        raise BadInput(
            "--rates, --encoder-phase-error and --acceleration-max are for known motions, as is --set: a recording has "
            "its own"
        )
    if acceleration_max is not None:
        within(acceleration_max, "--acceleration-max", *ACCELERATIONS_M_PER_S2, "m/s^2")
    at = figures.RATES_HZ[figure or 2] if rates is None else rates_of(rates, "--rates")
    if options.plot and (recorded or len(known) > 1):
        raise BadInput("--plot draws error against rate for one signal that is no recording: give one --signal")
    if options.plot and figure == 1 and (len(at) > 1 or at[0] > DRAWN_HZ_MAX):
        raise BadInput(f"--figure 1 is drawn at one rate of at most {DRAWN_HZ_MAX:g} Hz, not {rates!r}")
    of_all: dict[str, Any] = {"backend": backend}
    if encoder:
        of_all["encoder"] = encoder
    if acceleration_max is not None:
        of_all["acceleration_max_m_per_s2"] = acceleration_max
    labelled = accuracy.jobs(curves, known, at, of_all)
    labels, jobs = [label for label, _ in labelled], [job for _, job in labelled]
    try:
        errors_of(encoder)
        # Invalid input is reported before anything long begins.
        for job in jobs:
            spec_of(job)
        recordings = _recordings(curves, recorded, backend)
        rows = options.results(f"accuracy, {backend}", measure, jobs, Store("accuracy"))
        rows += options.results(f"recordings, {backend}", recordings.measure, recordings.jobs, Store("recordings"))
    except (ValueError, recording.RecordingError, ReplayError) as error:
        raise BadInput(str(error)) from None
    options.finish(accuracy.Accuracy(figure, curves, rows, labels))


def _encoder(assignments: list[str] | None, phase_error_counts: float) -> dict[str, Any]:
    """Return the errors of the encoder, as for `measure`."""
    encoder = encoder_of(assignments)
    if phase_error_counts and PHASE in encoder:
        raise BadInput(f"--encoder-phase-error must be absent beside --set {PHASE}, which is the same")
    return encoder | ({PHASE: phase_error_counts} if phase_error_counts else {})


def _signals(names: list[str]) -> tuple[list[str], list[tuple[str, str]]]:
    """Return the known motions, and (file, column) of every recording `FILE.csv:COLUMN`; a column may have a colon."""
    known, recorded = [], []
    for name in names:
        stem, colon, column = name.partition(".csv:")
        if colon:
            recorded.append((f"{stem}.csv", column))
            continue
        try:
            signals.load(name)
        except ValueError as error:
            raise BadInput(f"--signal: {error}, or FILE.csv:COLUMN") from None
        known.append(name)
    return known, recorded


@dataclass(frozen=True)
class _Recordings:
    """Recordings, each read once: a job has the digest of the bytes that its counts come from.

    Attributes:
        read: the recordings, by digest and column.
        jobs: the arguments of `measure`, which JSON can hold.
    """

    read: dict[tuple[str, str], recording.Recording]
    jobs: list[dict]

    def measure(self, file: str, column: str, content: str, **how: str) -> dict:
        """Return the row of a job: see `measure_recording`."""
        return measure_recording(replace(self.read[content, column], file=file), **how)


def _recordings(curves: list[Curve], recorded: list[tuple[str, str]], backend: str) -> _Recordings:
    """Return the recordings of (file, column) pairs, to be put through every estimator.

    Raises:
        RecordingError, ReplayError: if a recording is not valid, or too short to be judged, or an estimator cannot take
            it.
    """
    read, jobs = {}, []
    for file, column in recorded:
        counts = recording.load(file, column)
        check_length(counts)
        for estimator in dict.fromkeys(curve.estimator for curve in curves):
            plan(counts, estimator, backend, COARSEN)
        read[counts.content, column] = counts
        keys = {"file": file, "column": column, "content": counts.content, "backend": backend}
        jobs += [{"estimator": curve.estimator, "output": curve.output} | keys for curve in curves]
    return _Recordings(read, jobs)
