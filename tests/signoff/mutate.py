"""Mutants of every block: small changes of its netlist, which the block's own tests must notice.

    make mutate                     every block
    make mutate ONLY=link/          only the blocks whose names begin so

Prints a table, a line for every mutant that is left without a reason, and one last line for a script; exits with 1 if a
block falls short: 95 % of its mutants must be killed, of those that are not proven equivalent, and each of the others
must have its reason in `mutation/reasons.toml`. `HARDWALL_SEED` draws other mutants, and `HARDWALL_MUTANTS` says how
many of a block.
"""

import os
import sys

from hardwall.model.runtime.result import Table
from hardwall.testing import SEED
from signoff.covering.blocks import BLOCKS
from signoff.kept import findings_of
from signoff.mutation.outcomes import Result
from signoff.mutation.run import run
from signoff.targets import conclude

OURS = 1, 40
"""The seed and the number of mutants that the reasons are written for."""
MUTANTS = int(os.environ.get("HARDWALL_MUTANTS", OURS[1]))
COLUMNS = {
    "block": "left",
    "mutants": "right",
    "killed": "right",
    "equivalent": "right",
    "left": "right",
    "without a reason": "right",
    "killed of others, %": "right",
    "result": "left",
}


def tell(result: Result) -> None:
    """Say how a block went."""
    print(f"{result.block}: {result.killed} of {len(result.fates)} killed", file=sys.stderr, flush=True)


def main(begins: str, count: int = MUTANTS) -> int:
    """Draw mutants of the blocks whose names begin so, and test them; return the exit code."""
    chosen = [block for block in BLOCKS if block.name.startswith(begins)]
    results = run(chosen, count, (SEED, count) == OURS, tell, findings_of("mutate"))
    table, short = Table(COLUMNS, [result.row for result in results]), (each.explanation for each in results)
    killed, equivalent = sum(each.killed for each in results), sum(each.equivalent for each in results)
    every = sum(len(each.fates) for each in results)
    line = f"mutate: {{}} mutants, {killed} killed, {equivalent} equivalent, {every - killed - equivalent} left"
    good = sum(len(each.fates) for each in results if each.ok)
    return conclude(table, short, line, every, good)


if __name__ == "__main__":
    sys.exit(main(" ".join(sys.argv[1:])))
