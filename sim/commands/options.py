"""What the commands of the command line share: options, input checks, tables and the progress bar."""

import json
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ...model.estimators import registry
from ..scene.load import names

log = Console(stderr=True, highlight=False)

Estimator = Literal[tuple(registry.ESTIMATORS)]
Backend = Literal["float", "fixed", "rtl"]
Device = Literal["ecp5-25k", "ice40-up5k"]

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help=f"{', '.join(names())}, or a .toml file")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene; an empty value takes it out"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON on stdout, and nothing else")]
WorkersOption = Annotated[int | None, typer.Option(min=1, help="processes [default: one a core]")]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="of a Dask cluster that runs, in place of workers of its own")
]
ResumeOption = Annotated[bool, typer.Option("--resume", help="go on where an interrupted run was")]
PlotOption = Annotated[Path | None, typer.Option(metavar="FILE", help="draw it: .png, .svg or .pdf")]


class BadInput(Exception):
    """One line: what is wrong with what was given, and what is accepted."""


def scene_changes(assignments: list[str] | None, **options: Any) -> dict[str, Any]:
    """Return scene changes from `--set` and from options of their own (None: not given)."""
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


def rates_of(text: str, option: str) -> list[int]:
    """Return the rates (Hz) of a list in an option."""
    from ..estimates.accuracy import RATES_HZ  # noqa: PLC0415  (kernels are loaded only where they run)

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
    """Return the path, its folder made; bad input if nothing could be written there."""
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


def draw(drawn, path: Path) -> None:
    """Write the pictures that a study has, and say where they are."""
    from ..pictures.style import save_all  # noqa: PLC0415  (Matplotlib is loaded only where something is drawn)

    for written in save_all(drawn, path):
        log.print(f"picture: {written}")


def picture_file(path: Path | None) -> Path | None:
    """Return where `--plot` wants the picture: see `output_file`."""
    if path is None:
        return None
    from ..pictures.style import SUFFIXES  # noqa: PLC0415  (Matplotlib is loaded only where something is drawn)

    return output_file(path, "--plot", SUFFIXES)


def show(report: dict[str, Any], as_json: bool) -> None:
    """Print a report: one JSON object, or a table of its keys."""
    if as_json:
        print(json.dumps(report))
        return
    table = Table(box=None, show_header=False)
    for key, value in report.items():
        table.add_row(Text(key, "bold"), Text(_text(value), overflow="fold"))
    Console(highlight=False, soft_wrap=True).print(table)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return ", ".join(map(_text, value)) if isinstance(value, list) else str(value)


def show_table(columns: dict[str, str], rows: list[list[str]]) -> None:
    """Print a table; `columns` maps each heading to `left` or `right`."""
    table = Table()
    for name, justify in columns.items():
        table.add_column(name, justify=justify)
    for row in rows:
        table.add_row(*map(Text, row))
    Console(highlight=False, width=max(120, log.width)).print(table)


class progress:
    """A progress bar on stderr while a run lasts; gives the function that moves it."""

    def __init__(self, title: str, total: int):
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        self._bar = Progress(*columns, console=log, transient=True, disable=not log.is_terminal)
        self._task = self._bar.add_task(escape(title), total=total)

    def __enter__(self):
        self._bar.start()
        return lambda done: self._bar.update(self._task, completed=done)

    def __exit__(self, *_) -> None:
        self._bar.stop()
