"""The options of the commands, and the checks of their values."""

import math
import os
import re
import stat
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ...model.axes import AXES_MAX
from ...model.checks import shown
from ...model.estimators import registry
from ..boards.parts import PARTS
from ..estimates.accuracy import FASTEST, LEARNED, RATES_HZ, SCENE, outputs
from ..scene.errors import SceneError
from ..scene.load import load, names, toml_of
from ..walls.methods import Curve, label
from ..walls.worst import HELD_BY
from .errors import BadInput

Estimator = Literal[tuple(registry.ESTIMATORS)]
Backend = Literal["float", "fixed", "rtl"]
PartName = Literal[tuple(PARTS)]


def _scenes(incomplete: str) -> list[str]:
    """Return the scenes whose names begin so, for the completion of a shell."""
    return [name for name in names() if name.startswith(incomplete)]


SceneArgument = Annotated[
    str,
    typer.Argument(metavar="SCENE", help=f"{', '.join(names())}, or a .toml file", autocompletion=_scenes),
]
SceneOfBoardArgument = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENE",
        help=f"{', '.join(names())}, or a .toml file",
        autocompletion=_scenes,
        show_default="the board's own, at a clock that it makes",
    ),
]
EstimatorOption = Annotated[
    Estimator | None,
    typer.Option(
        metavar="NAME", help=f"velocity estimator: {', '.join(registry.ESTIMATORS)}", show_default="the scene's"
    ),
]
OutputOption = Annotated[
    str | None, typer.Option(help="output of the estimator, e.g. u or u1", show_default="its first")
]
EstimatorsOption = Annotated[
    str | None,
    typer.Option("--estimators", metavar="NAME[:OUTPUT],...", help="estimators, or `all`", show_default="all"),
]


def methods_option(default: str) -> Any:
    """Return the option for estimators by name or by the founding paper's methods, with its default in words."""
    listed = "NAME[:OUTPUT],..."
    return typer.Option("--estimators", metavar=listed, help="estimators, as zwidth takes them", show_default=default)


BackendOption = Annotated[Backend, typer.Option(help="float64 algorithm, bit-accurate model, or the Verilated RTL")]
ModelOption = Annotated[Literal["float", "fixed"], typer.Option(help="float64 algorithm, or bit-accurate model")]
DeviceOption = Annotated[PartName, typer.Option(help="the part to place and route for")]
AxesOption = Annotated[
    int | None,
    typer.Option(
        min=1, max=AXES_MAX, metavar="N", help="several axes, each at the scene's rates", show_default="one alone"
    ),
]
SeedsOption = Annotated[int, typer.Option(min=1, max=99, help="number of placements; fmax is their median")]
RateOption = Annotated[float, typer.Option(metavar="HZ", help="sample rate")]

WorkersOption = Annotated[
    int | None, typer.Option(min=1, max=1024, help="number of threads", show_default="one a core")
]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="address of a running Dask cluster, whose workers are used")
]
StartsOption = Annotated[
    int, typer.Option(min=1, max=10_000, metavar="N", help="number of starts that every wall at the edge is hit from")
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="go on where an interrupted run ended")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene; an empty value takes it out"),
]
EncoderSetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="encoder.KEY=VALUE", help="give the encoder an error: a key of a scene's encoder"),
]
PlotOption = Annotated[Path | None, typer.Option(metavar="FILE", help="draw the result: .png, .svg or .pdf")]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON on stdout, and nothing else")]


def changes_of(assignments: list[str] | None, **options: Any) -> dict[str, Any]:
    """Return scene changes from `--set` and from options for single keys (None: not given)."""
    changes: dict[str, Any] = {}
    for assignment in assignments or []:
        key, equals, text = assignment.partition("=")
        if not equals or not key:
            raise BadInput(f"--set must be KEY=VALUE, not {shown(assignment)}")
        _change(changes, "--set", key, value_of(key, text) if text else None)
    for name, value in options.items():
        if value is not None:
            key = name.replace("__", ".")
            _change(changes, f"--{key.rpartition('.')[2].partition('_')[0]}", key, value)
    return changes


def encoder_of(assignments: list[str] | None) -> dict[str, Any]:
    """Return the errors of the encoder that is measured, by their keys of a scene, from `--set`."""
    changes = changes_of(assignments)
    for key in changes:
        if not key.startswith("encoder.") or key == "encoder.count_m":
            raise BadInput(f"--set must be of an error of the encoder, encoder.KEY=VALUE, not {shown(key)}")
    if changes:
        try:
            load(SCENE, FASTEST | {key: value for key, value in changes.items() if key != LEARNED})
        except SceneError as error:
            raise BadInput(str(error)) from None
    return changes


def _change(changes: dict[str, Any], option: str, key: str, value: Any) -> None:
    """Add the change of a key by an option; a key may be changed once, and not after keys inside of it."""
    for earlier in changes:
        if f"{earlier}.".startswith(f"{key}."):
            raise BadInput(f"{option} must change each key once, not {shown(key)} after {shown(earlier)}")
    changes[key] = value


def value_of(key: str, text: str) -> Any:
    """Return the value of a key on the command line: one TOML value; what is no TOML is a text of its own."""
    if not text.isprintable():
        raise BadInput(f"--set {shown(key)} must be one value on one line, not {shown(text)}")
    try:
        # Nothing can follow a value in an inline table but another key.
        found = toml_of(f"table = {{ value = {text} }}")
    except ValueError:
        return float(text) if DECIMAL.fullmatch(text) else text
    if found.keys() != {"table"} or found["table"].keys() != {"value"}:
        raise BadInput(f"--set {shown(key)} must be one value, not {shown(text)}")
    return found["table"]["value"]


DECIMAL = re.compile(r"[+-]?([0-9]+\.[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""A number as people write it and TOML does not, `.35` or `2.`."""

GAINS = ("controller.estimator", "controller.output", "controller.gains")
WALL = ("wall.stiffness_n_per_m", "wall.damping_n_s_per_m")


def refuse(changes: dict[str, Any], keys: tuple[str, ...], instead: str) -> None:
    """Refuse changes of scene keys that the command sets itself; `instead` is the reason."""
    for key in changes:
        if key.startswith(keys):
            raise BadInput(f"--set {shown(key)} is what this command sets itself: {instead}")


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


def hands_of(wanted: str) -> list[str]:
    """Return the hands of a list NAME,...; the name `all` stands for all of them."""
    hands = []
    for name in (word.strip() for word in wanted.split(",")):
        if name not in ("all", *HELD_BY):
            raise BadInput(f"--hands must be all, or some of {', '.join(HELD_BY)}, not {shown(name)}")
        hands += HELD_BY if name == "all" else [name]
    return list(dict.fromkeys(hands))


def numbers_of(text: str, option: str, least: float, most: float, unit: str, whole: bool = False) -> list[float]:
    """Return the numbers, or whole numbers, of a list given with an option, each once; raise BadInput if one is not
    `least` to `most`."""
    numbers = []
    for word in text.split(","):
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not least <= number <= most or (whole and number != int(number)):
            kind = "whole numbers" if whole else "numbers"
            raise BadInput(f"{option} must be {kind} of {least:g} to {most:g} {unit}, not {shown(word)}")
        numbers.append(number)
    return list(dict.fromkeys(numbers))


def rates_of(text: str, option: str) -> list[int]:
    """Return the rates (Hz) of a list given with an option."""
    return [int(rate) for rate in numbers_of(text, option, *RATES_HZ, "Hz", whole=True)]


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
