"""The order of requests from several threads: a beat goes first. What else is asked waits for its end, but not for
ever."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Precedence:
    """Lets a group of requests of one thread go before all other threads' requests; one thread at a time."""

    def __init__(self) -> None:
        self._thread: int | None = None
        self._over = threading.Event()
        self._over.set()

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Take it for this thread."""
        self._over.clear()
        self._thread = threading.get_ident()
        try:
            yield
        finally:
            self._thread = None
            self._over.set()

    def wait(self, longest_s: float) -> None:
        """Wait until another thread has it no more, but not longer than a time."""
        if self._thread != threading.get_ident():
            self._over.wait(longest_s)
