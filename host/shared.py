"""The state that several axes on one board share: the heartbeat, and the words that exist once."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from .errors import SilentError
from .heartbeat import Beat


class Leased(Protocol):
    """An axis that may be ARMED though nobody renews its lease."""

    @property
    def is_left_armed(self) -> bool: ...


class Shared(NamedTuple):
    """The state that several axes on one board share: the heartbeat, the last written values of words that exist once,
    and the axes."""

    beat: Beat
    words: dict[str, int]
    axes: Sequence[Leased]

    def send(self, axis: Leased) -> None:
        """Send a beat for an axis, unless it would keep another one ARMED that nobody lets be.

        Raises:
            SilentError: if the lease of another axis that is ARMED has ended: the board trips.
            HostError: if the beat does not reach the board.
        """
        for number, other in enumerate(self.axes):
            if other is not axis and other.is_left_armed:
                raise SilentError(f"axis {number} is ARMED and its lease has ended: no axis of the board beats")
        self.beat()
