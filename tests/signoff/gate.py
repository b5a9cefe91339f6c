"""The netlists: what Yosys maps the hardware to, simulated beside it from power-up on.

    make gate                       every top on every family of FPGAs
    make gate ONLY="ECP5 axis"      only those whose names begin so

Prints a table, what differs if anything does, and one last line for a script; exits with 1 if anything falls short: a
netlist that is not equal, or an output that was never seen to change. `HARDWALL_SAMPLES` is the number of samples of
each; `HARDWALL_SEED` draws other stimuli. What was equal is kept until its hardware, mapping or stimuli change.
"""

import os
import sys

from hardwall.model.runtime.result import Table
from hardwall.sim.rtl.families import FAMILIES
from signoff.gates.run import Case, Outcome, run
from signoff.gates.tops import TOPS
from signoff.kept import findings_of
from signoff.targets import conclude

SAMPLES = int(os.environ.get("HARDWALL_SAMPLES", "20000"))
CASES = [Case(family, top) for family in FAMILIES.values() for top in TOPS]
CELLS = {"lut4": "LUT4", "ff": "FF", "dsp": "DSP", "bram": "BRAM"}
COLUMNS = {
    "family": "left",
    "top": "left",
    **dict.fromkeys(CELLS.values(), "right"),
    "samples": "right",
    "clocks compared": "right",
    "differences": "right",
}


def row(outcome: Outcome) -> list[str]:
    """Return an outcome as a row of the table."""
    cells = (str(outcome.cells[name]) for name in CELLS)
    numbers = map(str, (outcome.samples, outcome.clocks, outcome.different))
    return [outcome.case.family.name, outcome.case.top.name, *cells, *numbers]


def tell(outcome: Outcome) -> None:
    """Say how a netlist went."""
    print(outcome.line, file=sys.stderr, flush=True)


def main(begins: str, samples: int = SAMPLES) -> int:
    """Simulate the netlists whose names begin so; return the exit code."""
    chosen = [case for case in CASES if case.name.startswith(begins)]
    outcomes = run(chosen, samples, tell, findings_of("gate"))
    table, short = Table(COLUMNS, [row(outcome) for outcome in outcomes]), (each.explanation for each in outcomes)
    good = sum(outcome.ok for outcome in outcomes)
    return conclude(table, short, "gate: {} netlists, {} equal", len(outcomes), good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
