"""The commands that compare velocity estimators."""

import hashlib
import json
from pathlib import Path
from typing import Annotated

import typer

from ...model.estimators import registry
from .options import (
    Backend,
    BadInput,
    Device,
    JsonOption,
    PlotOption,
    WorkersOption,
    draw,
    picture_file,
    progress,
    rates_of,
    show_table,
)

COLUMNS = {"estimator": "left", "signal": "left"} | dict.fromkeys(("rate (Hz)", "RMS", "largest", "chatter"), "right")
COLUMNS |= {"unit": "left", "delay (us)": "right", "flags": "left"}
DRAWN_HZ_MAX = 100_000
"""Figure 1 is drawn sample by sample."""

EstimatorsOption = Annotated[
    str | None, typer.Option("--estimators", metavar="NAME[:OUTPUT],...", help="which [default: all]")
]


def _line(row: dict) -> list[str]:
    unit = "mm_s" if "rms_mm_s" in row else "counts_s"
    figures = (f"{row[f'{kind}_{unit}']:.5g}" for kind in ("rms", "max", "chatter"))
    delay = "" if row["delay_s"] is None else f"{row['delay_s'] * 1e6:.4g}"
    rms, largest, chatter = figures
    name = f"{row['estimator']} {row['output']}"
    shown = [name, row["signal"], f"{row['sample_hz']:g}", rms, largest, chatter]
    return [*shown, unit.replace("_", "/"), delay, ", ".join(row["flags"])]


def _curves(figure: int | None, wanted: str | None) -> list:
    """Return the estimators of a figure, or those that are wanted, or all."""
    from ..estimates import figures  # noqa: PLC0415
    from ..estimates.accuracy import outputs  # noqa: PLC0415
    from ..walls.methods import Curve, label  # noqa: PLC0415

    if wanted is None and figure:
        return figures.curves(figure)
    names = registry.ESTIMATORS if wanted is None else wanted.split(",")
    try:
        pairs = [pair for name in names for pair in outputs(name.strip())]
    except ValueError as error:
        raise BadInput(f"--estimators: {error}") from None
    return [Curve(label(*pair), *pair) for pair in dict.fromkeys(pairs)]


def _recording(name: str) -> tuple[str, str]:
    """Return the file and the column of a signal `FILE.csv:COLUMN`; a column may have a colon."""
    stem, _, column = name.partition(".csv:")
    return f"{stem}.csv", column


def _check_signals(names: list[str]) -> list[str]:
    """Return which of the signals are recordings; bad input for one that is nothing."""
    from ..estimates import signals  # noqa: PLC0415

    recordings = [name for name in names if ".csv:" in name]
    try:
        for name in names:
            if name not in recordings:
                signals.load(name)
    except ValueError as error:
        raise BadInput(f"--signal: {error}, or FILE.csv:COLUMN") from None
    return recordings


