"""How accurate each velocity estimator is: known motions, at any rate, on any backend, held against the exact derivative.

For one estimator, signal and rate (`measure`), over the samples from `Signal.judged_from_s` on, with v the exact velocity
at the sample's time and w the estimate:

- `rms`, `max`: of w - v;
- `chatter`: RMS of what is left of w - v less its mean over each 10 ms: the part that a damper turns into noise;
- `delay`: that d for which v(t - d) correlates best with w(t); none for a constant velocity.

Gains are the estimator's default ones for the signal's own bound C on the acceleration, or for one that is given.
The clock is the slowest multiple of the rate that is 50 MHz or more and leaves 50 clocks a sample, enough for every
estimator's path; above 1 MHz it is faster than a real part, and so the stamps finer. The row says which it was.
"""

import math
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from ..model import estimators
from ..model.compiled import compiled
from ..model.spec import AxisSpec
from .encoder import offsets
from .motion import velocity
from .scene import load as load_scene
from .signals import Signal
from .stream import velocities

RATES_HZ = (1_000, 10_000_000)
"""The slowest and the fastest rate that is measured."""
CLOCK_HZ = 50_000_000
CLOCKS = 50
"""Clocks of the slowest and of the shortest sample."""
CHATTER_S = 0.01
DELAY_POINTS = 1 << 15
DELAY_MAX_S = 0.1
DELAY_STEPS = 400


@dataclass(frozen=True)
class Contestant:
    """An estimator's output, with the gains it is to have.

    Attributes:
        estimator, output: their names.
        gains: the estimator's gains; None for those that follow from C and the rate.
    """

    estimator: str
    output: str
    gains: object = None

    @classmethod
    def parse(cls, text: str) -> list["Contestant"]:
        """Return the contestants that `NAME` (every output of it) or `NAME:OUTPUT` stands for.

        Raises:
            ValueError: if there is none.
        """
        name, _, output = text.partition(":")
        outputs = estimators.load(name).OUTPUTS
        if output:
            estimators.choose(name, output)
        return [cls(name, each) for each in ([output] if output else outputs)]


def axis_spec(contestant: Contestant, sample_hz: int, acceleration_max_m_per_s2: float) -> AxisSpec:
    """Return the axis: the device of the scene `mhz` at another rate."""
    return replace(
        load_scene("mhz").spec,
        clock_hz=sample_hz * max(-(-CLOCK_HZ // sample_hz), CLOCKS),
        sample_hz=sample_hz,
        actuation_hz=sample_hz,
        acceleration_max_m_per_s2=acceleration_max_m_per_s2,
        estimator=contestant.estimator,
        gains=contestant.gains,
    )


@compiled
def _exact(motion, sample_hz, first, out):
    """Fill `out` with the exact velocities from sample `first` on."""
    for i in range(len(out)):
        out[i] = velocity(motion, (first + i) / sample_hz)


@compiled
def _at(motion, times, delay_s, out):
    """Fill `out` with the exact velocities at `times`, `delay_s` earlier."""
    for i in range(len(out)):
        out[i] = velocity(motion, times[i] - delay_s)


class _Blocks:
    """Means over blocks of so many samples, of values that come in chunks."""

    def __init__(self, samples: int, size: int):
        self.size = size
        self._sums = np.zeros(-(-samples // size))
        self._samples = samples

    def add(self, first: int, values: np.ndarray) -> None:
        np.add.at(self._sums, np.arange(first, first + len(values)) // self.size, values)

    @property
    def lengths(self) -> np.ndarray:
        ends = np.minimum(np.arange(1, len(self._sums) + 1) * self.size, self._samples)
        return np.diff(ends, prepend=0)

    @property
    def means(self) -> np.ndarray:
        return self._sums / self.lengths


def _delay_s(motion, times: np.ndarray, estimate: np.ndarray) -> float | None:
    """Return the delay at which the exact velocity correlates best with the estimate; None if it does not vary."""
    exact = np.empty(len(times))

    def mismatch(delay_s: float) -> float:
        _at(motion, times, delay_s, exact)
        return -float(estimate @ exact) / math.sqrt(float(exact @ exact))

    _at(motion, times, 0.0, exact)
    if np.ptp(exact) < 1e-9 or not estimate.any():
        return None
    tried = np.linspace(-DELAY_MAX_S, DELAY_MAX_S, DELAY_STEPS + 1)
    best = tried[int(np.argmin([mismatch(delay_s) for delay_s in tried]))]
    step = tried[1] - tried[0]
    found = minimize_scalar(mismatch, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-9})
    return float(found.x)


def measure(
    contestant: Contestant,
    signal: Signal,
    sample_hz: int,
    backend: str = "float",
    phase_error_counts: float = 0.0,
    acceleration_max_m_per_s2: float | None = None,
) -> dict:
    """Return one row: what was measured, units in the keys.

    Raises:
        ValueError: if the axis cannot be; the message names the field.
        RuntimeError: if the RTL could not be built.
    """
    bound = acceleration_max_m_per_s2 or signal.acceleration_max_m_per_s2
    spec = axis_spec(contestant, sample_hz, bound)
    begin = math.ceil(signal.judged_from_s * sample_hz)
    samples = int(signal.seconds * sample_hz) - begin
    chatter = _Blocks(samples, max(1, round(CHATTER_S * sample_hz)))
    shape = _Blocks(samples, -(-samples // DELAY_POINTS))
    squares = largest = 0.0
    exact = np.empty(0)
    for first, estimate, flags in velocities(signal, spec, contestant.output, backend, offsets(phase_error_counts)):
        skipped = max(begin - first, 0)
        if skipped >= len(estimate):
            continue
        estimate, since = estimate[skipped:], first + skipped - begin
        exact = np.resize(exact, len(estimate))
        _exact(signal.motion, float(sample_hz), begin + since, exact)
        error = estimate - exact
        squares += float(error @ error)
        largest = max(largest, float(np.abs(error).max()))
        chatter.add(since, error)
        shape.add(since, estimate)
    slow = float(np.average(chatter.means**2, weights=chatter.lengths))
    middles = (begin + np.arange(len(shape.means)) * shape.size + (shape.lengths - 1) / 2) / sample_hz
    return {
        "estimator": contestant.estimator,
        "output": contestant.output,
        "backend": backend,
        "sample_hz": sample_hz,
        "signal": signal.name,
        "rms_mm_s": math.sqrt(squares / samples) * 1e3,
        "max_mm_s": largest * 1e3,
        "delay_s": _delay_s(signal.motion, middles, shape.means),
        "chatter_mm_s": math.sqrt(max(squares / samples - slow, 0.0)) * 1e3,
        "samples": samples,
        "clock_hz": spec.clock_hz,
        "encoder_phase_error_counts": phase_error_counts,
        "acceleration_max_mm_s2": bound * 1e3,
        "gains": asdict(spec.design.gains),
        "flags": spec.design.flag_names(flags),
    }
