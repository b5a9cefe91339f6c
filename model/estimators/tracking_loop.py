"""Tracking loop: a type-2 phase-locked loop on the count, as in most servo drives, in fixed point.

Position and velocity, x and v, in counts and sample periods; per sample, with f the count:

    x <- x + v                           predict
    e  = f - x                           position error
    x <- x + 2 h e,  v <- v + h^2 e      h = 2 pi bandwidth / sample rate

The output `u` is v. In seconds the gains are kp = 2 w and ki = w^2, with w = 2 pi bandwidth. For motion that is slow
against a sample, this is a critically damped double pole at w. x is held as its distance from the last count, `lead` =
x - f, so that the count may wrap. One word, the bandwidth, sets both gains: the second is made by multiplying twice, so
that no word breaks their relation.

Sources. The loop of encoder-driven servo drives, whose published firmware has these gains. ODrive: kp = 2 bandwidth and
ki = kp^2 / 4, with the bandwidth in rad/s, 1000 by default; kp must be less than the sampling rate. moteus: kp = 2 w,
ki = w^2 with w = 2 pi pll_filter_hz / 2.48, 400 Hz by default. pll_filter_hz is the frequency at which the *position*
has fallen by 3 dB, 2.48 w for a double pole. In the first releases of moteus, w = 2 pi pll_filter_hz, as here. Both
defaults are 160 Hz here. ODrive also drops the fraction of a count of its own position before it compares. It holds
velocities below half a step of the loop at 0. Neither is done here: rest is exactly 0 without them.

Beside `kalman`. The steady-state Kalman filter of two integrators has this form too, but gains of sqrt(2) h and h^2, a
damping of 0.71. The estimator `kalman` has a third state, the acceleration, and gains from a model of the noise. This
loop has no acceleration: at constant acceleration a its velocity is late by 2 / w, by 2 a / w, whatever the rate.

Stability. The poles are the roots of z^2 - (2 - 2 h - h^2) z + 1 - 2 h. Its discriminant is h^3 (h + 4), its value at 1
is h^2: for every 0 < h <= 1/2 both poles are real, none is negative, both are below 1, and neither state oscillates.
The words end below 1/2, ODrive's limit, and begin at `least`, so *every word is a stable loop*; 0 would hold the
velocity. (From 1/2 on a pole is negative, and at 2 sqrt(2) - 2 = 0.83 it is -1.) As the poles are real, the response of
v to the difference of counts is nowhere negative, and its sum is 1: v is never beyond the largest difference, and does
not overshoot.

Norms, the sums of absolute impulse responses, follow in the same way, for any h up to 1/2:

- from the difference of counts to v: 1; to the predicted lead: LEAD_NORM / h at most;
- to v, from an error that is added to the difference of counts: 1; to e: h at most; to v itself: 2 / h.

Formats, derived. C' = C tau^2 / q is the bound on the acceleration in counts a sample^2.

- The difference of counts is held within `step_max`: the counts that twice the largest speed moves in a sample, begun
  within a count, and one count for an edge out of place. A larger one saturates (flag `velocity_saturated`): the excess
  is a displacement of the scale, without later effect.
- The host may lower the bandwidth to the designed one / 2**RANGE_BITS. It may raise it to at least 2**HEADROOM_BITS
  times the designed one, or to the end of the words: `least` and `most` are these h. The ranges of v and lead are the
  norms at `least` times `step_max`, plus one. Within that range of bandwidths nothing else saturates, and no other word
  is accepted. After a change of the bandwidth in motion lead may (flag `innovation_saturated`; it drags x along), and v
  (flag `state_saturated`).
- f, fraction bits of the velocity: an LSB is at most sqrt(C') 2**-RESOLUTION_BITS. lead has GUARD_BITS more, and v
  another `reach`, 1 / `least` as a power of two, at least 2.
- The multiplier takes lead without its last `less` bits, with most 2**less < 1. Then it takes h e, which has the
  fraction bits of lead and so no more bits than the first operand.
- v without its additional bits, the operand and both products are floored. They add four errors, in LSB at v: of the
  difference of counts (up to 1 LSB of lead: 1 at v), of e (2**less: less than 1 at v), of h e (1, that is 1/h of e: 1
  at v) and of v (2**-reach: 2 at v). ERROR_NORM 2**-GUARD_BITS is less than half an LSB of the velocity: *at constant n
  counts a sample the velocity, rounded half up, settles to n exactly*, to 0 at standstill, with any bandwidth of the
  range.
- int64 holds 62 bits: if the formats do not fit, f is reduced; a bandwidth with which none is left is refused.

Restart and the first sample: all states 0. A start from rest has no transient; a start in motion has the step response
of v, without overshoot, settled to 1 % in about 6.6 / w.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ, bits_for, saturate, shift_floor, shift_round_half_up, wrap
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import GAIN_BITS, Word, gain_format
from .estimate import EstimatorDesign, EstimatorGains, estimate, fraction_bits, largest_step

INDEX_MAX = ((1 << GAIN_BITS) - 1) * 2.0 ** -(GAIN_BITS + 1)
"""The largest h: the last word below 1/2, from which on a pole is negative."""
LEAD_NORM = 1.0
"""Norm from the difference of counts to the predicted lead, times h: 1 at h = 1/2, 2/e for small h."""
ERROR_NORM = 5.0
"""Largest sum of all rounding errors at v, in LSB of lead: see the module's docstring."""
RESOLUTION_BITS = 10
"""The output LSB is at most sqrt(C') 2**-RESOLUTION_BITS."""
GUARD_BITS = 4
"""Bits of `lead` below the output LSB."""
HEADROOM_BITS = 2
"""The bandwidth may be raised to 2**HEADROOM_BITS times the designed one at run time."""
RANGE_BITS = 3
"""It may be lowered to the designed one 2**-RANGE_BITS: from 1103 Hz to 138 Hz, below what drives have by default."""
INDEX_BITS_MAX = 60
"""Bandwidths down to h = 2**-INDEX_BITS_MAX are looked at for the least one that int64 holds."""
STEPS = 10
"""Clocks of the sequence: see `hardwall.hdl.estimators.tracking_loop`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The bandwidth of the loop, w / (2 pi), Hz."""

    bandwidth_hz: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the bandwidth whose delay is sqrt(q / C) = 2 / w, as of `butterworth`."""
        wanted = math.sqrt(axis.acceleration_max_m_per_s2 / axis.count_m) / math.pi
        return cls(min(wanted, bandwidth_max_hz(axis)))


def bandwidth_max_hz(axis: AxisRequirements) -> float:
    """Return the largest bandwidth that the words hold: 0.0796 of the sampling rate."""
    return INDEX_MAX * axis.sample_hz / (2 * math.pi)


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    h: int
    position_shift: int
    velocity_shift: int
    count_width: int
    step_max: int
    fraction: int
    reach: int
    operand_shift: int
    output_shift: int
    lead_max: int
    v_max: int


class State(NamedTuple):
    """The state, in the formats of `Design` (float: counts and sample periods); `count` is the last count."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    lead: float
    v: float


