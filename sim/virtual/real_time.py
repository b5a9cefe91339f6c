"""How much of real time a simulation keeps, on a machine that does other things, too."""

from collections import deque

WINDOW_S = 0.25
"""The real time over which it is measured, at least."""
WINDOWS = 8
"""How many of these count: a machine that was slow is taken for slow for so long."""


class Keeping:
    """The seconds of a simulation in a second: the fewest of the last windows."""

    def __init__(self) -> None:
        self._began = 0.0, 0.0
        self._windows: deque[float] = deque(maxlen=WINDOWS)

    def take(self, simulated_s: float, real_s: float) -> None:
        """Take how much time has passed since the beginning, simulated and real."""
        simulated, real = simulated_s - self._began[0], real_s - self._began[1]
        if real >= WINDOW_S:
            self._began = simulated_s, real_s
            self._windows.append(simulated / real)

    @property
    def least(self) -> float | None:
        """The fewest seconds in a second; None before the end of the first window."""
        return min(self._windows, default=None)
