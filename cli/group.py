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
    "hit": "Simulate a hit of the wall by the founding paper's protocol; say whether the wall is stable.",
    "replay": "Run a velocity estimator on recorded counts, or on the edges of a logic analyser's capture.",
    "table": "Print the JSON reports of several hits as one table.",
    "bench": "Measure the speed of the closed loop: every backend, cocotb, and what each optional part costs.",
    "verilog": "Write the axis of a scene as Verilog, with a table of its ports; --board adds what a board needs.",
    "virtual": "Run the board of a scene, with its plant, behind a serial port that a host opens.",
    "connect": "Show the board at a port: its identity, its state and why it tripped; with --registers every register.",
    "set": "Write words of a board, in SI units, and commit them together.",
    "config": "Save the words of a board to a file, load them into it again, or show what differs.",
    "share": "Share the port of a board among several programs: one of them writes, any number read.",
    "arm": "Arm a board, so that it drives its motor, and keep it armed while this command runs.",
    "disarm": "Disarm a board: its drive becomes 0.",
    "home": "Wait until a hand moves the handle over the encoder's index, and give the index a position.",
    "capture": "Record a board's samples around an event, at up to the full sample rate, into a file and a picture.",
    "watch": "Show the state, position, velocity and force of a board's axis as they change.",
    "panel": "Serve a page for the browser, on which a board is watched, set and armed; `virtual` takes a simulated "
    "board.",
    "board": "Build a bitstream and the wiring instructions for a board from a scene; --program loads the bitstream.",
    "synth": "Synthesise a scene's axis, supervisor and link for an FPGA: its logic cells and highest clock rate.",
    "accuracy": "Measure the error of velocity estimators at every sample rate, on known motions or on recordings.",
    "rivals": "Compare velocity estimators of other projects with this project's: dVRK's, LinuxCNC's, ODrive's and "
    "others, on known motions or on recordings.",
    "costs": "Count the logic cells of each estimator on an FPGA, and the highest clock rate of a board with it "
    "(a minute or two each).",
    "axes": "Count the logic cells of 1 to 32 axes in one pipeline on an ECP5, and give their highest sample rate "
    "(some minutes each).",
    "choose": "Print a table to choose an estimator by: its error in each situation, with one set of gains, "
    "and its cost.",
    "bits": "Show how the error grows and the logic shrinks as the words of an estimator lose one bit after another.",
    "zwidth": "Map the stable walls: for each estimator, the largest stable stiffness at every damping.",
    "lipschitz": "Estimate C, the bound on the acceleration, from sines fitted to a hit; give Levant's gains for it "
    "(Figure 4 of the paper).",
    "trade": "Compare speed and accuracy: the time that a coarser backend, device, rate, solver or map saves, "
    "and its errors.",
    "response": "Show gain and lead of an estimator on a sine, by its amplitude: its describing function.",
    "cutoff": "Find the best cutoff of the filter after a finite difference, by the area of the stable region.",
    "gains": "Search Levant's gains on a grid of lambda and alpha, by the area of the stable region, for both outputs.",
    "rates": "Find the stiffest stable wall by sample rate, 1 kHz to 1 MHz, and the part of the device that limits it.",
    "mass": "Find which virtual mass is stable, by estimator, sample rate and wall, beside the theory.",
    "rendered": "Compare the stiffness and damping that a wall renders with those commanded, by frequency; and its "
    "rate-hardness.",
    "drop": "Test why Levant's stable region ends sharply at one damping, and which estimators have no such drop.",
    "assumptions": "Show which facts of the paper's Figure 5 depend on which assumed value, and on the grid.",
    "fit": "Search mass, friction, delay and whatever else the paper omits, for a device that reproduces its Figure 5.",
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

    The modules have the names of `COMMANDS`: a table of 30 imports would load them all; a help needs none.
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
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and exit")
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
        # A shell that asks without the words so far gets nothing: any output would land in its user's line.
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
