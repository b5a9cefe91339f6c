"""The heartbeat: it goes on only while the application shows that it lives, so that one that hangs trips the board."""

import threading
import time
from collections.abc import Callable

from .errors import HostError

LEASE_S = 0.5
"""How long the heartbeat goes on after the application has renewed its lease."""
BEATS = 4
"""Beats in the time of the board's watchdog."""


class Heartbeat:
    """A thread that beats while a lease lasts. It begins when it is renewed for the first time.

    Args:
        beat: sends one beat; what it raises is kept in `lost` until a beat succeeds.

    Attributes:
        watchdog_s: the board's watchdog; `BEATS` beats are sent in it.
        lost: why the last beat did not reach the board; None if it did.
    """

    def __init__(self, beat: Callable[[], None], watchdog_s: float):
        self._beat, self._until_s, self.watchdog_s = beat, 0.0, watchdog_s
        self._ended, self._thread = threading.Event(), threading.Thread(target=self._run, daemon=True)
        self.lost: HostError | None = None

    def renew(self) -> None:
        """Let the heartbeat go on for another `LEASE_S`; if it had ended, a beat is sent before this returns.

        Raises:
            HostError: if the beat cannot be sent.
        """
        if not self.beats:
            self._beat()
            self.lost = None
        self._until_s = time.monotonic() + LEASE_S
        if not self._thread.ident:
            self._thread.start()

    @property
    def beats(self) -> bool:
        """Whether the lease lasts."""
        return time.monotonic() < self._until_s

    def rest(self) -> None:
        """End the lease at once; a renewal begins it again."""
        self._until_s = 0.0

    def close(self) -> None:
        """End the thread."""
        self.rest()
        self._ended.set()
        if self._thread.ident:
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(self.watchdog_s / BEATS):
            if self.beats:
                try:
                    self._beat()
                    self.lost = None
                except HostError as error:
                    self.lost = error
