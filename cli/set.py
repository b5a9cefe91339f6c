"""The command `set`."""

from typing import Annotated

import typer

from ..host.port import BAUD
from ..model.checks import shown
from ..model.runtime.result import Values
from .errors import BadInput
from .plain_numbers import plain_number
from .port import BaudOption, IdentityOption, PaceOption, PortArgument, axis_at
from .report import ReportOptions, reports


@reports()
def command(
    options: ReportOptions,
    port: PortArgument,
    words: Annotated[
        list[str], typer.Argument(metavar="WORD=VALUE...", help="words to write, in SI units, e.g. wall_stiffness=2e3")
    ],
    baud: BaudOption = BAUD,
    identity: IdentityOption = None,
    pace: PaceOption = None,
) -> None:
    values = values_of(words)
    with axis_at(port, baud, identity, pace) as axis:
        axis.set(**values)
        used = {name: axis.get(name) for name in values}
    options.finish(Values(used))


def values_of(words: list[str]) -> dict[str, float]:
    """Return the values of words as they are given on the command line."""
    values: dict[str, float] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or name in values:
            raise BadInput(f"a word must be NAME=NUMBER, each once, not {shown(word)}")
        try:
            values[name] = plain_number(text)
        except ValueError as error:
            raise BadInput(f"{shown(name)} {error}") from None
    return values
