"""The command `hit`."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from ..model.runtime.termination import undone
from ..sim.pictures import FILM
from ..sim.rtl.waveform import vcd_to_fst
from ..sim.scene.schema import Scene
from ..sim.scene.several import AxesScene
from ..sim.scene.tables import load_any
from ..sim.walls import hit, hit_axes, hit_beside
from .errors import BadInput
from .options import BackendOption, EstimatorOption, OutputOption, output_file
from .scenes import SceneArgument
from .study import StudyOptions, study
from .terminal import progress


@study("set_", "plot")
def command(
    options: StudyOptions,
    scene: SceneArgument = "seed-2011",
    estimator: EstimatorOption = None,
    output: OutputOption = None,
    backend: BackendOption = "fixed",
    stiffness: Annotated[
        float | None, typer.Option(help="stiffness of the wall, N/m", show_default="the scene's")
    ] = None,
    damping: Annotated[
        float | None, typer.Option(help="damping of the wall, N s/m", show_default="the scene's")
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="write the samples into an .npz, or a waveform of the contact into an .fst (--backend rtl)",
        ),
    ] = None,
    beside: Annotated[
        str | None,
        typer.Option(metavar="SCENE", help="another scene, to hit beside the first; --plot then also takes a .gif"),
    ] = None,
) -> None:
    changes = options.changes(
        controller__estimator=estimator,
        controller__output=output,
        wall__stiffness_n_per_m=stiffness,
        wall__damping_n_s_per_m=damping,
    )
    of = load_any(scene, changes)
    if beside is not None:
        _hit_beside(options, (of, load_any(beside, changes)), backend, trace)
        return
    if options.plot and options.plot.suffix == FILM:
        raise BadInput(f"--plot {options.plot.name} needs --beside: only hits side by side are drawn in motion")
    trace = output_file(trace, "--trace", (".fst", ".npz"))
    waveform = trace if trace and trace.suffix == ".fst" else None
    if waveform and backend != "rtl":
        raise BadInput(f"--trace {waveform.name} needs --backend rtl: only hardware has waveforms")
    if isinstance(of, AxesScene):
        _hit_axes(options, of, backend, trace)
        return
    with _room_for_vcd() if waveform else nullcontext() as vcd:
        with progress(f"{of.name} {of.controller.estimator} {backend}", of.samples) as advance:
            result = hit.run(of, backend, bool(options.plot or trace), advance, vcd)
        save = partial(vcd_to_fst, vcd) if waveform else result.save
        options.finish(result, {"trace": (trace, save)} if trace else {})


def _hit_axes(options: StudyOptions, scene: AxesScene, backend: str, trace: Path | None) -> None:
    """Hit the walls of several axes, whose result has a picture of its own."""
    if trace and trace.suffix != ".npz":
        raise BadInput(f"--trace {trace.name} is a waveform of one axis: for a scene of several axes give an .npz")
    with progress(f"{scene.name} {scene.spec.estimator} {backend}", scene.samples * len(scene.axes)) as advance:
        result = hit_axes.run(scene, backend, bool(options.plot or trace), advance)
    replace(options, command="hit_axes").finish(result, {"trace": (trace, result.save)} if trace else {})


def _hit_beside(options: StudyOptions, scenes: tuple[Scene | AxesScene, ...], backend: str, trace: Path | None) -> None:
    """Hit the walls of two scenes. The result has its own picture, still or in motion."""
    for each in scenes:
        if isinstance(each, AxesScene):
            raise BadInput(f"--beside needs scenes of one axis: {each.name} has several")
    if trace:
        raise BadInput("--trace must be absent with --beside: trace each hit in its own run")
    samples = sum(each.samples for each in scenes)
    with progress(f"{' beside '.join(each.name for each in scenes)} {backend}", samples) as advance:
        result = hit_beside.run(scenes, backend, bool(options.plot), advance)
    replace(options, command="hit_beside").finish(result)


@contextmanager
def _room_for_vcd() -> Iterator[Path]:
    """Provide the path of a temporary file, which is removed at the end, by a signal, too."""
    folder = tempfile.TemporaryDirectory()
    with undone(folder.cleanup):
        yield Path(folder.name) / "axis.vcd"
