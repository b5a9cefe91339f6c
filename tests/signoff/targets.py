"""How the tasks that sign the hardware off end: a table, what fell short, and one line for a script."""

from collections.abc import Iterable

from hardwall.cli.terminal import show
from hardwall.model.runtime.result import Table


def conclude(table: Table, explanations: Iterable[str], line: str, every: int, good: int) -> int:
    """Print the end of a task; return its exit code.

    Args:
        table: what was found.
        explanations: of what fell short; empty texts of what did not.
        line: the last line, with places for `every` and `good`.
        every: how many there were; none is short too.
        good: how many did not fall short.
    """
    show(table)
    print("".join(explanations), end="")
    print(line.format(every, good))
    return 0 if every and good == every else 1
