"""A velocity estimator of the hardware for records of edges, whole or in pieces.

A sample is complete when no later edge can count for it: when an edge is at its time or later, or when the caller says
that all edges up to its time are given. So a record may be cut into pieces between any two edges.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .axis.axis import Axis
from .axis.design import Timing, strobe_of
from .edge_times import check_edges, check_length, clocks_of, sample_of, since, times_of
from .encoder.level import level
from .estimators.acceleration import Motions, Velocities, keep
from .estimators.estimate import EstimatorGains
from .motion import Motion
from .record_axis import DECODER_CLOCKS, axis_of
from .record_time import RecordTime
from .runtime.compiled import compiled
from .stamped import Controller, Edges, State, controller, decode, sample
from .velocity_estimator import check_accelerated, is_floating, output_of, units_of

CLOCK_HZ, CLOCKS = 100e6, 1 << 16
"""The lowest rate of the stamping clock, Hz, unless a sample would then have more clocks than this number."""
CLOCK_RANGE = 1e-6, 2.0**48


@compiled
def run(
    params: Controller, state: State, timing: Timing, edges: Edges, first: int, made: Velocities | Motions
) -> tuple[State, int]:
    """Fill `made`, of one sample or more, from sample `first` on; return the state and the number of edges taken.

    The decoder of the state is behind by its latency: edges that come later may lie between there and the last sample.
    """
    taken, last = 0, len(made.velocity) - 1
    for k in range(last):
        rest = Edges(edges.clocks[taken:], edges.levels[taken:])
        state, more = sample(params, state, rest, len(rest.clocks), strobe_of(timing, first + k))
        taken += more
        keep(made, k, state.velocity, params.axis.estimator, state.axis.estimator)
    strobe = strobe_of(timing, first + last)
    rest = Edges(edges.clocks[taken:], edges.levels[taken:])
    before, more = decode(params, state, rest, len(rest.clocks), strobe - DECODER_CLOCKS)
    taken += more
    rest = Edges(edges.clocks[taken:], edges.levels[taken:])
    after, more = sample(params, before, rest, len(rest.clocks), strobe)
    keep(made, last, after.velocity, params.axis.estimator, after.axis.estimator)
    kept = State(
        after.drive, after.velocity, after.force, after.flags, before.decoder, after.axis, before.clock, before.level
    )
    return kept, taken


class EdgeVelocityEstimator:
    """An estimator with its state: edges and their times in, velocities out, a record in as many pieces as one likes.

        motion = Motion(count=1e-6, acceleration_max=12, speed_max=2, travel=0.15)
        estimator = EdgeVelocityEstimator(1e3, "edge-kalman", motion)
        first = estimator(times_s[:500], counts[:500])
        second = estimator(times_s[500:], counts[500:])

    All pieces together have the velocities of `velocity_of_edges`, except at an edge just after `until_s` (see there).
    `copy.deepcopy` and `pickle` keep the state, to go on from it twice, or elsewhere.

    Args:
        sample_hz: rate of the velocities, Hz; it need not be whole.
        estimator: name of an estimator, by stamps of edges or not: see `estimators.registry`.
        motion: the bounds of the motion; formats and default gains follow from it.
        output: the estimator's output; None for its first.
        backend: `fixed` for the hardware's words, `float` for the same algorithm in float64 with unrounded gains.
        gains: the estimator's `Gains` in seconds and the motion's unit; None for its default ones.
        clock_hz: the least rate of the clock that stamps edges, Hz; None for 100 MHz, or 65 536 clocks a sample if that
            is slower. Edges must be a clock apart.
        settings: run-time words by name, as of `set`.

    Attributes:
        spec: the axis that the estimator is of; its second is the second of `record_time`.
        words: the run-time words that may be set, by name, with their ranges in true seconds.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if a name is unknown, or a value is out of range.
    """

    def __init__(
        self,
        sample_hz: float,
        estimator: str,
        motion: Motion,
        output: str | None = None,
        backend: str = "fixed",
        gains: EstimatorGains | None = None,
        clock_hz: float | None = None,
        **settings: float,
    ):
        if not isinstance(motion, Motion):
            raise TypeError(f"motion must be a Motion, not {checks.shown(motion)}")
        self._time, self._floating = RecordTime(sample_hz), is_floating(backend)
        output = output_of(estimator, output)
        clock_hz = default_clock_hz(sample_hz) if clock_hz is None else clock_hz
        checks.check_number("clock_hz", clock_hz)
        checks.check_range("clock_hz", clock_hz, *CLOCK_RANGE)
        self.spec = axis_of(motion, self._time, estimator, gains, clock_hz / sample_hz)
        design = self.spec.design.estimator
        self.words = self._time.words(word for word in design.words if word.name != design.output_word())
        self._choice: dict[str, Any] = design.choose(output)
        self._units = units_of(design, self._floating, motion.count, sample_hz)
        self._settings: dict[str, float] = {}
        self.set(**settings)
        self.reset()

    def __repr__(self) -> str:
        return f"EdgeVelocityEstimator({self._time.sample_hz!r}, {self.spec.estimator!r}, ...)"

    def reset(self) -> None:
        """Forget every edge: the next time and count begin a record."""
        self._state = controller(self._axis, int(level(0)))[1]
        self._samples, self._clock = 0, 0
        self._waiting: list[Edges] = []
        self._start: tuple[np.ndarray, int] | None = None
        self._last = np.zeros(0), np.zeros(0, np.int64)

    def set(self, **settings: float) -> None:
        """Change run-time words from the next velocity on, as a host does while the hardware runs.

        Args:
            settings: values by the name of their word, in seconds and the motion's unit.

        Raises:
            TypeError: if a value is not a number.
            ValueError: if a name is no word, or a value does not fit its word; the message says what is accepted.
        """
        both = self._settings | settings
        self._axis = Axis(self.spec, self._floating, **self._time.settings(self.words, both), **self._choice)
        self._settings = both

    @property
    def flags(self) -> list[str]:
        """The names of the flags that were raised since the start: words that saturated, and a count that wrapped."""
        return self.spec.design.flag_names(int(self._state.flags))

    def __call__(self, times_s: ArrayLike, counts: ArrayLike, until_s: ArrayLike | None = None) -> np.ndarray:
        """Return the velocities of the samples that further edges complete, in the motion's unit per second.

        Args:
            times_s: s, shape (edges,), increasing, and later than all times before: the time of every edge. The very
                first is no edge, but the start. Integers and `datetime64` keep the resolution that float64 does not
                have far from 0; integers are seconds, too.
            counts: integers of the same shape: the count after every edge; the first belongs to the start. An edge
                changes it by 1, also from one piece to the next.
            until_s: all edges up to this time, and at it, are now given, so that samples up to it are complete. None:
                the last of the times. It brings the velocities of a standstill, at which no edge comes. An edge that is
                later by less than its time is sure (two units in the last place) counts for the next sample.

        Returns:
            float64, shape (samples,), which may be 0: the velocities at start + k / sample_hz, from the first k that no
            call has returned to the last that is complete; k = 1 is the first. An edge at the time of a sample counts
            for it. Times are rounded up to the clock.

        Raises:
            TypeError: if times are not numbers, or change between numbers and `datetime64`; if counts are not integers.
            ValueError: if the shapes differ, times are not finite or do not increase, or a count changes by another
                number than 1; if edges come faster than the clock, or there is no start; if `until_s` is before an
                edge, or there are more than `edge_times.SAMPLES_MAX` samples. The state has not changed then.
        """
        (velocity,) = self._taken(times_s, counts, until_s, Velocities)
        return velocity

    def with_acceleration(
        self, times_s: ArrayLike, counts: ArrayLike, until_s: ArrayLike | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocities and the accelerations of the samples that further edges complete.

        Pieces may also be taken in turns with calls.

        Args:
            times_s, counts, until_s: as of a call.

        Returns:
            Two arrays of float64, shape (samples,), as a call has one: velocities in the motion's unit per second, and
            accelerations in the motion's unit per second squared. Both belong to the same moments.

        Raises:
            TypeError: as of a call.
            ValueError: as of a call; and if the estimator has no acceleration, with those that have.
        """
        check_accelerated(self.spec.estimator)
        velocity, acceleration = self._taken(times_s, counts, until_s, Motions)
        return velocity, acceleration

    def _taken(
        self,
        times_s: ArrayLike,
        counts: ArrayLike,
        until_s: ArrayLike | None,
        kind: type[Velocities] | type[Motions],
    ) -> tuple[np.ndarray, ...]:
        """Return the outputs of a kind for the samples that further edges complete."""
        known = len(self._last[0])
        times = times_of(times_s, self._last[0] if known else None)
        array = checks.integers("counts", counts)
        if times.ndim != 1 or times.shape != array.shape:
            raise ValueError(f"times_s and counts must have one shape (edges,), not {times.shape} and {array.shape}")
        if known:
            times, array = (np.concatenate(each) for each in zip(self._last, (times, array), strict=True))
        if not len(times):
            if until_s is not None:
                raise ValueError("until_s needs the time and the count of the start first")
            return kind(*(np.zeros(0) for _ in kind._fields))
        check_edges(times, array, known)
        first = self._samples
        self._advance(times, array, self._end(times, until_s), known)
        return self._outputs(first, kind)

    def _end(self, times: np.ndarray, until_s: ArrayLike | None) -> np.ndarray:
        """Return the time up to which all edges are given, shape (1,)."""
        if until_s is None:
            return times[-1:]
        end = times_of(until_s, times, "until_s")
        if end.shape:
            raise ValueError(f"until_s must be one time, not an array of shape {end.shape}")
        if end < times[-1]:
            raise ValueError(f"until_s must be {times[-1]} or later, the last time that was given, not {end}")
        return end[None]

    def _advance(self, times: np.ndarray, counts: np.ndarray, end: np.ndarray, known: int) -> None:
        """Let edges wait behind the first of `times`, which is known, and samples up to `end` be complete."""
        rate, per_sample = self._time.sample_hz, self.spec.clocks_per_sample
        start, origin = self._start or (times[0], int(counts[0]))
        clocks = clocks_of(since(start, times), rate, per_sample, self._clock, known)
        samples = sample_of(since(start, end), rate)[0]
        check_length(samples - self._samples, rate)
        samples = max(int(samples) + 1, self._samples)
        edges = Edges(self.spec.design.timing.strobe - DECODER_CLOCKS + clocks[1:], level(counts[1:] - origin))
        # Nothing is refused from here on.
        self._start, self._last, self._clock = (start, origin), (end, counts[-1:]), int(clocks[-1])
        self._waiting.append(edges)
        self._samples = samples

    def _outputs(self, first: int, kind: type[Velocities] | type[Motions]) -> Velocities | Motions:
        """Take the samples from `first` on that are complete; return their outputs of a kind, without sample 0."""
        number = np.float64 if self._floating else np.int64
        made = kind(*(np.zeros(self._samples - first, number) for _ in kind._fields))
        if self._samples > first:
            waiting = self._waiting
            edges = (
                waiting[0]
                if len(waiting) == 1
                else Edges(*(np.concatenate(each) for each in zip(*waiting, strict=True)))
            )
            params = controller(self._axis, 0)[0]
            self._state, taken = run(params, self._state, self.spec.design.timing, edges, first, made)
            self._waiting = [Edges(edges.clocks[taken:], edges.levels[taken:])]
        return kind(*(part[int(first == 0) :] * unit for part, unit in zip(made, self._units, strict=False)))


def default_clock_hz(sample_hz: float) -> float:
    """Return the least rate of the clock that stamps edges where none is given, Hz."""
    return min(CLOCK_HZ, CLOCKS * sample_hz)
