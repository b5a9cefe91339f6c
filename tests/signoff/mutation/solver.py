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
REACHING_S = 60
"""The time for a question of what is reached."""
TRAPPED = "wasm trap"
"""What is printed where Yosys comes to the end of its stack or its memory."""
ABC = "read_aiger,abc.aig;pdr,-T,{seconds};write_status,abc.status"
"""ABC's commands. Its answer is in a file, for Yosys shows nothing of what it prints."""
UNREACHED = "snl_UNSAT"
"""How the answer begins where it is a proof."""
ANY = "module any(input a, input b, output y); assign y = a & b; endmodule\n"
"""What ABC is called for: Yosys calls it for a netlist that it takes for gates alone, and it reads its own."""


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
    """Return what the solver says; an empty text if it has no answer in its time and its memory.

    Args:
        work: a folder for the files.
        design: the component with its mutants, as Yosys writes it.
        made: the commands that make the module of the question.
        top: that module.
        how: options of the solver.

    Raises:
        SynthesisError: if Yosys fails.
    """
    done = _run(work, design, [*made, *_whole(top), f"sat {how} {top}"], CPU_S)
    # This Yosys is a program in a sandbox, whose stack is smaller than some questions need.
    if done.returncode > 0 and TRAPPED not in done.stdout:
        why = next(
            (line for line in done.stdout.splitlines() if line.startswith("ERROR: ")), f"exit code {done.returncode}"
        )
        raise tools.SynthesisError(f"Yosys cannot compare a mutant: {why.removeprefix('ERROR: ')}")
    return done.stdout if done.returncode == 0 else ""


def never(work: Path, design: dict, made: list[str], top: str) -> bool:
    """Return whether ABC, which Yosys has inside, proves that `trigger` is 0 in every state that `top` comes to.

    It looks for the invariant itself, by property-directed reachability.

    Args:
        work: a folder for the files.
        design: the component with its mutants, as Yosys writes it.
        made: the commands that make the module of the question.
        top: that module, whose other outputs are `gold_*` and `gate_*`.
    """
    said = work / "abc.status"
    said.unlink(missing_ok=True)
    (work / "any.v").write_text(ANY, encoding="utf-8")
    one_output = [f"delete -output {top}/o:gold_* {top}/o:gate_*", "opt_clean -purge"]
    gates = ["techmap", "opt_expr -full", "opt_merge -share_all", "opt_clean", "aigmap", "write_aiger -zinit abc.aig"]
    # What ABC leaves of its own netlist Yosys does not take for this one, and ends with an error.
    asked = ["design -reset", "read_verilog any.v", "techmap", f"abc -script +{ABC.format(seconds=REACHING_S)}"]
    _run(work, design, [*made, *_whole(top), *one_output, *gates, *asked], REACHING_S + CPU_S)
    return said.exists() and said.read_text(encoding="utf-8").startswith(UNREACHED)


def _whole(top: str) -> list[str]:
    """Return the commands that make one module without parts of `top`, in which what is alike is merged."""
    # Registers stay as they are: what is made of those with a constant bit loses their values at power-up.
    return [f"hierarchy -top {top}", "proc", "flatten", *("opt_expr -full", "opt_merge -share_all", "opt_clean") * 3]


def _run(work: Path, design: dict, commands: list[str], cpu_s: int) -> subprocess.CompletedProcess:
    """Run commands of Yosys on a design, for some time of the processor."""
    (work / "design.json").write_text(json.dumps(design), encoding="utf-8")
    (work / "ask.ys").write_text("\n".join(["read_json design.json", *commands]) + "\n", encoding="utf-8")
    tool = shutil.which(YOSYS, path=tools.TOOLS)
    # This Yosys has no clock to end its solver by.
    limited = ("/bin/sh", "-c", 'ulimit -t "$0" && exec "$@"', str(cpu_s), tool, "-s", "ask.ys")
    return children.run(limited, cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
