"""How fast a board's time passes beside ours: 1 for a board, less for a simulation that its machine is too slow for."""

from collections import deque

WINDOW_S = 1.0
"""The time over which it is measured."""


class Pace:
    """The pace of a board, and how often it is read.

    Args:
        wrap_s: the time after which the board's stamps begin again.
    """

    def __init__(self, wrap_s: float):
        self._wrap_s = wrap_s
        self._looks: deque[tuple[float, float, float]] = deque()

    def take(self, now_s: float, stamp_s: float) -> None:
        """Take the stamp of a look, and when it was; stamps that may have wrapped between two looks begin anew."""
        board_s = 0.0
        if self._looks:
            last_s, last_stamp_s, board_s = self._looks[-1]
            if now_s - last_s > self._wrap_s / 2:
                self._looks.clear()
            board_s += (stamp_s - last_stamp_s) % self._wrap_s
        self._looks.append((now_s, stamp_s, board_s))
        while now_s - self._looks[0][0] > WINDOW_S:
            self._looks.popleft()

    @property
    def _since_s(self) -> float:
        return self._looks[-1][0] - self._looks[0][0] if self._looks else 0.0

    @property
    def pace(self) -> float | None:
        """Seconds of the board in a second; None while too little is known."""
        return (self._looks[-1][2] - self._looks[0][2]) / self._since_s if self._since_s > WINDOW_S / 2 else None

    @property
    def looks_hz(self) -> float:
        """Looks in a second; 0 while too little is known."""
        return (len(self._looks) - 1) / self._since_s if self._since_s > WINDOW_S / 2 else 0.0
