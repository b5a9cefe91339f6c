"""A recording: encoder counts at equally spaced times, with the edges behind them where they were captured.

`load` reads one of a file. `Reading` is what a user says of the file, and `Recording.notes` what was understood.
"""

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...model.requirements import RATES_HZ
from .counter import Counter
from .error import RecordingError

SAMPLES_MAX = 10**7
RATE_MIN_HZ = 0.1
RATE_MAX_HZ = float(RATES_HZ[1])


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a file is to be read; None and the defaults leave it to what the file says.

    Attributes:
        time: column of the times, by name or number; `none` if the times are not to be used.
        time_unit: one of `stamps.UNITS`, or `iso`.
        unit: one of `counts.UNITS`.
        count: size of a count in that unit; None for the unit `counts`.
        counter_bits: width of the counter, `counter.BITS`; None to find it.
        counter_modulus: in its place, the counts of a counter that wraps at another number, `counter.MODULI`.
        gaps: one of `gaps.RULES`.
        channels: names or numbers of the channels A, B and, if there is one, Z of an edge capture.
    """

    time: str | None = None
    time_unit: str | None = None
    unit: str = "counts"
    count: float | None = None
    counter_bits: int | None = None
    counter_modulus: int | None = None
    gaps: str = "refuse"
    channels: tuple[str, ...] = ()

    @property
    def counter(self) -> Counter | None:
        """The counter that is given; None to find it."""
        if self.counter_modulus is not None:
            return Counter.of_modulus(self.counter_modulus)
        return None if self.counter_bits is None else Counter.of_bits(self.counter_bits)

    def refuse(self, name: str, what: str, *fields: str) -> None:
        """Raise RecordingError if some fields are given, which a file has no use for.

        Args:
            name: the file.
            what: why it has no use for them.
            fields: names of fields.
        """
        given = [f"--{each.replace('_', '-')}" for each in fields if getattr(self, each) != getattr(Reading, each)]
        if given:
            raise RecordingError(f"{name}: {what}, so {' and '.join(given)} must be absent")


@dataclass(frozen=True, eq=False)
class EdgeRecord:
    """The edges of an encoder, in the ticks of what captured them.

    Attributes:
        tick_hz: ticks a second.
        ticks: int64, shape (edges,): the tick of every edge since the first sample, increasing.
        counts: int64, shape (edges,): the count after every edge; each differs by 1 from the one before.
        start: the count before the first edge.
    """

    tick_hz: float
    ticks: np.ndarray
    counts: np.ndarray
    start: int


@dataclass(frozen=True, eq=False)
class Recording:
    """Counts at equally spaced times.

    Attributes:
        file, column: source of the counts.
        counts: int64, unwrapped.
        rate_hz: sample rate.
        start_s: time of the first sample; 0 where the times are not known.
        edges: the edges that the counts come from; None for counts that were sampled.
        notes: what was understood of the file, in a few words each.
    """

    file: str
    column: str
    counts: np.ndarray
    rate_hz: float
    start_s: float = 0.0
    edges: EdgeRecord | None = None
    notes: tuple[str, ...] = ()

    @property
    def time_s(self) -> np.ndarray:
        """The time of every sample, s."""
        return self.start_s + np.arange(len(self.counts)) / self.rate_hz

    @cached_property
    def content(self) -> str:
        """A digest of counts, rate and edges: of all that a replay of the recording depends on."""
        digest = hashlib.sha256(self.counts.astype("<i8").tobytes())
        digest.update(repr((self.rate_hz, self.start_s)).encode())
        if self.edges is not None:
            digest.update(repr((self.edges.tick_hz, self.edges.start)).encode())
            digest.update(self.edges.ticks.astype("<i8").tobytes() + self.edges.counts.astype("<i8").tobytes())
        return digest.hexdigest()

    def noted(self, *more: str) -> "Recording":
        """Return the recording with more notes."""
        return replace(self, notes=(*self.notes, *more))