class FloatParams(NamedTuple):
    h: float
    count_width: int


START = State(0, 0, 0, 0)
FLOAT_START = State(0, 0, 0.0, 0.0)


class Design(EstimatorDesign):
    """Formats, run-time words and latency of the loop for an axis, derived as the module says.

    Attributes:
        step_max: largest difference of counts.
        least, most: the range of h within which only the difference of counts saturates.
        velocity, lead, v, operand: formats of the output, of the two states, and of what the multiplier takes.
        shifts: right shifts of the first product to the LSB of lead, and of the second to the LSB of v.
        bandwidth_min_hz, bandwidth_max_hz: range of bandwidths that a design may have.
        words: `tracking_loop_bandwidth`, in Hz.

    Raises:
        ValueError: if the bandwidth is outside `bandwidth_min_hz` to `bandwidth_max_hz`, with that range.
    """

    name = "tracking-loop"
    gains_class = Gains
    flags = ("velocity_saturated", "innovation_saturated", "state_saturated")
    latency = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self.step_max = largest_step(axis)
        self._hz = axis.sample_hz / (2 * math.pi)
        self.bandwidth_max_hz = bandwidth_max_hz(axis)
        held = next(bits for bits in range(INDEX_BITS_MAX, 0, -1) if self._room(2.0**-bits) >= 0)
        self.bandwidth_min_hz = 2.0**-held * self._hz
        self._check(gains.bandwidth_hz)
        index = min(gains.bandwidth_hz / self._hz, INDEX_MAX)

        f = axis.shrunk(min(fraction_bits(axis, RESOLUTION_BITS), self._room(index)))
        i, i_lead, reach, less = self._bits(index)
        self.least, self.most = index * 2.0**-RANGE_BITS, _most(index)
        self.velocity = SQ(i, f)
        self.lead, self.v = SQ(i_lead, f + GUARD_BITS), SQ(i, f + GUARD_BITS + reach)
        self.operand = SQ(i_lead, f + GUARD_BITS - less)
        fmt = _format(index)
        doc, least = "bandwidth of the loop, both poles", math.ceil(self.least * 2**fmt.f)
        self.words = (Word("tracking_loop_bandwidth", fmt, self._hz, "Hz", fmt.from_real(index), doc, least),)
        self.shifts = fmt.f - less, fmt.f - reach

    def _bits(self, index: float) -> tuple[int, int, int, int]:
        """Return the integer bits of v and of lead, `reach` and `less`, for a designed h."""
        least = index * 2.0**-RANGE_BITS
        i = 1 + bits_for(self.step_max + 1)
        i_lead = 1 + bits_for(LEAD_NORM * self.step_max / least + 1)
        # The largest word is at least half of its format's range, so that less is not below 0.
        return i, i_lead, max(bits_for(1 / least), 1), bits_for(1 / _most(index)) - 1

    def _room(self, index: float) -> int:
        """Return how many fraction bits the velocity may have so that every intermediate fits int64."""
        i, i_lead, reach, less = self._bits(index)
        # The distance of two positions has two bits more than lead; the new velocity has one more than its terms.
        most = max(i_lead + 2, i_lead - less + GAIN_BITS, max(i, i_lead - 2 * less) + reach + 1)
        return 62 - GUARD_BITS - most

    def _check(self, bandwidth_hz: float) -> None:
        low, high = self.bandwidth_min_hz, self.bandwidth_max_hz
        if not low * (1 - 1e-9) <= bandwidth_hz <= high * (1 + 1e-9):
            raise FieldError("bandwidth_hz", f"must be {low:g} to {high:g} at these rates, not {bandwidth_hz!r}")

    @property
    def fastest(self) -> int:
        """The velocity's word at a difference of counts that is limited at every sample."""
        return self.step_max << self.velocity.f

    def params(self, words: Mapping[str, int]) -> Params:
        return Params(
            h=words["tracking_loop_bandwidth"],
            position_shift=self.shifts[0],
            velocity_shift=self.shifts[1],
            count_width=self.count_width,
            step_max=self.step_max,
            fraction=self.lead.f,
            reach=self.v.f - self.lead.f,
            operand_shift=self.lead.f - self.operand.f,
            output_shift=self.v.f - self.velocity.f,
            lead_max=self.lead.max,
            v_max=self.velocity.max << (self.v.f - self.velocity.f),
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: the bandwidth from `si` where given, else from `gains`."""
        return FloatParams(si.get("tracking_loop_bandwidth", gains.bandwidth_hz) / self._hz, self.count_width)

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


def _format(index: float) -> UQ:
    """Return the format of the word for a designed h: its largest word is below 1/2."""
    return gain_format(min(2**HEADROOM_BITS * index, INDEX_MAX))


def _most(index: float) -> float:
    fmt = _format(index)
    return fmt.to_real(fmt.max)


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    fresh = restart or not state.running
    moved = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    lead = 0 if fresh else state.lead
    v = 0 if fresh else state.v

    d = saturate(moved, -params.step_max, params.step_max)
    distance = lead + (v >> params.reach) - (d << params.fraction)
    lead = saturate(distance, -params.lead_max, params.lead_max)
    pull = shift_floor(params.h * (lead >> params.operand_shift), params.position_shift)
    far_v = v - shift_floor(params.h * pull, params.velocity_shift)
    v = saturate(far_v, -params.v_max, params.v_max)

    flags = int(d != moved) | int(lead != distance) << 1 | int(v != far_v) << 2
    return State(1, seen.count, lead - 2 * pull, v), shift_round_half_up(v, params.output_shift), flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same loop, as a reference for the cost of fixed point."""
    fresh = restart or not state.running
    d = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    lead = 0.0 if fresh else state.lead
    v = 0.0 if fresh else state.v

    lead += v - d
    pull = params.h * lead
    v -= params.h * pull
    return State(1, seen.count, lead - 2 * pull, v), v, 0
