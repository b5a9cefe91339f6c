"""The proofs of the hardware: every property, and every bug with which its proof must fail.

    make prove                      prove everything
    make prove ONLY="axis mhz"      only the properties of blocks whose names begin so

Prints a table, the counterexample of what is refuted, and one last line for a script; exits with 1 if anything falls
short: a property that is not proven, or a bug that is not found. What is proven is kept until its hardware changes.
"""

import sys

from hardwall.model.runtime.result import Table
from signoff.kept import findings_of
from signoff.proofs.properties import PROPERTIES
from signoff.proofs.run import Outcome, run
from signoff.targets import conclude

COLUMNS = {
    "block": "left",
    "property": "left",
    "method, clocks": "left",
    "seconds": "right",
    "result": "left",
    "seeded bugs found at clock": "left",
}


def row(outcome: Outcome) -> list[str]:
    """Return an outcome as a row of the table."""
    found = ", ".join("missed" if verdict.clock is None else str(verdict.clock) for verdict in outcome.bugs)
    known = outcome.property
    return [known.block, known.promise, known.method, f"{outcome.verdict.seconds:.1f}", outcome.result, found]


def main(begins: str) -> int:
    """Prove the properties of the blocks whose names begin so; return the exit code."""
    chosen = [known for known in PROPERTIES if known.block.startswith(begins)]
    outcomes = run(chosen, lambda outcome: print(outcome.line, file=sys.stderr, flush=True), findings_of("prove"))
    table, short = Table(COLUMNS, [row(outcome) for outcome in outcomes]), (each.explanation for each in outcomes)
    good = sum(outcome.ok for outcome in outcomes)
    return conclude(table, short, "prove: {} properties, {} proved", len(outcomes), good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
