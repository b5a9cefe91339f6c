"""Faults injected into the board in the closed loop, and what came of each.

    make faults                     inject everything
    make faults ONLY="the host"     only the faults whose names begin so

Prints a table and one last line for a script; exits with 1 if any fault does not come to what is promised of it.
"""

import sys

from targets import conclude

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
    good = sum(outcome.safe for outcome in outcomes)
    return conclude(
        Table(COLUMNS, [outcome.row for outcome in outcomes]), (), "faults: {} faults, {} safe", len(outcomes), good
    )


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
