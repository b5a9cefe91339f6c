"""How often a handle turns round: the swings of its position, piece by piece."""

from typing import NamedTuple

import numpy as np

from ...model.runtime.compiled import compiled


class Swings(NamedTuple):
    """The swings of positions so far.

    Attributes:
        turns: how often the position turned round.
        way: 1 if it goes up, -1 if it goes down, 0 if it has not gone far enough yet to tell.
        low_m, high_m: the ends of its way since the last turn; NaN before the first position.
    """

    turns: int = 0
    way: int = 0
    low_m: float = np.nan
    high_m: float = np.nan


@compiled
def swung(swings: Swings, positions: np.ndarray, least_m: float) -> Swings:
    """Return the swings with the next positions (m). It has turned where it is `least_m` behind the end of its way."""
    turns, way, low, high = swings
    for position in positions:
        if not low <= high:
            low = high = position
        elif way >= 0 and position <= high - least_m:
            turns += way
            way, low = -1, position
        elif way <= 0 and position >= low + least_m:
            turns -= way
            way, high = 1, position
        low, high = min(low, position), max(high, position)
    return Swings(turns, way, low, high)
