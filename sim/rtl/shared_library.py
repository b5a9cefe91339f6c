"""Verilated hardware as a shared library: built once, and cached by content."""

import hashlib
import os
import re
import shutil
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

from ...model.runtime.build_folder import build_dir, shown_path
from ...model.runtime.stages import stage
from ..jobs import children
from ..jobs.whole_folder import keep_log, whole_folder
from .verilator import LINT_OPTIONS, BuildError, check_paths, environment, first_error

LIBRARY = "library.so"
RULES = Path(__file__).with_name("library.mk")
OPTIONS = (
    *LINT_OPTIONS,
    *("-O3", "--x-assign", "fast", "--x-initial", "fast", "--noassert"),
    # All clocks of one call are iterations of a single evaluation.
    *("--converge-limit", str(1 << 30)),
    # However large the hardware, it is one piece of C++.
    *("--output-split", "0"),
)
# A closed loop runs long enough to be worth the best optimisation; the playback of a recording does not.
FAST_TO_RUN, FAST_TO_BUILD = "-O3", "-O1"


@dataclass(frozen=True)
class Recipe:
    """The parts of a shared library.

    Attributes:
        files: the sources by file name; files ending in .v are the hardware.
        shim: the name of the C++ file with the library's functions.
        prefix: the name of the class that Verilator makes.
        options: options of Verilator beside `OPTIONS`.
        optimisation: option of the C++ compiler.
        members: a regular expression; of the members of the class whose names have a part of it, `members.h` makes a
            list for the shim, MEMBERS.
    """

    files: dict[str, str]
    shim: str
    prefix: str
    options: tuple[str, ...]
    optimisation: str = FAST_TO_RUN
    members: str = ""


def build(recipe: Recipe) -> Path:
    """Return the shared library; build it first if it is missing.

    It is found by the content of the sources, the options and Verilator's version, and checked before it is used.

    Raises:
        BuildError: if the build fails.
    """
    rules, options = RULES.read_text(encoding="utf-8"), (*OPTIONS, "--prefix", recipe.prefix, *recipe.options)
    made_by = [version("verilator"), *options, recipe.optimisation, recipe.members]
    content = "\0".join([rules, *recipe.files.values(), *made_by])
    folder = build_dir() / "rtl" / hashlib.sha256(content.encode()).hexdigest()[:16]
    return whole_folder(folder, partial(_verilate, recipe, rules)) / LIBRARY


def _verilate(recipe: Recipe, rules: str, work: Path) -> None:
    """Write the sources into the folder `work`, and build the library beside them.

    Raises:
        BuildError: if the build fails.
    """
    check_paths(build_dir())
    for name, text in (recipe.files | {RULES.name: rules}).items():
        (work / name).write_text(text, encoding="utf-8")
    verilog = [name for name in recipe.files if name.endswith(".v")]
    variables = {"PREFIX": recipe.prefix, "SHIM": recipe.shim, "OPTIMISATION": recipe.optimisation}
    given = [f"{name}={value}" for name, value in variables.items()]
    commands = [
        ["verilator", "--cc", *OPTIONS, "--prefix", recipe.prefix, *recipe.options, "--Mdir", "obj", *verilog],
        ["make", "-C", "obj", "-j", str(os.cpu_count() or 1), "-f", f"../{RULES.name}", LIBRARY, *given],
    ]
    with stage("building the hardware with Verilator, once"):
        for command in commands:
            if recipe.members and command[0] == "make":
                _list_members(work / "obj", recipe)
            try:
                done = children.run(command, cwd=work, env=environment(), capture_output=True, text=True)
            except OSError as error:
                raise BuildError(f"{command[0]} cannot be run: {error.strerror or error}") from None
            if done.returncode:
                text = " ".join(command) + "\n" + done.stdout + done.stderr
                log = keep_log(build_dir() / "rtl" / "failed.log", text)
                why = first_error(log) or f"{command[0]} ended with {done.returncode}"
                raise BuildError(f"the Verilated library could not be built: {why}; see {shown_path(log)}")
    shutil.move(work / "obj" / LIBRARY, work / LIBRARY)
    shutil.rmtree(work / "obj")


def _list_members(folder: Path, recipe: Recipe) -> None:
    """Write the list of the members of Verilator's class that the shim asks for."""
    made = (folder / f"{recipe.prefix}___024root.h").read_text(encoding="utf-8")
    found = re.findall(rf"\b(\w*(?:{recipe.members})\w*)[;,)]", made)
    lines = "".join(f" MEMBER({name})" for name in dict.fromkeys(found))
    (folder / "members.h").write_text(f"#define MEMBERS{lines}\n", encoding="utf-8")
