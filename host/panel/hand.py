"""The hand at a virtual board: it holds the handle where a tab drags it, and breaks and mends what a tab says."""

import time
from collections.abc import Callable
from dataclasses import dataclass

SPEED_M_PER_S = 0.4
"""The largest speed of a held handle: a handle faster than its encoder would end the simulation."""
STEP_S = 0.05
"""The longest time between two places of a drag; in a longer one the hand rests."""


@dataclass(frozen=True)
class Fault:
    """Something that a hand may break: the orders that break and mend it, and the names of both."""

    cut: str
    mend: str
    breaking: str
    mending: str


FAULTS = {
    "wire": Fault("cut a", "mend a", "Cut wire A", "Mend wire A"),
    "stop": Fault("open emergency_stop", "close emergency_stop", "Open the emergency stop", "Close the emergency stop"),
    "clock": Fault("open clock", "close clock", "Stop the clock", "Start the clock"),
}
"""The parts that a hand may break, by name."""


class Hand:
    """A hand that gives orders to a virtual board.

    Args:
        order: gives an order.
        origin_m: where the board's position 0 is for the orders.
        reach_m: the largest position of an order, either way.

    Attributes:
        held_m: where the hand holds the handle, as the board counts it; None: it does not.
        broken: the names of the faults that are there.
    """

    def __init__(self, order: Callable[[str], None], origin_m: float, reach_m: float):
        self._order, self._origin_m, self._reach_m = order, origin_m, reach_m
        self._moved_s = 0.0
        self.held_m: float | None = None
        self.broken: set[str] = set()

    def hold(self, wanted_m: float, position_m: float) -> None:
        """Move towards a place, from where the handle is if it was free; a tab that drags says so again and again."""
        now_s = time.monotonic()
        from_m = position_m if self.held_m is None else self.held_m
        most_m = SPEED_M_PER_S * min(now_s - self._moved_s, STEP_S)
        at_m = from_m + min(max(wanted_m - from_m, -most_m), most_m)
        self._moved_s = now_s
        self.held_m = min(max(at_m, -self._reach_m - self._origin_m), self._reach_m - self._origin_m)
        self._order(f"hold {1e3 * (self.held_m + self._origin_m):.6f}")

    def free(self) -> None:
        """Let the handle go."""
        if self.held_m is not None:
            self.held_m = None
            self._order("hold free")

    def turn(self, name: str) -> None:
        """Break a whole part, or mend a broken one.

        Raises:
            KeyError: if there is no such fault.
        """
        fault = FAULTS[name]
        self._order(fault.mend if name in self.broken else fault.cut)
        self.broken ^= {name}
