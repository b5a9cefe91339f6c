"""All-integrator Kalman filter with steady-state gains, in fixed point.

Position, velocity and acceleration, x, v and a, in counts and sample periods; per sample, with f the count:

    v <- v + a,  x <- x + v - a / 2          predict; with the new v
    r  = f - x                               innovation
    x <- x + K_x r,  v <- v + K_v r,  a <- a + K_a r

x is held as its distance from the last count, `lead` = x - f, so that the count may wrap. The output `u` is v. This is
the filter of a motion driven by white jerk. With K_a = 0, a is held at 0 and it is the filter of white acceleration,
with two integrators: `Design.words_for(..., integrators=2)`. On the paper's signal two integrators lag by sqrt(2)/omega
whatever the motion; three lag only by the change of the acceleration in that time. At 1 MHz with the gains below: 0.16
mm/s for two and 0.09 mm/s for three; at the best bandwidth of each: 0.16 and 0.02 mm/s. So three are the default.

Source: Belanger, Dobrovolny, Helmy, Zhang, International Journal of Robotics Research 17 (1998), 1225.

Noise model. The quantisation error and the acceleration are two stationary signals with exponential correlation: the
error has RMS q / sqrt(12), and the acceleration, uniform within the axis's C, has RMS C / sqrt(3). The correlation
times (`noise_time_s`, `acceleration_time_s`) are by default 2 sqrt(q/C), the minimax window of an error of one count.
In a shorter time a change of acceleration does not show in the counts. Nor does an axis that starts to move reach the
next count. Either signal is modelled as a white one with the same power below those rates:

    R = rms^2 coth(tau / (2 time))        counts^2: gives the variance of the mean of many samples
    Q = 2 rms^2 (1 - exp(-tau / time))    mean square change of the acceleration in a sample
    h = (Q / R)^(1/6)                     filter's bandwidth times the sample period; two integrators:
                                          (rms^2 coth(tau / (2 time)) / R)^(1/4), with the acceleration's

For tau -> 0 and the default gains h = tau sqrt(C/q): a bandwidth of 3464 rad/s for C = 12 m/s^2 on 1 um at any rate.

A told jerk J, `jerk_max_m_per_s3`, says more than C does if it changes the acceleration by less than C in that time.
Then the acceleration is the one that a jerk uniform within J makes in a time T: RMS J T / sqrt(3), correlation time
T = (4 q/J)^(1/3); the error of the count is correlated for T, too. For tau -> 0 the bandwidth is (2 J/q)^(1/3),
whatever T is. With this T the model joins the one of C where J changes the acceleration by C in 2 sqrt(q/C). This
filter remembers no quiet time, so the bound has to hold at an impact too: a wall ends a motion with far more jerk than
a hand.

If quantisation were modelled as white at the sampling rate, the bandwidth would grow with the rate although no count
comes sooner. The gains follow from h alone: `riccati.steady_state`. For small h, K = (2 h, 2 h^2, h^3).

Formats, derived. C' = C tau^2 / q; 2**reach is at least 1/h and at least 1.

- The difference of counts is held within `step_max`: the counts that twice the largest speed moves in a sample, begun
  within a count, and one count for an edge out of place. A larger difference saturates (flag `velocity_saturated`): the
  excess is a displacement of the scale, without later effect.
- The states are then bounded by the norms (sums of absolute impulse responses) from the difference of counts to v, a
  and lead: `norms`, times `step_max`. Their formats hold that bound plus one of their unit; with the gains of a noise
  model nothing else saturates. With other gains `lead` may saturate (flag `innovation_saturated`; it drags x along), or
  v or a (flag `state_saturated`).
- f, fraction bits of the velocity: an LSB is at most sqrt(C') 2**-RESOLUTION_BITS.
- lead, v and a have GUARD_BITS more than f; v has another `reach`, and a another twice `reach`: a state's rounding
  error appears in the velocity 1, 1/h and 1/h^2 times. An error of r appears h times, so the operand r has reach - 1
  bits less than lead. All products, the sums' narrower parts and r are floored. In the worst case all floors add up to
  ERROR_NORM 2**-GUARD_BITS of an LSB of the velocity, which is less than a half: *at constant n counts a sample the
  velocity, rounded half up, settles to n exactly*, to 0 at standstill. A limit cycle of the states may remain that no
  output shows.
- `acceleration`, the second output: a, rounded half up, with `reach` bits more than the velocity, within 32 bits. The
  floors add up to less than half an LSB of it, too: *at constant speed the acceleration settles to 0 exactly*. It has
  one integer bit more than a, so that the largest a can be rounded.
- The gain words are GAIN_BITS wide, in formats with HEADROOM_BITS above the designed gain. The exact settling holds for
  gains of the designed h, or of any larger h that the words hold; with others the last bits may move.
- int64 holds 62 bits: if the formats do not fit, f is reduced.

Range of the gains. The poles are roots of the polynomial z^3 + (K_x + K_v + K_a/2 - 3) z^2 + (3 - 2 K_x - K_v + K_a/2)
z + K_x - 1. By Jury's criterion they are stable if and only if

    0 < K_x < 2,    0 < K_v,    0 < K_a,    2 K_x + K_v < 4,    K_a (2 - K_x) < 2 K_x K_v

and with K_a = 0, where the filter has two integrators, without the conditions on K_a. Each word has a range of its own,
so the ranges are a box within that region. K_a may be 0 to r times the designed one, K_x and K_v no less than 1/r
times. With r = sqrt(2), or less for an h near 1 and above, the last condition holds in all of the box, by STABLE. (The
designed gains have 0.25 there for small h.) K_x and K_v may be raised together by sqrt(4 / (2 K_x + K_v)) of the
designed ones, 4 at most. So a host may set the gains of a bandwidth of 0.85 to 1.12 times the designed one, and either
number of integrators. `kalman_position = 0`, which leaves an oscillation without damping, and `kalman_velocity = 0` are
refused.

Restart and the first sample: all states 0; the count may wrap. A start from rest has no transient; a start in motion
has the step response, as for any step of velocity: about 41 % overshoot, settled in a few times sqrt(q / C).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..arithmetic.fixed import SQ, bits_for, saturate, shift_floor, shift_round_half_up, wrap
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import GAIN_BITS, Word, gain_format
from .acceleration import WIDTH, Accelerated, acceleration_of
from .estimate import EstimatorGains, estimate, fraction_bits, largest_step
from .riccati import steady_state

RESOLUTION_BITS = 11
"""The output LSB is at most sqrt(C') 2**-RESOLUTION_BITS."""
GUARD_BITS = 6
"""Bits of `lead` below the output LSB."""
ERROR_NORM = 18.0
"""Largest sum of all rounding errors at v, in units of a guard bit: see the module's docstring."""
HEADROOM_BITS = 2
"""Gains of position and velocity may be raised to at most 2**HEADROOM_BITS times the designed ones at run time."""
RATIOS = tuple(2 ** (step / 64) for step in range(32, -1, -1))
"""The first stable one of these factors lowers those gains and raises the gain of the acceleration."""
STABLE = 0.75
"""Largest part of 2 K_x K_v that K_a (2 - K_x) may be, where 1 is the limit of stability."""
STEPS = 12
"""Clocks of the sequence: see `hardwall.hdl.estimators.kalman`."""


@dataclass(frozen=True)
class Gains(EstimatorGains):
    """The noise model, SI units.

    Attributes:
        acceleration_rms_m_per_s2, acceleration_time_s: the axis's acceleration, and its correlation time.
        noise_rms_m, noise_time_s: the error of the measured position, and its correlation time.
    """

    acceleration_rms_m_per_s2: float
    acceleration_time_s: float
    noise_rms_m: float
    noise_time_s: float

    @classmethod
    def default(cls, axis: AxisRequirements) -> "Gains":
        """Return the default noise model: uniform acceleration within C, or told jerk, and uniform quantisation."""
        bound, jerk, q = axis.acceleration_max_m_per_s2, axis.jerk_max_m_per_s3, axis.count_m
        window = 2 * math.sqrt(q / bound)
        if jerk is not None and jerk * window < bound:
            window = (4 * q / jerk) ** (1 / 3)
            bound = jerk * window
        return cls(bound / math.sqrt(3), window, q / math.sqrt(12), window)

    def index(self, axis, integrators: int = 3) -> float:
        """Return h, the bandwidth times the sample period."""
        tau = 1 / axis.sample_hz
        noise = (self.noise_rms_m / axis.count_m) ** 2 / math.tanh(tau / (2 * self.noise_time_s))
        power = (self.acceleration_rms_m_per_s2 * tau**2 / axis.count_m) ** 2
        if integrators == 2:
            return (power / math.tanh(tau / (2 * self.acceleration_time_s)) / noise) ** (1 / 4)
        return (-2 * power * math.expm1(-tau / self.acceleration_time_s) / noise) ** (1 / 6)


def norms(index: float) -> tuple[float, float, float]:
    """Return bounds of the norms from the difference of counts to v, a and lead.

    The bounds for a and lead are in units of h and 1/h, with h held to at most 1.
    """
    return (2.1, 1.0, 1.1 + 2.2 * index) if index <= 1 else (3.7, 5.5, 7.4)


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    k_x: int
    k_v: int
    k_a: int
    x_shift: int
    v_shift: int
    a_shift: int
    count_width: int
    step_max: int
    fraction: int
    v_to_x: int
    a_to_v: int
    operand_shift: int
    output_shift: int
    acceleration_shift: int
    lead_max: int
    v_max: int
    a_max: int


class State(NamedTuple):
    """The state, in the formats of `Design` (float: counts and sample periods); `count` is the last count."""

    running: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    lead: float
    v: float
    a: float


class FloatParams(NamedTuple):
    k_x: float
    k_v: float
    k_a: float
    count_width: int


START = State(0, 0, 0, 0, 0)
FLOAT_START = State(0, 0, 0.0, 0.0, 0.0)


class Design(Accelerated):
    """Formats, run-time words and latency of the filter for an axis, derived as the module says.

    Attributes:
        step_max: largest difference of counts.
        velocity, acceleration: formats of the outputs.
        lead, v, a, operand: formats of the three states, and of r as the multiplier takes it.
        shifts: right shifts of the products with the three gains to the LSB of their states.
        words: `kalman_position`, `kalman_velocity`, `kalman_acceleration`.

    Raises:
        ValueError: if the noise model has a bandwidth too small for int64, with the least accepted acceleration.
    """

    name = "kalman"
    gains_class = Gains
    flags = ("velocity_saturated", "innovation_saturated", "state_saturated")
    latency = STEPS

    def __init__(self, axis: AxisRequirements, gains: Gains):
        super().__init__(axis, gains)
        self._axis = axis
        self.step_max = most = largest_step(axis)
        index = gains.index(axis)
        h = min(index, 1.0)
        norm_v, norm_a, norm_lead = norms(index)
        i = 1 + bits_for(norm_v * most + 1)
        i_a = 1 + bits_for((norm_a * most + 1) * h)
        i_lead = 1 + bits_for(norm_lead * most / h + 1)
        reach = max(bits_for(1 / h), 0)
        less = max(reach - 1, 0)
        # The sums need three bits more than the states, the product one more.
        room = min(
            60 - GUARD_BITS - reach - i,
            60 - GUARD_BITS - 2 * reach - i_a,
            60 - GUARD_BITS - i_lead,
            62 - GAIN_BITS - GUARD_BITS + less - i_lead,
        )
        if room < 0:
            least = gains.acceleration_rms_m_per_s2 * 2.0 ** (-3 * room)
            raise FieldError(
                "acceleration_rms_m_per_s2",
                f"must be at least {least:g} at these rates, not {gains.acceleration_rms_m_per_s2!r}; its default "
                "follows from the bounds on the acceleration and on the jerk",
            )
        f = axis.shrunk(min(fraction_bits(axis, RESOLUTION_BITS), room))
        fine = f + GUARD_BITS
        self.velocity = SQ(i, f)
        self.lead, self.v, self.a = SQ(i_lead, fine), SQ(i, fine + reach), SQ(i_a, fine + 2 * reach)
        self.operand = SQ(i_lead, fine - less)
        self.acceleration = SQ(i_a + 1, min(f + reach, WIDTH - i_a - 1))

        reset = self.words_for(gains)
        units = (1.0, ""), (axis.sample_hz, "1/s"), (axis.sample_hz**2, "1/s^2")
        per_sample = [value / scale for value, (scale, _) in zip(reset.values(), units, strict=True)]
        k_x, k_v, k_a = per_sample
        raised = min(math.sqrt(4 / (2 * k_x + k_v)), 2.0**HEADROOM_BITS)
        ratio = next(r for r in RATIOS if r * k_a * (2 - k_x / r) <= STABLE * 2 * k_x * k_v / r**2)
        bounds = (1 / ratio, raised), (1 / ratio, raised), (0.0, ratio)
        words = []
        for name, value, (scale, unit), (down, up) in zip(reset, per_sample, units, bounds, strict=True):
            largest = 2**HEADROOM_BITS * value
            fmt = gain_format(min(largest, 2 - 2.0 ** (1 - GAIN_BITS)) if scale == 1 else largest)
            ends = math.ceil(down * value * 2**fmt.f), min(math.floor(up * value * 2**fmt.f), fmt.max)
            what = name.removeprefix("kalman_")
            words.append(Word(name, fmt, scale, unit, fmt.from_real(value), f"gain of the {what}", *ends))
        self.words = tuple(words)
        self.shifts = tuple(
            self.operand.f + word.format.f - state.f
            for word, state in zip(words, (self.lead, self.v, self.a), strict=True)
        )

    def words_for(self, gains: Gains, integrators: int = 3) -> dict[str, float]:
        """Return the three gains, by word and in SI units, for a noise model and 3 or 2 integrators."""
        k_x, k_v, k_a = steady_state(gains.index(self._axis, integrators), integrators)
        rate = self._axis.sample_hz
        return {"kalman_position": k_x, "kalman_velocity": k_v * rate, "kalman_acceleration": k_a * rate**2}

    @property
    def fastest(self) -> int:
        """The velocity's word at a difference of counts that is limited at every sample."""
        return self.step_max << self.velocity.f

    def params(self, words: Mapping[str, int]) -> Params:
        k_x, k_v, k_a = (words[word.name] for word in self.words)
        x_shift, v_shift, a_shift = self.shifts
        return Params(
            k_x=k_x,
            k_v=k_v,
            k_a=k_a,
            x_shift=x_shift,
            v_shift=v_shift,
            a_shift=a_shift,
            count_width=self.count_width,
            step_max=self.step_max,
            fraction=self.lead.f,
            v_to_x=self.v.f - self.lead.f + 1,
            a_to_v=self.a.f - self.v.f,
            operand_shift=self.lead.f - self.operand.f,
            output_shift=self.v.f - self.velocity.f,
            acceleration_shift=self.a.f - self.acceleration.f,
            lead_max=self.lead.max,
            v_max=self.velocity.max << (self.v.f - self.velocity.f),
            a_max=self.a.max,
        )

    def float_params(self, gains: Gains, output: str, si: Mapping[str, float]) -> FloatParams:
        """Return the float64 kernel's parameters: gains from `si` where given, else from the noise model."""
        value = {**self.words_for(gains), **si}
        k_x, k_v, k_a = (value[word.name] / word.si_per_unit for word in self.words)
        return FloatParams(k_x, k_v, k_a, self.count_width)

    def start(self, floating: bool = False) -> State:
        return FLOAT_START if floating else START


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    fresh = restart or not state.running
    moved = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    lead = 0 if fresh else state.lead
    v = 0 if fresh else state.v
    a = 0 if fresh or params.k_a == 0 else state.a

    d = saturate(moved, -params.step_max, params.step_max)
    before = v
    v = v + (a >> params.a_to_v)
    distance = lead - (d << params.fraction) + ((before + v) >> params.v_to_x)
    lead = saturate(distance, -params.lead_max, params.lead_max)
    r = -lead >> params.operand_shift
    far_v = v + shift_floor(params.k_v * r, params.v_shift)
    far_a = a + shift_floor(params.k_a * r, params.a_shift)
    v = saturate(far_v, -params.v_max, params.v_max)
    a = saturate(far_a, -params.a_max, params.a_max)

    flags = int(d != moved) | int(lead != distance) << 1 | int(v != far_v or a != far_a) << 2
    lead += shift_floor(params.k_x * r, params.x_shift)
    return State(1, seen.count, lead, v, a), shift_round_half_up(v, params.output_shift), flags


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample in float64, unsaturated: the same filter, as a reference for the cost of fixed point."""
    fresh = restart or not state.running
    d = 0 if fresh else wrap(seen.count - state.count, params.count_width)
    lead = 0.0 if fresh else state.lead
    v = 0.0 if fresh else state.v
    a = 0.0 if fresh or params.k_a == 0 else state.a

    lead += v + a / 2 - d
    v += a
    r = -lead
    return State(1, seen.count, lead + params.k_x * r, v + params.k_v * r, a + params.k_a * r), v + params.k_v * r, 0


@acceleration_of.register(Params)
@compiled
def acceleration(params, state):
    return shift_round_half_up(state.a, params.acceleration_shift)


@acceleration_of.register(FloatParams)
@compiled
def float_acceleration(params, state):
    return state.a
