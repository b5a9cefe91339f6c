"""Faults injected into boards in the closed loop, and what came of each.

    make faults                     inject everything, with each drive stage and into several axes
    make faults ONLY="the host"     only the faults whose names begin so

Prints a table and one last line for a script; exits with 1 if any fault does not come to what is promised of it.
"""

import sys

from targets import conclude

from hardwall.sim.jobs.result import Table
from injection.every import FAULTS
from injection.run import run

COLUMNS = {
    "stage": "left",
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
    rows, good = [], 0
    for stage, faults in FAULTS.items():
        outcomes = run(stage, [fault for fault in faults if fault.name.startswith(begins)])
        rows += [[stage, *outcome.row] for outcome in outcomes]
        good += sum(outcome.safe for outcome in outcomes)
    return conclude(Table(COLUMNS, rows), (), "faults: {} faults, {} safe", len(rows), good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
