"""How long a user waits at the prompt: whole commands, each a process, of this checkout and of another one."""

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...model.runtime.build_folder import build_dir
from ...model.runtime.result import Table, table_of
from ..jobs import children
from ..jobs.scratch import scratch

PROGRAM = "import sys; sys.argv[0] = 'hardwall'; from hardwall.cli.app import main; main()"
SPEED = "samples_per_s"
BUILD = "HARDWALL_BUILD"
PLACES = (".venv/bin/hardwall", "bin/hardwall")
"""The places of the program in a checkout that `make tools` has set up, and in an environment of one's own."""
HERE = (sys.executable, "-c", PROGRAM)
"""This hardwall, wherever it was imported from."""


@dataclass(frozen=True)
class Command:
    """A command to be measured.

    Attributes:
        words: its words, without `hardwall`.
        rounds: how often it is run.
        speed: whether its own speed is taken, in samples a second, rather than the seconds that it takes.
        cold: whether it begins with nothing that an earlier one has compiled, built or found.
        lately: whether an older hardwall may refuse it, which then has no values.
    """

    words: tuple[str, ...]
    rounds: int
    speed: bool = False
    cold: bool = False
    lately: bool = False


SCENE = "scene.toml"
"""The file of the scene whose hits give the speed of the loop."""
SHORT = ("--set", "protocol.settle_s=0.1", "--set", "protocol.mean_s=0.05", "--set", "protocol.measure_s=0.1")
SHORTER = ("--set", "protocol.settle_s=0.01", "--set", "protocol.mean_s=0.005", "--set", "protocol.measure_s=0.01")
FIGURE_5 = (
    *("zwidth", "seed-2011", "--starts", "1", "--set", "protocol.verdict=literal"),
    *("--set", "zwidth.damping_step_n_s_per_m=42.0", "--json"),
)
"""The paper's own Figure 5, coarse in B: hits of bounded length, short enough for the RTL, too."""
COMMANDS = {
    "float (samples/s)": Command(("hit", SCENE, "--backend", "float", "--json"), 5, speed=True),
    "fixed (samples/s)": Command(("hit", SCENE, "--json"), 5, speed=True),
    "rtl (samples/s)": Command(("hit", SCENE, "--backend", "rtl", *SHORT, "--json"), 5, speed=True),
    "eight axes on fixed (samples/s)": Command(("hit", "eight-axes", "--json"), 5, speed=True, lately=True),
    "eight axes on rtl (samples/s)": Command(
        ("hit", "eight-axes", "--backend", "rtl", *SHORTER, "--json"), 5, speed=True, lately=True
    ),
    "a hit (s)": Command(("hit", "seed-2011", "--json"), 5),
    "a hit, nothing compiled (s)": Command(("hit", "seed-2011", "--json"), 3, cold=True),
    "Figure 5, coarse, on fixed (s)": Command(FIGURE_5, 3, lately=True),
    "Figure 5, coarse, on rtl, nothing built (s)": Command((*FIGURE_5, "--backend", "rtl"), 3, cold=True, lately=True),
}
"""The commands, by what is measured."""


def program_of(folder: Path) -> Path:
    """Return the program of another checkout or environment.

    Raises:
        ValueError: if there is none.
    """
    for place in PLACES:
        # A path that cannot be examined, for instance with too long a name, is none.
        if os.path.exists(folder / place):
            return folder.absolute() / place
    raise ValueError(f"must be a checkout in which make tools has run, or an environment with hardwall, not {folder}")


@dataclass(frozen=True)
class Wait:
    """The values of one command, here and by another hardwall, pair by pair; `other` is empty without one."""

    name: str
    here: list[float]
    other: list[float]

    @property
    def ratios(self) -> list[float]:
        """How many times as fast each run here is as the other's beside it, sorted."""
        pairs = zip(self.here, self.other, strict=False)
        return sorted(here / other if self.name.endswith("(samples/s)") else other / here for here, other in pairs)

    def report(self) -> dict[str, Any]:
        """Return the medians and the ratios."""
        median = statistics.median(self.ratios) if self.other else None
        spread = [self.ratios[0], self.ratios[-1]] if self.other else None
        other = statistics.median(self.other) if self.other else None
        return {
            "name": self.name,
            "here": statistics.median(self.here),
            "against": other,
            "times_as_fast": median,
            "times_as_fast_from_to": spread,
        }


def table(waits: list[Wait]) -> Table:
    """Return what was measured as a table."""
    rows, compared = [], any(wait.other for wait in waits)
    for wait in waits:
        report = wait.report()
        row = [wait.name, f"{report['here']:.4g}"]
        if compared and not wait.other:
            row += ["", ""]
        elif compared:
            low, high = report["times_as_fast_from_to"]
            row += [f"{report['against']:.4g}", f"{report['times_as_fast']:.2f} ({low:.2f} to {high:.2f})"]
        rows.append(row)
    return table_of(("from the prompt",), ("here", "against", "times as fast")[: 3 if compared else 1], rows)


def _run(program: Sequence[str], command: Command, text: str, build: str | None) -> float:
    """Run a command of a program, with the text of a scene; return its seconds, or its own speed.

    Raises:
        RuntimeError: if it fails.
    """
    environ = {key: value for key, value in os.environ.items() if key != BUILD}
    if program != HERE:
        environ.pop("PYTHONPATH", None)
    with scratch(build_dir() / "bench") as folder:
        (folder / SCENE).write_text(text, encoding="utf-8")
        environ[BUILD] = build or str(folder / "build")
        words = [*program, *command.words]
        began = time.perf_counter()
        done = children.run(words, cwd=folder, env=environ, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        seconds = time.perf_counter() - began
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise RuntimeError(f"{' '.join(command.words)} by {program[0]} failed: {last}")
    return json.loads(done.stdout)[SPEED] if command.speed else seconds


def measure(text: str, against: Path | None, progress: Callable[[str], None]) -> list[Wait]:
    """Measure every command, in turns with the program of another hardwall if one is given.

    Args:
        text: the text of a scene.
        against: the other's program, from `program_of`.
        progress: called with a text that names the next run.

    Raises:
        RuntimeError: if a command fails.
    """
    waits = []
    programs = [HERE, *([(str(against),)] if against else [])]
    for name, command in COMMANDS.items():
        values: list[list[float]] = [[], []]
        sides = programs
        # The first warm run fills the cache.
        untimed = int(not command.cold)
        for number in range(-untimed, command.rounds):
            progress(f"round {number + 1} of {command.rounds}: {name}")
            for side, program in enumerate(sides):
                kept = str(build_dir() / "bench" / f"kept-{side}")
                try:
                    values[side].append(_run(program, command, text, None if command.cold else kept))
                except RuntimeError:
                    if program == HERE or not command.lately:
                        raise
                    sides = [HERE]
        waits.append(Wait(name, values[0][untimed:], values[1][untimed:]))
    return waits
