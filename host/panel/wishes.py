"""The wishes of tabs, until they are carried out or too old: no wish is carried out late, after a person has given
up."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

STALE_S = 0.5
"""The age of a wish, s, from which on it is not begun: the board was silent meanwhile, and the person waited."""
DONE_S = 1.5
"""The age of a wish, s, from which on nothing more of it goes out to the board."""


class Act(NamedTuple):
    """Something that is asked for.

    Attributes:
        do: does it.
        at_s: when it was wished for, s, of time.monotonic; infinity for what is never too late.
        anyway: whether it is done, too, while no board answers.
    """

    do: Callable[[], None]
    at_s: float
    anyway: bool


class Word(NamedTuple):
    """A value that a tab wishes for a word.

    Attributes:
        tab: the tab.
        value: the value, in SI units.
        at_s: when it was wished for, s, of time.monotonic.
    """

    tab: str
    value: float
    at_s: float


class Wishes:
    """The wishes of all tabs. Tabs add them in threads of their own, and one thread takes them out."""

    def __init__(self) -> None:
        self._acts: deque[Act] = deque()
        self._words: dict[str, Word] = {}
        self._lock = threading.Lock()

    def ask(self, do: Callable[[], None], at_s: float | None = None, anyway: bool = False) -> None:
        """Add an act, of now if it has no time."""
        self._acts.append(Act(do, time_of(at_s), anyway))

    def ask_always(self, do: Callable[[], None]) -> None:
        """Add an act that is never too late."""
        self._acts.append(Act(do, math.inf, True))

    def set(self, name: str, tab: str, value: float, at_s: float | None) -> None:
        """Wish a value for a word; the last one counts."""
        with self._lock:
            self._words[name] = Word(tab, value, time_of(at_s))

    def act(self) -> Act | None:
        """Take the next act; None if there is none."""
        return self._acts.popleft() if self._acts else None

    def words(self) -> tuple[dict[str, Word], int]:
        """Take all words by their names: the ones that are not too old, and the number of the others."""
        with self._lock:
            words, self._words = self._words, {}
        fresh = {name: word for name, word in words.items() if is_fresh(word.at_s)}
        return fresh, len(words) - len(fresh)


def time_of(at_s: float | None) -> float:
    """Return the time of a wish, which is never later than now; now if it is not given."""
    now_s = time.monotonic()
    return now_s if at_s is None else min(at_s, now_s)


def is_fresh(at_s: float) -> bool:
    """Return whether a wish of a time is young enough to be done."""
    return time.monotonic() - at_s <= STALE_S
