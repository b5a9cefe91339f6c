"""What is timed side by side, in rounds: medians of contestants that are taken in turns.

In each round every contestant runs once, so that a machine that slows down slows them all.
"""

import statistics
from collections.abc import Callable, Hashable


def medians(
    contestants: dict[Hashable, Callable[[], float]], rounds: int, progress: Callable[[str], None]
) -> dict[Hashable, float]:
    """Return the median over the rounds of what each contestant gives.

    Args:
        contestants: by name.
        rounds: how often each runs.
        progress: called with what runs next.
    """
    given: dict[Hashable, list[float]] = {name: [] for name in contestants}
    for number in range(rounds):
        for name, run in contestants.items():
            progress(f"round {number + 1} of {rounds}: {name}")
            given[name].append(run())
    return {name: statistics.median(values) for name, values in given.items()}
