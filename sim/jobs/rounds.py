"""Timing of contestants side by side, in rounds, with the median of each.

In every round each contestant runs once, so a machine that slows down slows all of them.
"""

import statistics
from collections.abc import Callable, Hashable


def medians(
    contestants: dict[Hashable, Callable[[], float]], rounds: int, progress: Callable[[str], None]
) -> dict[Hashable, float]:
    """Return the median over the rounds of every contestant's results.

    Args:
        contestants: functions by name; each returns one result.
        rounds: number of runs of every contestant.
        progress: called with a text that names the next run.
    """
    results: dict[Hashable, list[float]] = {name: [] for name in contestants}
    for number in range(rounds):
        for name, run in contestants.items():
            progress(f"round {number + 1} of {rounds}: {name}")
            results[name].append(run())
    return {name: statistics.median(values) for name, values in results.items()}
