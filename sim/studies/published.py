"""Published rates of haptic loops on FPGAs, shown beside the boards' rates; see the page of sources."""

from typing import NamedTuple


class Published(NamedTuple):
    """A loop that others have built; how much logic it takes is in neither abstract.

    Attributes:
        source: the authors and the year.
        sample_hz: the rate at which it sampled.
    """

    source: str
    sample_hz: float


LOOPS = (
    # Up to 400 times the rate of the commercial system, which is 1 kHz.
    Published("O'Malley, Sevcik, Kopp 2009", 400e3),
    # The position at 20 kHz and the velocity at 2 kHz.
    Published("Koul, Khosa, Ahmad 2024", 20e3),
)
