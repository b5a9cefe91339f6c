"""The reports that pages of results are made of: which command makes each, and whether its sources have changed since.

`docs/results/reports.toml` names them. `make results` runs the commands whose report is stale, or of those named by
`ONLY`; `LIST=1` only says which are, and how long each took. A report is kept as `docs/results/reports/NAME.json`, with
its command, the version, the date and the machine. Its origin is a digest of the code of every module that the command
imports, except those that only show or keep results. Comments, docstrings, messages of errors and the help of options
are no part of it. Where a command or its report names estimators, the others are no part of it either: a new estimator
leaves most reports as they are. What reads recordings is a part only where a command names one.
"""

import argparse
import ast
import datetime
import functools
import hashlib
import json
import os
import platform
import shlex
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import chain, pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hardwall.hdl.estimators import registry as blocks
from hardwall.model.runtime.provenance import imported
from hardwall.sim.walls.methods import methods
from signoff.covering.sources import ESTIMATORS, code_of

DOCS = Path(__file__).absolute().parent
TREE = DOCS.parent
LIST, KEPT, PICTURES = DOCS / "results/reports.toml", DOCS / "results/reports", DOCS / "pictures"
SHOWING = "cli", "model/runtime", "sim/jobs", "sim/pictures"
"""Rooms that change no number, but for the command itself."""
OPTIONS = "cli/scenes.py"
"""What checks the options of all commands: what it imports for some is no source of the others."""
HARDWARE = "hdl", "sim/boards", "sim/rtl"
"""Rooms that matter to what runs the RTL, or counts its cells."""
OF_HARDWARE = "axes", "bench", "bits", "board", "choose", "costs", "synth"
"""Commands that do."""
HELP = "help", "metavar", "show_default"
"""Arguments of an option that only people read."""
READING = "sim/recordings"
"""The room that matters to a command that reads a recording."""
REGISTRIES = "model/estimators/registry.py", "hdl/estimators/registry.py"
"""What imports every estimator."""
OF_EVERY = "accuracy", "bench", "bits", "choose", "costs"
"""Commands that take every estimator if none is named; others take those of their scene, which their report names."""
DEFAULT = "levant"
"""The estimator of an axis that names none."""
NOTHING: Mapping[str, Any] = MappingProxyType({})
"""The report of a command that has not run."""
VERSION = tomllib.loads((TREE / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]


@dataclass(frozen=True)
class Wanted:
    """A report that pages want.

    Attributes:
        name: its name.
        command: the words of its command behind `hardwall`.
        picture: the file in `docs/pictures/` that the command draws; empty for none.
    """

    name: str
    command: str
    picture: str = ""

    @property
    def words(self) -> list[str]:
        """The words of the command that makes the report."""
        drawn = ["--plot", str(PICTURES / self.picture)] if self.picture else []
        return [*shlex.split(self.command), "--json", *drawn]


@dataclass(frozen=True)
class Kept:
    """A report that was made.

    Attributes:
        command: the command, as a reader types it.
        version: the version of the project.
        date: when it was made, as in ISO 8601.
        machine: the processor and the number of its cores.
        origin: the digest of the code that it comes from.
        seconds: how long it took.
        report: what the command said.
    """

    command: str
    version: str
    date: str
    machine: str
    origin: str
    seconds: float
    report: dict[str, Any]


def wanted() -> dict[str, Wanted]:
    """Return the reports that pages want, by name."""
    listed = tomllib.loads(LIST.read_text(encoding="utf-8"))
    return {name: Wanted(name, **each) for name, each in listed.items()}


def kept(name: str) -> Kept | None:
    """Return a report as it was made last; None if it never was."""
    file = KEPT / f"{name}.json"
    return Kept(**json.loads(file.read_text(encoding="utf-8"))) if file.exists() else None


def is_stale(report: Wanted) -> bool:
    """Return whether a report was never made, or by another command, or from other code."""
    found = kept(report.name)
    return found is None or (found.command, found.origin) != (
        f"hardwall {report.command}",
        origin(report.command, found.report),
    )


def _files(name: str) -> Iterator[Path]:
    """Yield the file of a module of the project."""
    inside = TREE.joinpath(*name.split(".")[1:])
    if name.startswith("hardwall."):
        yield from (file for file in (inside.with_suffix(".py"), inside / "__init__.py") if file.is_file())


class _Unsaid(ast.NodeTransformer):
    """Takes out of a source what only people read: the messages of its errors, and the help of its options."""

    def visit_Raise(self, node: ast.Raise) -> ast.Raise:
        if isinstance(node.exc, ast.Call):
            node.exc = node.exc.func
        return node

    def visit_keyword(self, node: ast.keyword) -> ast.keyword | None:
        return None if node.arg in HELP else self.generic_visit(node)


@functools.cache
def _read(content: bytes, package: str) -> tuple[str, tuple[str, ...]]:
    """Return the code of a source, and the modules that it imports."""
    return ast.unparse(_Unsaid().visit(ast.parse(code_of(content)))), tuple(imported(content, package))


def _source(file: Path) -> tuple[str, tuple[str, ...]]:
    """Return the code of a file, and the modules that it imports."""
    return _read(file.read_bytes(), ".".join(["hardwall", *file.relative_to(TREE).parent.parts]))


def _strings(said: Any) -> Iterator[str]:
    """Yield every text of a report, and every name in it."""
    if isinstance(said, str):
        yield said
    elif isinstance(said, Mapping):
        yield from said
        said = list(said.values())
    if isinstance(said, list):
        yield from chain.from_iterable(map(_strings, said))


def _chosen(words: list[str], report: Mapping[str, Any]) -> set[str]:
    """Return the modules of the estimators that a command or its report names, and of the default; empty for all."""
    named = next((after.split(",") for before, after in pairwise(words) if before == "--estimators"), [])
    if "all" in named or (not named and words[0] in OF_EVERY):
        return set()
    known = methods()
    names = {known[word].estimator if word in known else word.partition(":")[0] for word in named}
    names |= {*_strings(report)} & {*ESTIMATORS}
    return {of for name in ({*names, DEFAULT} if names else ()) for of in _modules(name)}


def _modules(name: str) -> tuple[str, str]:
    """Return the modules of an estimator, of the model and of the hardware."""
    return ESTIMATORS[name], blocks.ESTIMATORS[name].__module__


def _reads(words: list[str]) -> bool:
    """Return whether a command reads a recording: a file of the project that is no scene."""
    names = (word.partition(":")[0] for word in words if not word.endswith(".toml"))
    return any((TREE / name).is_file() for name in names)


def sources_of(command: str, report: Mapping[str, Any] = NOTHING) -> list[Path]:
    """Return the sources that the numbers of a command come from: what it imports, directly or not.

    Where the command or its report names estimators, they come in the place of what imports all of them.
    """
    words = shlex.split(command)
    chosen = _chosen(words, report)
    hardware = words[0] in OF_HARDWARE or "rtl" in words
    others = (*SHOWING, *(() if hardware else HARDWARE), *(() if _reads(words) else (READING,)))
    own = TREE / "cli" / f"{words[0]}.py"
    registries = {TREE / name for name in REGISTRIES}
    waiting, seen, followed = [own], set[Path](), set[str]()
    while waiting:
        file = waiting.pop()
        if file not in seen and file != TREE / OPTIONS:
            seen.add(file)
            _, names = _source(file)
            if chosen and file in registries:
                seen.remove(file)
                names = chosen
            waiting += (found for name in {*names} - followed for found in _files(name))
            followed.update(names)
    # A package passes names on, and of the command line the command alone has defaults that matter.
    named = (file for file in seen if file.name != "__init__.py")
    return sorted(file for file in named if file == own or not any(file.is_relative_to(TREE / room) for room in others))


def origin(command: str, report: Mapping[str, Any] = NOTHING) -> str:
    """Return a digest of the code that a command's report comes from, of the project's scenes, and of its own scene.

    Args:
        command: the command.
        report: what it said; without it, all estimators are its sources.
    """
    digest = hashlib.sha256()
    for file in sources_of(command, report):
        digest.update(f"{file.relative_to(TREE)}\0{_source(file)[0]}\0".encode())
    own = (TREE / word for word in shlex.split(command) if word.endswith(".toml"))
    for scene in (*sorted((TREE / "sim/scene/builtin").glob("*.toml")), *own):
        digest.update(json.dumps(tomllib.loads(scene.read_text(encoding="utf-8")), default=str).encode())
    return digest.hexdigest()[:16]


def machine() -> str:
    """Return what a report's times depend on."""
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"


def make(report: Wanted) -> Kept:
    """Run the command of a report, and keep what it says.

    Raises:
        subprocess.CalledProcessError: if the command fails.
    """
    began, before = time.monotonic(), origin(report.command)
    program = [sys.executable, "-c", "from hardwall.cli.app import main; main()"]
    done = subprocess.run([*program, *report.words], cwd=TREE, stdout=subprocess.PIPE, text=True, check=True)
    # A folder of the build is named from the checkout on.
    said = json.loads(done.stdout.replace(f"{TREE}/", ""))
    made = Kept(
        command=f"hardwall {report.command}",
        version=VERSION,
        date=datetime.datetime.now(tz=datetime.UTC).date().isoformat(),
        machine=machine(),
        # Sources that changed meanwhile may be any of them.
        origin=origin(report.command, said) if origin(report.command) == before else "",
        seconds=round(time.monotonic() - began, 1),
        report=said,
    )
    KEPT.mkdir(exist_ok=True)
    unfinished = KEPT / f"{report.name}.new"
    unfinished.write_text(_text_of(made), encoding="utf-8")
    unfinished.replace(KEPT / f"{report.name}.json")
    return made


def _text_of(made: Kept) -> str:
    """Return a report as it is kept: a line for each key, and one for all that the command said, which may be long."""
    lines = (f" {json.dumps(key)}: {json.dumps(value, separators=(',', ':'))}" for key, value in asdict(made).items())
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> None:
    """Make the stale reports, or those named."""
    parser = argparse.ArgumentParser(description="Make the reports that pages of results are made of.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="reports to make; none for all that are stale")
    parser.add_argument("--list", action="store_true", help="say what is stale, and run nothing")
    options = parser.parse_args()
    known = wanted()
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"NAME must be one of {', '.join(known)}, not {unknown[0]}")
    chosen = [known[name] for name in options.names] or [report for report in known.values() if is_stale(report)]
    for report in chosen:
        before = kept(report.name)
        took = f"took {before.seconds:.0f} s" if before else "never made"
        print(f"{report.name}: hardwall {report.command} ({took})", flush=True)
        if not options.list:
            print(f"{report.name}: {make(report).seconds:.0f} s", flush=True)
    print(f"results: {len(chosen)} of {len(known)} {'to make' if options.list else 'made'}")


if __name__ == "__main__":
    main()
