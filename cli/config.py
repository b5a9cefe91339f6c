"""The command `config`."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from ..host.config import Config, Difference
from ..host.errors import ConfigError, NotReadyError
from ..host.port import BAUD
from ..model.runtime.result import Table
from .errors import BadInput
from .options import output_file
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports
from .terminal import log, show

Act = Literal["save", "load", "diff"]
SUFFIX = ".toml"


@dataclass(frozen=True)
class Done:
    """The result of a command on a file.

    Attributes:
        act: what was asked for.
        config: the words of the file.
        differences: the words that were others on the board.
        committed: whether they were loaded.
        seen: whether the differences are shown already.
    """

    act: Act
    config: Config
    differences: list[Difference]
    committed: bool = False
    seen: bool = False

    def report(self) -> dict[str, Any]:
        return {
            "act": self.act,
            "identity": self.config.facts["identity"],
            "words": len(self.config.words),
            "rows": [each._asdict() for each in self.differences],
            "committed": self.committed,
        }

    def tables(self) -> list[Table]:
        return [_table(self.differences)] if self.differences and not self.seen else []

    def notes(self) -> list[str]:
        if self.act == "save":
            return [f"{len(self.config.words)} words of the board {self.config.facts['identity']}"]
        said = f"{len(self.differences)} of {len(self.config.words)} words"
        return [f"{said} loaded, and committed together" if self.committed else f"{said} differ"]


@reports()
def command(
    options: ReportOptions,
    act: Annotated[
        Act,
        typer.Argument(
            metavar="save|load|diff",
            help="save from the board to the file, load from the file into the board, or show the differences",
        ),
    ],
    port: PortArgument,
    saved: Annotated[
        Path, typer.Argument(metavar="FILE.toml", help="file with the words in SI units and the board's identity")
    ],
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
    yes: Annotated[bool, typer.Option("--yes", help="load without asking; needed outside a terminal")] = False,
) -> None:
    asked = act == "load" and not yes
    if yes and act != "load":
        raise BadInput(f"--yes is for `hardwall config load`, not for {act}")
    if asked and (options.as_json or not sys.stdin.isatty()):
        raise BadInput("`hardwall config load` asks in a terminal before it commits; elsewhere it needs --yes")
    try:
        config = None if act == "save" else Config.read(saved)
        if act == "save":
            output_file(saved, "FILE", (SUFFIX,))
        with axis_at(port, baud, identity, pace) as axis:
            if config is None:
                config = Config.of(axis, port)
                options.finish(Done(act, config, []), {"words": (saved, lambda to: config.write(to, axis.device))})
                return
            differences = config.differences(axis)
            loads = act == "load" and bool(differences)
            seen = loads and not options.as_json
            if seen:
                show(_table(differences))
            if loads and asked and not _agrees(len(differences)):
                raise NotReadyError("nothing was loaded: the answer was no")
            if loads:
                config.load(axis, differences)
    except ConfigError as error:
        raise BadInput(str(error)) from None
    options.finish(Done(act, config, differences, loads, seen))


def _table(differences: list[Difference]) -> Table:
    rows = [[each.name, str(each.board), str(each.file), each.unit] for each in differences]
    return Table({"word": "left", "board": "right", "file": "right", "unit": "left"}, rows)


def _agrees(number: int) -> bool:
    """Ask in the terminal whether so many words are written."""
    log.print(f"write {number} words to the board, and commit them together? [y/N] ", end="")
    return sys.stdin.readline().strip().lower() in ("y", "yes")
