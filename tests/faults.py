"""Faults injected into the board in the closed loop, and what came of each.

    make faults                     inject everything
    make faults ONLY="the host"     only the faults whose names begin so

Prints a table and one last line for a script; exits with 1 if any fault does not come to what is promised of it.
"""

import sys

from hardwall.sim.commands.terminal import show
from hardwall.sim.jobs.result import Table
from injection.every import FAULTS
from injection.run import run

COLUMNS = {
    "fault": "left",
    "expected": "left",
    "came": "left",
    "clocks": "right",
    "us": "right",
    "largest, N": "right",
    "mN s": "right",
    "of ms": "right",
    "verdict": "left",
}


def main(begins: str) -> int:
    """Inject the faults whose names begin so; return the exit code."""
    outcomes = run([fault for fault in FAULTS if fault.name.startswith(begins)])
    show(Table(COLUMNS, [outcome.row for outcome in outcomes]))
    safe = sum(outcome.safe for outcome in outcomes)
    print(f"faults: {len(outcomes)} faults, {safe} safe")
    return 0 if outcomes and safe == len(outcomes) else 1


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