def accuracy(
    figure: Annotated[int | None, typer.Option(min=1, max=2, help="reproduce the founding paper's figure")] = None,
    signal: Annotated[
        list[str] | None,
        typer.Option(help="paper, sweep, stop, flicker, hit, steady:MM_PER_S, or FILE.csv:COLUMN [default: paper]"),
    ] = None,
    wanted: EstimatorsOption = None,
    rates: Annotated[str | None, typer.Option(metavar="HZ,...", help="sample rates, e.g. 1e3,10e3,1e6")] = None,
    backend: Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or RTL")] = "float",
    encoder_phase_error: Annotated[
        float, typer.Option(metavar="COUNTS", help="channel B late by so much, -0.95 to 0.95")
    ] = 0.0,
    acceleration_max: Annotated[
        float | None, typer.Option(metavar="C", help="m/s^2, sets the gains [default: the signal's own]")
    ] = None,
    workers: WorkersOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Hold velocity estimators against the exact derivative of known motions, at any rate."""
    from ..estimates import figures  # noqa: PLC0415
    from ..estimates.accuracy import measure, measure_recording, spec_of  # noqa: PLC0415
    from ..estimates.recording import RecordingError  # noqa: PLC0415
    from ..estimates.recording import load as load_recording  # noqa: PLC0415
    from ..estimates.replay import ReplayError  # noqa: PLC0415
    from ..jobs import parallel  # noqa: PLC0415
    from ..jobs.store import Store  # noqa: PLC0415
    from ..pictures.accuracy import draw as draw_rows  # noqa: PLC0415
    from ..pictures.accuracy import draw_figure_1  # noqa: PLC0415
    from ..world.encoder import offsets  # noqa: PLC0415

    if figure and signal:
        raise BadInput(f"--figure {figure} has a signal of its own: give it or --signal, not both")
    names, curves = list(dict.fromkeys(signal or ["paper"])), _curves(figure, wanted)
    recordings = _check_signals(names)
    given = rates is not None or encoder_phase_error or acceleration_max is not None
    if given and len(recordings) == len(names):
        raise BadInput(
            "--rates, --encoder-phase-error and --acceleration-max are for known motions: a recording has its own"
        )
    if acceleration_max is not None and not 0 < acceleration_max < 1e6:
        raise BadInput(f"--acceleration-max must be more than 0 and less than 1e6 m/s^2, not {acceleration_max!r}")
    if plot and (recordings or len(names) > 1):
        raise BadInput("--plot draws error against rate for one signal that is no recording: give one --signal")
    at = figures.RATES_HZ[figure or 2] if rates is None else rates_of(rates, "--rates")
    if plot and figure == 1 and (len(at) > 1 or at[0] > DRAWN_HZ_MAX):
        raise BadInput(f"--figure 1 is drawn at one rate of at most {DRAWN_HZ_MAX:g} Hz, not {rates!r}")
    plot = picture_file(plot)
    options = {"backend": backend, "phase_error_counts": encoder_phase_error}
    if acceleration_max is not None:
        options["acceleration_max_m_per_s2"] = acceleration_max
    # The fastest rates take longest: they go first.
    jobs = [
        (curve.label, curve.job(name, rate, **options))
        for rate in sorted(at, reverse=True)
        for name in names
        if name not in recordings
        for curve in curves
    ]
    files = [
        {"estimator": curve.estimator, "output": curve.output, "file": file, "column": column, "backend": backend}
        for file, column in (_recording(name) for name in recordings)
        for curve in curves
    ]
    try:
        offsets(encoder_phase_error)
        # What cannot be is said before anything long begins.
        for _, job in jobs:
            spec_of(job)
        for file, column in (_recording(name) for name in recordings):
            load_recording(file, column)
        files = [job | {"content": hashlib.sha256(Path(job["file"]).read_bytes()).hexdigest()} for job in files]
        with progress(f"accuracy, {backend}", len(jobs)) as advance:
            rows = parallel.run(measure, [job for _, job in jobs], Store("accuracy"), workers, advance)
        with progress(f"recordings, {backend}", len(files)) as advance:
            rows += parallel.run(measure_recording, files, Store("recordings"), workers, advance)
    except (ValueError, RecordingError, ReplayError) as error:
        raise BadInput(str(error)) from None
    if as_json:
        print(json.dumps(rows))
    else:
        show_table(COLUMNS, [_line(row) for row in sorted(rows, key=lambda row: (row["signal"], row["sample_hz"]))])
    if plot:
        labels = [label for label, _ in jobs]
        draw(draw_figure_1(curves, rows) if figure == 1 else draw_rows(rows, labels), plot)


COST_COLUMNS = {"estimator": "left", "device": "left"} | dict.fromkeys(
    ("LUT4", "FF", "DSP", "BRAM", "clocks", "board LUT4", "FF ", "DSP ", "fmax (MHz)", "max samples/s"), "right"
)


def _costs(names: list[str], device: str, seeds: int) -> list[dict]:
    """Return what each estimator costs on a device."""
    from ..jobs import parallel  # noqa: PLC0415
    from ..jobs.store import Store  # noqa: PLC0415
    from ..studies.costs import cost  # noqa: PLC0415

    jobs = [{"estimator": name, "device": device, "seeds": list(range(1, seeds + 1))} for name in names]
    # Each places with several processes of its own.
    with progress(f"costs on {device}", len(jobs)) as advance:
        return parallel.run(cost, jobs, Store("costs"), 1, advance)


def costs(
    wanted: EstimatorsOption = None,
    device: Annotated[Device | None, typer.Option(help="the part [default: each]")] = None,
    seeds: Annotated[int, typer.Option(min=1, max=99, help="placements; fmax is their median")] = 3,
    as_json: JsonOption = False,
) -> None:
    """What each estimator takes of a device: alone, and the board with it placed and routed (a minute or two each)."""
    from ..studies.costs import RATES  # noqa: PLC0415

    names = list(dict.fromkeys(curve.estimator for curve in _curves(None, wanted)))
    rows = [row for part in ([device] if device else RATES) for row in _costs(names, part, seeds)]
    if as_json:
        print(json.dumps(rows))
        return
    lines = []
    for row in rows:
        board = row["board"]
        own = [row["lut4"], row["ff"], row["dsp"], row["bram"], row["latency_clocks"]]
        whole = [board["lut4"], board["ff"], board["dsp"], f"{board['fmax_mhz']:.1f}", f"{board['max_sample_hz']:,}"]
        lines.append([row["estimator"], row["device"], *map(str, own), *map(str, whole)])
    show_table(COST_COLUMNS, lines)


def choose(
    rate: Annotated[float, typer.Option(metavar="HZ", help="sample rate")] = 1e6,
    wanted: EstimatorsOption = None,
    backend: Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or RTL")] = "fixed",
    device: Annotated[Device, typer.Option(help="the part that the logic is counted on")] = "ecp5-25k",
    seeds: Annotated[int, typer.Option(min=1, max=99, help="placements; fmax is their median")] = 3,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """The table to choose an estimator by: its error in each situation, all with one set of gains, and its cost."""
    from ..estimates.accuracy import measure  # noqa: PLC0415
    from ..jobs import parallel  # noqa: PLC0415
    from ..jobs.store import Store  # noqa: PLC0415
    from ..studies import choose  # noqa: PLC0415

    (sample_hz,) = rates_of(str(rate), "--rate")
    pairs = [(curve.estimator, curve.output) for curve in _curves(None, wanted)]
    jobs = choose.jobs(pairs, sample_hz, backend)
    try:
        with progress(f"situations, {backend}", len(jobs)) as advance:
            measured = parallel.run(measure, jobs, Store("accuracy"), workers, advance)
    except ValueError as error:
        raise BadInput(str(error)) from None
    rows = choose.table(pairs, measured, _costs(list(dict.fromkeys(name for name, _ in pairs)), device, seeds))
    if as_json:
        print(json.dumps(rows))
        return
    names = list(choose.SITUATIONS)
    best = {name: min(row["rms_mm_s"][name] for row in rows) for name in names}
    lines = []
    for row in rows:
        errors = [f"{row['rms_mm_s'][name]:.3g}{'*' * (row['rms_mm_s'][name] == best[name])}" for name in names]
        delay = "" if row["impact_delay_s"] is None else f"{row['impact_delay_s'] * 1e6:.3g}"
        logic = [str(row[name]) for name in ("lut4", "ff", "dsp", "bram", "latency_clocks")]
        lines.append(
            [f"{row['estimator']} {row['output']}".strip(), *errors, delay, *logic, f"{row['max_sample_hz']:,}"]
        )
    heads = [*names, "impact delay (us)", "LUT4", "FF", "DSP", "BRAM", "clocks", "max samples/s"]
    show_table({"RMS error (mm/s)": "left"} | dict.fromkeys(heads, "right"), lines)


def bits(
    rate: Annotated[float, typer.Option(metavar="HZ", help="sample rate")] = 1e6,
    wanted: EstimatorsOption = None,
    workers: WorkersOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """What a bit buys: error and logic as the words of an estimator shrink bit by bit from the derived widths."""
    from ..jobs import parallel  # noqa: PLC0415
    from ..jobs.store import Store  # noqa: PLC0415
    from ..pictures.bits import draw as draw_bits  # noqa: PLC0415
    from ..studies.bits import DROPPED, bit  # noqa: PLC0415

    plot = picture_file(plot)
    (sample_hz,) = rates_of(str(rate), "--rate")
    jobs = [
        {"estimator": curve.estimator, "output": curve.output, "sample_hz": sample_hz, "bits_dropped": dropped}
        for curve in _curves(None, wanted)
        for dropped in DROPPED
    ]
    with progress("bits", len(jobs)) as advance:
        found = parallel.run(bit, jobs, Store("bits"), workers, advance)
    rows = [row for row in found if row]
    if as_json:
        print(json.dumps(rows))
    else:
        columns = ("bits_dropped", "velocity_bits", "rms_mm_s", "lut4", "ff", "dsp")
        lines = [[f"{row['estimator']} {row['output']}", *(f"{row[name]:.5g}" for name in columns)] for row in rows]
        heads = ("bits dropped", "velocity bits", "RMS (mm/s)", "LUT4", "FF", "DSP")
        show_table({"estimator": "left"} | dict.fromkeys(heads, "right"), lines)
    if plot:
        draw(draw_bits(rows), plot)


def add_commands(app: typer.Typer) -> None:
    """Add the commands of this file to the command line."""
    for command in (accuracy, costs, choose, bits):
        app.command()(command)
