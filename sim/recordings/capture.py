"""Captures of an encoder's pins by a logic analyser: the levels of channels A, B and Z, and when they change.

The channels are given by `--channels`, by name or by number from 1 on. By default they are the ones whose names end in
the words A, B and Z (or I, or index); or the only two, in their order. A leads B when the count goes up.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...model.checks import shown
from .error import RecordingError, plain
from .table import NAMES_SHOWN

CHANGES_MAX = 10**7
"""The most changes of levels in a capture."""
_PREFIX = {"": 1.0, "k": 1e3, "m": 1e6, "g": 1e9}


class Changes(NamedTuple):
    """The changes of the levels of some channels.

    Attributes:
        tick_hz: ticks a second.
        ticks: int64, shape (changes,): the ticks since the first sample from which there are other levels, increasing.
        levels: integers of the same shape: the levels from then on, the first channel in bit 0.
        start: the levels before.
        end: the last tick of the capture.
        start_s: the time of tick 0.
    """

    tick_hz: float
    ticks: np.ndarray
    levels: np.ndarray
    start: int
    end: int
    start_s: float = 0.0


class Capture(ABC):
    """A file with the levels of channels.

    Attributes:
        name: the file, for messages.
        form: the form of the file, in a few words.
        channels: names of the channels.
        otherwise: what to do if the file is no capture, for the end of a message.
    """

    name: str
    form: str
    channels: list[str]
    otherwise: str = ""

    @abstractmethod
    def changes(self, places: Sequence[int]) -> Changes:
        """Return the changes of the channels at some places.

        Raises:
            RecordingError: if the file cannot be read, or a level is neither 0 nor 1.
        """

    def check_number(self, changes: int) -> None:
        """Raise RecordingError if a capture has too many changes."""
        if changes > CHANGES_MAX:
            raise RecordingError(f"{self.name}: must have at most {CHANGES_MAX} changes of its channels")

    def places(self, wanted: Sequence[str]) -> list[int]:
        """Return the places of the channels A, B and, if there is one, Z.

        Raises:
            RecordingError: if a channel is not there, or nothing says which they are.
        """
        if wanted:
            return [self._place(each) for each in wanted]
        found = [_called(self.channels, letter) for letter in ("a", "b", "z|i|idx|index")]
        if found[0] is not None and found[1] is not None:
            return [place for place in found if place is not None]
        if len(self.channels) == 2:
            return [0, 1]
        raise RecordingError(
            f"{self.name}: the channels A and B must be given (--channels A,B), two or with Z three of {self._names()}"
            f"{self.otherwise}"
        )

    def _place(self, channel: str) -> int:
        if self.channels.count(channel) == 1:
            return self.channels.index(channel)
        if channel.isascii() and channel.isdigit() and len(channel) < 10 and 1 <= int(channel) <= len(self.channels):
            return int(channel) - 1
        raise RecordingError(
            f"{self.name}: a channel must be one of {self._names()}, or a number of 1 to {len(self.channels)}, "
            f"not {shown(channel)}"
        )

    def _names(self) -> str:
        names = [plain(each) for each in self.channels[:NAMES_SHOWN]]
        return ", ".join(names + [f"{len(self.channels) - NAMES_SHOWN} more"] * (len(self.channels) > NAMES_SHOWN))


def _called(names: Sequence[str], letter: str) -> int | None:
    """Return the place of the only name that ends in a word; None if there is none, or more than one."""
    found = [place for place, name in enumerate(names) if re.search(rf"(?:^|[\W_])(?:{letter})$", name, re.IGNORECASE)]
    return found[0] if len(found) == 1 else None


def hertz_of(text: str) -> float | None:
    """Return the rate of a text such as `1 MHz` or `200000`; None if it has none."""
    match = re.fullmatch(r"\s*([0-9.]+(?:e[+-]?[0-9]+)?)\s*(?:([kMG]?)Hz)?\s*", text, re.IGNORECASE)
    try:
        rate = float(match[1]) * _PREFIX[(match[2] or "").lower()] if match else 0.0
    except ValueError:
        return None
    return rate if 0 < rate < 1e12 else None


def changed(before: int, levels: np.ndarray) -> np.ndarray:
    """Return the places at which levels differ from those before them, the first from `before`."""
    return np.flatnonzero(np.diff(levels, prepend=levels.dtype.type(before)) != 0)
