"""Questions to the solver that Yosys has, each in a process whose time the system limits."""

import json
import shutil
import subprocess
from pathlib import Path

from hardwall.sim.jobs import children
from hardwall.sim.rtl import tools
from hardwall.sim.rtl.flow import YOSYS

from .netlist import BLOCK, SELECTOR, SELECTOR_BITS

CPU_S = 15
"""The processor's time for a question; one that takes longer is not answered."""


def copies(number: int) -> list[str]:
    """Return the commands that make the modules `gold` and `gate`: the component, and a mutant of it."""
    return [
        line
        for name, value in (("gold", 0), ("gate", number))
        for line in (
            f"copy {BLOCK} {name}",
            f"delete -input {name}/{SELECTOR}",
            f"cd {name}",
            f"connect -set {SELECTOR} {SELECTOR_BITS}'d{value}",
            "cd ..",
        )
    ]


def answer(work: Path, design: dict, made: list[str], top: str, how: str) -> str:
    """Return what the solver says; an empty text if it has no answer in its time.

    Args:
        work: a folder for the files.
        design: the component with its mutants, as Yosys writes it.
        made: the commands that make the module of the question.
        top: that module.
        how: options of the solver.

    Raises:
        SynthesisError: if Yosys fails.
    """
    (work / "design.json").write_text(json.dumps(design), encoding="utf-8")
    # Registers stay as they are: what is made of those with a constant bit loses their values at power-up.
    whole = [f"hierarchy -top {top}", "proc", "flatten", *("opt_expr -full", "opt_merge -share_all", "opt_clean") * 3]
    script = ["read_json design.json", *made, *whole, f"sat {how} {top}"]
    (work / "ask.ys").write_text("\n".join(script) + "\n", encoding="utf-8")
    tool = shutil.which(YOSYS, path=tools.TOOLS)
    # This Yosys has no clock to end its solver by.
    limited = ("/bin/sh", "-c", 'ulimit -t "$0" && exec "$@"', str(CPU_S), tool, "-s", "ask.ys")
    done = children.run(limited, cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode > 0:
        why = next(
            (line for line in done.stdout.splitlines() if line.startswith("ERROR: ")), f"exit code {done.returncode}"
        )
        raise tools.SynthesisError(f"Yosys cannot compare a mutant: {why.removeprefix('ERROR: ')}")
    return done.stdout if done.returncode == 0 else ""
