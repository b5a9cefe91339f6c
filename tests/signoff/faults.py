"""Faults injected into boards in the closed loop, and what came of each.

    make faults                     inject everything, with each drive stage and into several axes
    make faults ONLY="the host"     only the faults whose names begin so

What was safe is kept until the board, the faults or the world change. Prints a table and one last line for a script;
exits with 1 if any fault does not come to what is promised of it.
"""

import sys

from hardwall.model.runtime.result import Table
from signoff.injection.all_faults import FAULTS
from signoff.injection.run import run_all
from signoff.kept import findings_of
from signoff.targets import conclude

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


def tell(stage: str, through: int) -> None:
    """Say how many more faults of a stage are through."""
    print(f"{stage}: {through} more", file=sys.stderr, flush=True)


def main(begins: str) -> int:
    """Inject the faults whose names begin so; return the exit code."""
    chosen = {stage: [fault for fault in faults if fault.name.startswith(begins)] for stage, faults in FAULTS.items()}
    outcomes = run_all(chosen, tell, findings_of("faults"))
    rows = [[stage, *outcome.row] for stage, each in outcomes.items() for outcome in each]
    good = sum(outcome.safe for each in outcomes.values() for outcome in each)
    return conclude(Table(COLUMNS, rows), (), "faults: {} faults, {} safe", len(rows), good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
