"""The heartbeat. It continues only while the application renews its lease: an application that hangs trips the
board."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress

from ..model.register import Register
from .errors import ChangedError, HostError, SilentError
from .port import Port
from .requests import Sending

LEASE_S = 0.5
"""How long the heartbeat goes on after the application has renewed its lease."""
BEATS = 4
"""Beats in the time of the board's watchdog."""
TRIES = 3
"""How often a beat is tried whose answer is lost."""


class Beat:
    """One beat: read the word of the heartbeat, check that it is the last one written, and write the next number.

    So a reset of the board ends the heartbeat, though the words may have been written again since. If an answer is lost
    the whole beat is repeated, so a reset in between is detected too. What else is asked waits meanwhile.

    Args:
        port: the line.
        register: the word of the heartbeat.

    Raises:
        HostError: if the board does not answer.
    """

    def __init__(self, port: Port, register: Register):
        self._port, self._register = port, register
        # Two after a beat without an answer: it may have arrived.
        self._numbers: tuple[int, ...] = (self._read(),)
        self._turn = threading.Lock()

    def __call__(self) -> None:
        """Send one.

        Raises:
            ChangedError: if the board has another number.
            HostError: if it is not reached.
        """
        with self._turn, self._port.first():
            for tries_left in reversed(range(TRIES)):
                last = self._read()
                if last not in self._numbers:
                    raise ChangedError(
                        f"the board at {self._port.name} does not have this program's last beat: it was reset, or "
                        "another host writes to it; connect again"
                    )
                following = last % self._register.high + 1
                self._numbers = last, following
                with suppress(*([SilentError] if tries_left else [])):
                    registers = self._register.to_registers(following)
                    self._port.write(self._register.address, registers, Sending(once=True))
                    self._numbers = (following,)
                    return

    def _read(self) -> int:
        return self._register.from_registers(self._port.read(self._register.address, self._register.size))


class Heartbeat:
    """A thread that beats while a lease lasts: first from the first renewal on.

    Args:
        beat: sends one beat; what it raises is kept in `lost` until a beat succeeds.
        watchdog_s: as below.

    Attributes:
        watchdog_s: the board's watchdog; `BEATS` beats are sent in it.
        lost: why the last beat did not reach the board; None if it did.
    """

    def __init__(self, beat: Callable[[], None], watchdog_s: float):
        self._beat, self._until_s, self.watchdog_s = beat, 0.0, watchdog_s
        self._ended, self._thread = threading.Event(), threading.Thread(target=self._run, daemon=True)
        self.lost: HostError | None = None
        self._thread.start()

    def renew(self, lease_s: float) -> None:
        """Let the heartbeat continue for another lease; if it had stopped, a beat is sent before this returns.

        Args:
            lease_s: how long it goes on.

        Raises:
            HostError: if the beat cannot be sent.
        """
        if not self.beats:
            self._beat()
            self.lost = None
        self._until_s = time.monotonic() + lease_s

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
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(self.watchdog_s / BEATS):
            if self.beats:
                try:
                    self._beat()
                    self.lost = None
                except HostError as error:
                    self.lost = error
                except Exception as error:
                    # Whatever it is, the application must learn why the board trips.
                    self.lost = HostError(f"the heartbeat fails: {error!r}")
