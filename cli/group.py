"""The commands by name. The module of a command is imported only when the command runs, or shows its own help."""

import os
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from ..model.runtime.extras import version_of_project
from .errors import BadInput
from .plain_numbers import is_plain
from .terminal import hear_stages

COMMANDS = {
    "hit": "Hit the wall: the founding paper's protocol, and whether the wall is stable.",
    "replay": "Put recorded counts, or captured edges, through an estimator; the RTL gets them through its pins.",
    "table": "Print reports of hits side by side.",
    "bench": "Measure the closed loop's speed on every backend and under cocotb, and what optional parts cost.",
    "verilog": "Write the axis of a scene as Verilog, with a table of its ports, and what a board needs around it.",
    "virtual": "Run the board of a scene, with its plant, behind a serial port that a host opens.",
    "connect": "What the board at a port is: its identity, its state, why it tripped, and every register.",
    "set": "Write words of a board, in SI units, and commit them together.",
    "config": "Save the words of a board to a file, load them into it again, or show what differs.",
    "share": "Have the port of a board for several programs: one that writes, and any number that read.",
    "arm": "Let a board drive, and keep it so while this command runs.",
    "disarm": "Make a board's drive 0.",
    "home": "Find the index of a board's encoder by hand, and make it the origin.",
    "capture": "Capture a board's samples at their full rate around an event, into a file and a picture.",
    "watch": "Show what a board's axis does.",
    "panel": "A page in the browser to see a board, set it and arm it; with `virtual`, to feel the wall of one "
    "in simulation.",
    "board": "From a scene to a bitstream for a board, with its wiring; and into the board, if it is connected.",
    "synth": "Size and speed of the axis, as the board with supervisor and link, on a real part.",
    "accuracy": "Hold velocity estimators against the exact derivative of known motions, at any rate.",
    "costs": "What each estimator takes of a device: alone, and the board with it placed and routed "
    "(a minute or two each).",
    "axes": "What 1 to 32 axes in one pipeline take of an ECP5, and how fast each is: with supervisors, without pins "
    "(some minutes each).",
    "choose": "The table to choose an estimator by: its error in each situation, all with one set of gains, "
    "and its cost.",
    "bits": "What a bit buys: error and logic as the words of an estimator shrink bit by bit from the derived widths.",
    "zwidth": "Map the walls that are stable: for each estimator, the largest stiffness at every damping.",
    "lipschitz": "The bound C on the acceleration, from sines fitted to a hit, and the gains that follow: "
    "the paper's Figure 4.",
    "trade": "Speed against accuracy: what a coarser backend, device, rate, solver or map saves, "
    "and what it gets wrong.",
    "cutoff": "The best cutoff of a filter behind a finite difference: the area of the stable region against it.",
    "gains": "Levant's gains, searched in full: the area of the stable region over lambda and alpha, for both outputs.",
    "rates": "What rate buys a stiff wall, 1 kHz to 1 MHz, and which part of the device ends it.",
    "rendered": "What a wall renders of the stiffness and damping that it is commanded, by frequency, and its "
    "rate-hardness at contact.",
    "drop": "Why Levant's stable region ends at one damping, in a sharp drop; and estimators that have none.",
    "fit": "Search what the paper does not give (mass, friction, delay ...) for a device that shows its Figure 5.",
}
"""The purpose of every command in one line, which is all of its help except the options."""


class LazyGroup(TyperGroup):
    """A group of commands that are a name and a line of help until they are called."""

    def __init__(self, **settings: Any):
        stubs = {name: TyperCommand(name=name, help=line) for name, line in COMMANDS.items()}
        super().__init__(**settings | {"commands": stubs})

    def resolve_command(self, context: Any, words: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the name of the command that is called, the command with its options, and the remaining words.

        Raises:
            BadInput: if there is no such command.
        """
        try:
            name, stub, rest = super().resolve_command(context, words)
        except typer.TyperException:
            raise BadInput(f"the command must be one of {', '.join(COMMANDS)}, not {words[0]!r}") from None
        return name, stub and loaded(name), rest


def loaded(name: str) -> Any:
    """Import the module of a command; return the command with its options.

    The modules have the names of `COMMANDS`: a table of 30 imports would load them all, for a help that needs none.
    """
    alone = typer.Typer(add_completion=False)
    alone.command(name, help=COMMANDS[name])(import_module(f".{name}", __package__).command)
    command = typer.main.get_command(alone)
    for param in command.params:
        if isinstance(param, TyperOption) and param.type_descriptor.annotation in (int, float):
            param.process_value = _only_plain(param)
    return command


def _only_plain(option: TyperOption) -> Callable[[Any, Any], Any]:
    """Return what takes the value of an option, if that is a plain number: Python's own has `_` between digits, too."""
    process = option.process_value

    def take(context: Any, value: Any) -> Any:
        if isinstance(value, str) and not is_plain(value):
            from .refusal import refused  # noqa: PLC0415  (its words come from what a scene is made of)

            raise BadInput(refused(option, value))
        return process(context, value)

    return take


def _version(wanted: bool) -> None:
    if wanted:
        print(f"hardwall {version_of_project() or 'without a version, for its folder was copied'}")
        raise typer.Exit


COMPLETING = "_HARDWALL_COMPLETE"
"""The variable with which a shell asks for completions."""

app = typer.Typer(
    cls=LazyGroup,
    pretty_exceptions_enable=False,
    help="A stiff virtual wall in hardware: encoder edges in, force out.",
)


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version, and end")
    ] = False,
) -> None:
    pass


def run() -> None:
    """Run the command that is called; without any, print the help.

    Raises:
        BadInput: if a command, an option or an argument is not valid.
        OSError: if the current folder is needed, and was removed.
    """
    hear_stages()
    try:
        app(sys.argv[1:] or ["--help"], prog_name="hardwall", standalone_mode=False)
    except typer.TyperException as error:
        from .refusal import refusal  # noqa: PLC0415  (its words come from what a scene is made of)

        raise BadInput(refusal(error)) from None
    except (KeyError, ValueError):
        # A shell that asks without the words so far is told nothing: what is printed stands in its user's line.
        if COMPLETING not in os.environ:
            raise
        sys.exit(1)
    except FileNotFoundError as error:
        # Python's own message names no folder.
        if error.filename is None and not _is_somewhere():
            raise OSError("the current folder was removed; a run needs one that exists") from None
        raise


def _is_somewhere() -> bool:
    """Return whether the current folder exists; compilation needs one, even where all other paths are absolute."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True
