"""The monitor of a clock, which a second clock drives; twin of `hardwall.hdl.board.clock_monitor`.

The watched clock makes a beat, a level that changes every `beat_clocks` of its clocks. One `step` is one clock of the
oscillator, which is the second:

    left    <- limit if the beat has changed since the last clock; else left - 1 until it is 0
    began   <- the beat has changed since left was 0
    running <- left > 0, and it was running, or the beat has changed for the second time

The numbers follow from the rates. A level of the beat lasts two periods of the slowest oscillator, so that none is
missed, and `BEAT_MIN` clocks. The limit is the number of clocks of the fastest oscillator in such a level, and `MARGIN`
more. So a running clock is never taken for a stopped one. A clock that comes back may change the beat at once. Until
the next change it makes `BEAT_MIN` edges; `running` is low at each of them.
"""

from typing import NamedTuple

from ..checks import check_int
from ..runtime.compiled import compiled

OSCILLATOR_HZ = 1_000_000, 10_000_000
"""The slowest and the fastest oscillator: internal ones of FPGAs are within this once they are divided."""
SYNCHRONISER = 2
BEAT_MIN = 4
"""The fewest clocks of a level of the beat: as many let what hears of a low `running` come to rest."""
MARGIN = 2
"""Clocks of the oscillator: a change of the beat is seen late by up to one, and the count of them begins in between."""


class Params(NamedTuple):
    """Numbers that follow from the rates.

    Attributes:
        limit: clocks of the oscillator without a change of the beat until the clock is taken to stand.
    """

    limit: int


class Inputs(NamedTuple):
    """The block's inputs just before a clock edge: the level of the beat."""

    beat: int = 0


class State(NamedTuple):
    """The block's state.

    Attributes:
        running: whether the watched clock runs.
        left: clocks until it is taken to stand.
        began: whether the beat has changed since the clock was last taken to stand.
        levels: the levels of the beat in the synchroniser and behind it, the newest in bit 0.
    """

    running: int = 0
    left: int = 0
    began: int = 0
    levels: int = 0


START = State()


class Design:
    """The numbers for a watched clock.

    Args:
        clock_hz: its frequency.

    Attributes:
        clock_hz: as given.
        beat_clocks: its clocks between two changes of the beat, a power of two.
        params: for `step`.

    Raises:
        TypeError: if `clock_hz` is not an int.
        ValueError: if `clock_hz` is less than 1.
    """

    def __init__(self, clock_hz: int):
        check_int("clock_hz", clock_hz, 1)
        slowest, fastest = OSCILLATOR_HZ
        self.clock_hz = clock_hz
        self.beat_clocks = max(1 << (-(-2 * clock_hz // slowest) - 1).bit_length(), BEAT_MIN)
        self.params = Params(limit=-(-self.beat_clocks * fastest // clock_hz) + MARGIN)

    def stop_latency_s(self, oscillator_hz: float) -> float:
        """Return the longest time from the last edge of the watched clock to `running` low, s.

        The last change of the beat comes late by up to a clock of the oscillator, and through the synchroniser.
        """
        return (1 + SYNCHRONISER + self.params.limit) / oscillator_hz


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge of the oscillator.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    changed = (state.levels >> 1 ^ state.levels >> 2) & 1
    left = params.limit if changed else max(state.left - 1, 0)
    stands = int(left == 0)
    running = (state.running | changed & state.began) & ~stands
    return State(running, left, (state.began | changed) & ~stands, (state.levels << 1 | inputs.beat) & 7)
