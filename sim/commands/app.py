"""The command line. Results go to stdout, everything else to stderr; exit codes: 0, 1 failed run, 2 bad input."""

import json
import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from ..scene.load import load
from ..scene.schema import SceneError
from . import estimators, figure_5, studies, trade, zwidth
from .options import (
    Backend,
    BadInput,
    Device,
    Estimator,
    JsonOption,
    PlotOption,
    SceneArgument,
    SetOption,
    draw,
    log,
    output_file,
    picture_file,
    progress,
    scene_changes,
    show,
    show_table,
)

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="A stiff virtual wall in hardware: encoder edges in, force out.",
)


@app.command()
def hit(
    scene: SceneArgument = "seed-2011",
    estimator: Annotated[Estimator | None, typer.Option(help="velocity estimator [default: the scene's]")] = None,
    output: Annotated[str | None, typer.Option(help="its output, e.g. u or u1 [default: its first]")] = None,
    backend: Annotated[
        Backend, typer.Option(help="float64 algorithm, bit-accurate model, or the Verilated RTL")
    ] = "fixed",
    stiffness: Annotated[float | None, typer.Option(help="of the wall, N/m")] = None,
    damping: Annotated[float | None, typer.Option(help="of the wall, N s/m")] = None,
    set_: SetOption = None,
    plot: PlotOption = None,
    trace: Annotated[
        Path | None, typer.Option(metavar="FILE", help=".npz: the samples; .fst: a waveform of the contact (rtl)")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Hit the wall: the founding paper's protocol, and whether the wall is stable."""
    changes = scene_changes(
        set_,
        controller__estimator=estimator,
        controller__output=output,
        wall__stiffness_n_per_m=stiffness,
        wall__damping_n_s_per_m=damping,
    )
    loaded = load(scene, changes)
    from ..pictures.hit import draw as draw_hit  # noqa: PLC0415
    from ..walls import hit as hits  # noqa: PLC0415  (compiled kernels are loaded only where they run)

    plot = picture_file(plot)
    trace = output_file(trace, "--trace", (".fst", ".npz"))
    waveform = trace if trace and trace.suffix == ".fst" else None
    if waveform and backend != "rtl":
        raise BadInput(f"--trace {waveform.name} needs --backend rtl: only hardware has waveforms")
    with progress(f"{loaded.name} {loaded.controller.estimator} {backend}", loaded.samples) as advance:
        result = hits.run(loaded, backend, bool(plot or trace), advance, waveform)
    # Whatever becomes of the files, what was computed is out.
    show(result.report(), as_json)
    if plot:
        draw(draw_hit(result), plot)
    if trace and not waveform:
        result.save(trace)
    if trace:
        log.print(f"trace: {trace}")


@app.command()
def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE.csv", help="a recording, its first line the columns' names")],
    column: Annotated[str, typer.Option(help="the column of encoder counts")],
    rate: Annotated[float | None, typer.Option(metavar="HZ", help="sample rate [default: from column time_s]")] = None,
    coarsen: Annotated[int | None, typer.Option(help="divide the counts, and judge against the full ones")] = None,
    estimator: Annotated[Estimator, typer.Option(help="velocity estimator")] = "levant",
    output: Annotated[str | None, typer.Option(help="its output, e.g. u or u1 [default: its first]")] = None,
    backend: Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or RTL")] = "fixed",
    acceleration_max: Annotated[
        float | None,
        typer.Option(metavar="C", help="counts/s^2, sets the gains [default: the recording's]"),
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="write the velocities")] = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Put recorded counts through an estimator; the RTL gets them through its pins."""
    from ..estimates.recording import RecordingError  # noqa: PLC0415
    from ..estimates.recording import load as load_recording  # noqa: PLC0415
    from ..estimates.replay import ReplayError  # noqa: PLC0415
    from ..estimates.replay import replay as run  # noqa: PLC0415
    from ..pictures.replay import draw as draw_replay  # noqa: PLC0415  (only replays need SciPy's filters)

    if out and out.exists() and file.exists() and out.samefile(file):
        raise BadInput(f"--out must be another file than the recording, not {str(out)!r}")
    out, plot = output_file(out, "--out", (".csv",)), picture_file(plot)
    try:
        recording = load_recording(file, column, rate)
        with progress(f"{file.name} {estimator} {backend}", len(recording.counts)) as advance:
            result = run(recording, estimator, output, backend, coarsen, acceleration_max, progress=advance)
    except (RecordingError, ReplayError) as error:
        raise BadInput(str(error)) from None
    show(result.report(), as_json)
    if out:
        result.save(out)
        log.print(f"velocities: {out}")
    if plot:
        draw(draw_replay(result), plot)


@app.command()
def table(
    files: Annotated[list[Path], typer.Argument(metavar="FILE", help="JSON reports of `hardwall hit --json`")],
) -> None:
    """Print reports of hits side by side."""
    columns = {
        "scene": "{scene}",
        "estimator": "{estimator} {output}",
        "backend": "{backend}",
        "K (N/m)": "{stiffness_n_per_m:g}",
        "B (N s/m)": "{damping_n_s_per_m:g}",
        "wall": "{verdict}",
        "RMS (mm)": "{rms_mm:.5f}",
        "peak force (N)": "{max_force_n:.3f}",
        "samples/s": "{samples_per_s:.3g}",
        "force words": "{digest}",
    }
    rows = []
    for file in files:
        try:
            report = json.loads(file.read_text())
            verdict = "stable" if report["stable"] else "unstable"
            fields = {**report, "verdict": verdict, "digest": (report["force_sha256"] or "")[:12]}
            rows.append([form.format(**fields) for form in columns.values()])
        except FileNotFoundError:
            raise BadInput(f"{file}: no such file") from None
        except (OSError, ValueError, KeyError, TypeError):
            raise BadInput(f"{file}: not a JSON report of `hardwall hit --json`") from None
    show_table({name: "left" if name in ("scene", "estimator", "backend") else "right" for name in columns}, rows)


@app.command()
def bench(scene: SceneArgument = "mhz", as_json: JsonOption = False) -> None:
    """Measure the closed loop's speed on every backend and under cocotb, and what optional parts cost."""
    load(scene)
    from ..studies.bench import bench as measure  # noqa: PLC0415

    report = measure(scene, log.print)
    if as_json:
        print(json.dumps(report))
        return
    costs = report.pop("ns_per_sample_of_parts")
    speeds = {f"{name} (samples/s)": value for name, value in report.pop("samples_per_s").items()}
    show(report | speeds | {f"{name} (ns/sample)": value for name, value in costs.items()}, as_json)


@app.command()
def verilog(
    scene: SceneArgument = "seed-2011",
    folder: Annotated[Path, typer.Option("-o", "--output-folder", metavar="DIR", help="made if absent")] = Path("."),
    estimator: Annotated[Estimator | None, typer.Option(help="velocity estimator [default: the scene's]")] = None,
    set_: SetOption = None,
) -> None:
    """Write the axis of a scene as Verilog, with a table of its ports."""
    spec = load(scene, scene_changes(set_, controller__estimator=estimator)).spec
    from ..rtl.sources import write_verilog  # noqa: PLC0415

    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in write_verilog(spec, folder):
            print(path)
    except OSError as error:
        raise BadInput(f"-o {str(folder)!r} cannot be written: {error.strerror}") from None


@app.command()
def synth(
    scene: SceneArgument = "mhz",
    device: Annotated[Device, typer.Option(help="the part to place and route for")] = "ecp5-25k",
    seeds: Annotated[int, typer.Option(min=1, max=99, help="how many placements; fmax is their median")] = 3,
    estimator: Annotated[Estimator | None, typer.Option(help="velocity estimator [default: the scene's]")] = None,
    set_: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Size and speed of the axis, with the serial port of a board, on a real part."""
    loaded = load(scene, scene_changes(set_, controller__estimator=estimator))
    from ..rtl.synthesis import synthesise  # noqa: PLC0415

    with log.status(f"{device}: Yosys, then nextpnr with {seeds} seeds"):
        report = synthesise(loaded.spec, device, range(1, seeds + 1), loaded.controller.glitch_clocks)
    show({"scene": loaded.name} | report, as_json)


estimators.add_commands(app)
zwidth.add_commands(app)
trade.add_commands(app)
studies.add_commands(app)
figure_5.add_commands(app)


def _interrupted(*_: object) -> None:
    """Stop at once: raising KeyboardInterrupt into compiled code, or into its compiler, crashes the process."""
    log.show_cursor()
    print("hardwall: error: interrupted", file=sys.stderr, flush=True)
    os._exit(1)


def main() -> None:
    """Run the command line; every failure is one line on stderr and an exit code."""
    signal.signal(signal.SIGINT, _interrupted)
    try:
        app(standalone_mode=False)
    except typer.TyperException as error:
        code, message = 2, " ".join(error.format_message().split())
    except (BadInput, SceneError) as error:
        code, message = 2, str(error)
    except (RuntimeError, OSError) as error:
        code, message = 1, str(error)
    else:
        return
    print(f"hardwall: error: {message}", file=sys.stderr)
    sys.exit(code)
