"""The options of the commands, and the checks of their values."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ...model.estimators import registry
from ..estimates.accuracy import RATES_HZ, outputs
from ..scene.load import names
from ..walls.methods import Curve, label
from .errors import BadInput

Estimator = Literal[tuple(registry.ESTIMATORS)]
Backend = Literal["float", "fixed", "rtl"]
Device = Literal["ecp5-25k", "ice40-up5k"]

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help=f"{', '.join(names())}, or a .toml file")]
EstimatorOption = Annotated[Estimator | None, typer.Option(help="velocity estimator", show_default="the scene's")]
OutputOption = Annotated[str | None, typer.Option(help="its output, e.g. u or u1", show_default="its first")]
EstimatorsOption = Annotated[
    str | None, typer.Option("--estimators", metavar="NAME[:OUTPUT],...", help="which", show_default="all")
]
BackendOption = Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or the Verilated RTL")]
ModelOption = Annotated[Literal["float", "fixed"], typer.Option(help="float64 algorithm, or bit-accurate model")]
DeviceOption = Annotated[Device, typer.Option(help="the part to place and route for")]
SeedsOption = Annotated[int, typer.Option(min=1, max=99, help="how many placements; fmax is their median")]
RateOption = Annotated[float, typer.Option(metavar="HZ", help="sample rate")]

WorkersOption = Annotated[int | None, typer.Option(min=1, help="processes", show_default="one a core")]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="of a Dask cluster that runs, in place of workers of its own")
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="go on where an interrupted run was")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene; an empty value takes it out"),
]
PlotOption = Annotated[Path | None, typer.Option(metavar="FILE", help="draw it: .png, .svg or .pdf")]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON on stdout, and nothing else")]


def changes_of(assignments: list[str] | None, **options: Any) -> dict[str, Any]:
    """Return scene changes from `--set` and from options for single keys (None: not given)."""
    changes = {}
    for assignment in assignments or []:
        key, equals, text = assignment.partition("=")
        if not equals or not key:
            raise BadInput(f"--set must be KEY=VALUE, not {assignment!r}")
        try:
            changes[key] = tomllib.loads(f"value = {text}")["value"] if text else None
        except tomllib.TOMLDecodeError:
            changes[key] = text
    named = {key.replace("__", "."): value for key, value in options.items() if value is not None}
    return changes | named


GAINS = ("controller.estimator", "controller.output", "controller.gains")
WALL = ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m")


def refuse(changes: dict[str, Any], keys: tuple[str, ...], instead: str) -> None:
    """Refuse changes of scene keys that the command sets itself; `instead` is the reason."""
    for key in changes:
        if key.startswith(keys):
            raise BadInput(f"--set {key} is what this command sets itself: {instead}")


def refuse_for_maps(changes: dict[str, Any], estimators: str) -> None:
    """Refuse changes of methods, for the reason `estimators`, and changes of walls."""
    refuse(changes, GAINS, estimators)
    refuse(changes, WALL, "see the scene's section zwidth")


def curves_of(wanted: str | None, papers: dict[str, Curve] | None = None) -> list[Curve]:
    """Return the estimators of a list NAME[:OUTPUT],...; the name `all` stands for all of them.

    Args:
        wanted: the list; None for all.
        papers: methods of the founding paper, whose names are accepted too.
    """
    papers, curves = papers or {}, []
    try:
        for name in (word.strip() for word in ("all" if wanted is None else wanted).split(",")):
            if name in papers:
                curves.append(papers[name])
                continue
            every = registry.ESTIMATORS if name == "all" else [name]
            curves += [Curve(label(*pair), *pair) for estimator in every for pair in outputs(estimator)]
    except ValueError as error:
        also = f", or of {', '.join(papers)}" if papers else ""
        raise BadInput(f"--estimators: {error}{also}") from None
    return list({curve.label: curve for curve in curves}.values())


def rates_of(text: str, option: str) -> list[int]:
    """Return the rates (Hz) of a list given with an option."""
    rates = []
    for word in text.split(","):
        try:
            rate = float(word)
        except ValueError:
            rate = 0.0
        if not (RATES_HZ[0] <= rate <= RATES_HZ[1] and rate == int(rate)):
            raise BadInput(f"{option} must be whole numbers of {RATES_HZ[0]:g} to {RATES_HZ[1]:g} Hz, not {word!r}")
        rates.append(int(rate))
    return list(dict.fromkeys(rates))


def output_file(path: Path | None, option: str, suffixes: tuple[str, ...]) -> Path | None:
    """Make the folder of an output file and return its path; raise BadInput if the file could not be written."""
    if path is None:
        return None
    if path.suffix not in suffixes:
        raise BadInput(f"{option} must end in {' or '.join(suffixes)}, not {str(path)!r}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("ab"):
            pass
    except OSError as error:
        raise BadInput(f"{option} {str(path)!r} cannot be written: {error.strerror}") from None
    if path.stat().st_size == 0:
        path.unlink()
    return path
