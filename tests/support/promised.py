"""The names that keep their meaning, as *Limits* on the pages promises: Python, hardware, commands, reports, scenes.

    PYTHONPATH=tests .venv/bin/python -m support.promised

writes them anew to `promised.txt`, a name a line. A change that takes a line away breaks a promise.
"""

import inspect
import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from hardwall import cli, testing
from hardwall.cli.group import COMMANDS, loaded
from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.axis.board import Board
from hardwall.sim.scene import schema
from hardwall.sim.scene.section import Section
from stimuli.specs import spec

FILE = Path(__file__).with_name("promised.txt")
PYTHON = (
    *(("model", name) for name in ("EdgeVelocityEstimator", "Motion", "Sampler", "VelocityEstimator")),
    *(("model", name) for name in ("velocity", "velocity_of_edges")),
    *(("model", f"velocity_and_acceleration{of_edges}") for of_edges in ("", "_of_edges")),
    *(("model.axis", "Axis"), ("model.axis", "step"), ("model.spec", "AxisSpec"), ("model.stamped", "run")),
    ("hdl.verilog_module", "VerilogModule"),
    ("sim.scene", "spec"),
)


def of_python() -> Iterator[str]:
    """Yield the names of Python, each argument of what is called, and what a class has."""
    found = {f"hardwall.{module}.{name}": getattr(import_module(f"hardwall.{module}"), name) for module, name in PYTHON}
    found |= {f"hardwall.testing.{name}": getattr(testing, name) for name in testing.__all__}
    for name, each in found.items():
        yield from _called(name, each)
        if isinstance(each, type):
            for inner in (inner for inner in dir(each) if not inner.startswith("_")):
                yield from _called(f"{name}.{inner}", getattr(each, inner))


def _called(name: str, found: object) -> Iterator[str]:
    yield f"python {name}"
    # What is compiled has the function that it was made from.
    function = getattr(found, "py_func", found)
    if callable(function):
        yield from (
            f"python {name} {argument}" for argument in inspect.signature(function).parameters if argument != "self"
        )


def of_hardware() -> Iterator[str]:
    """Yield the ports of an axis and of its board, and the run-time words with the addresses of their registers."""
    board = Board(spec("paper"))
    for top in (Axis(spec("paper")), board):
        for name, member in top.signature.members.items():
            yield f"port {type(top).__name__.lower()} {name} {member.flow.name.lower()}"
    for register in board.registers.words:
        yield f"word {register.name} 0x{register.address:04x}"


def of_commands() -> Iterator[str]:
    """Yield the commands with their options, and the keys of their reports."""
    for name in COMMANDS:
        yield f"command {name}"
        for option in loaded(name).params:
            yield from (f"command {name} {text}" for text in (*option.opts, *option.secondary_opts))
    reports = json.loads(Path(cli.__file__).with_name("reports.schema.json").read_text(encoding="utf-8"))["$defs"]
    for name, report in reports.items():
        yield from (f"report {name} {key}" for key in report.get("properties", ()))


def of_scenes() -> Iterator[str]:
    """Yield the keys of a scene, by their sections."""

    def keys(section: type[Section], path: str) -> Iterator[str]:
        for name, field in section.model_fields.items():
            inner = [
                each for each in (field.annotation, *getattr(field.annotation, "__args__", ())) if _is_section(each)
            ]
            yield f"scene {path}{name}"
            for each in inner:
                yield from keys(each, f"{path}{name}.")

    yield from keys(schema.Scene, "")


def _is_section(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)


def names() -> list[str]:
    """Return all of them, sorted."""
    return sorted({*of_python(), *of_hardware(), *of_commands(), *of_scenes()})


if __name__ == "__main__":
    FILE.write_text("".join(f"{name}\n" for name in names()), encoding="utf-8")
