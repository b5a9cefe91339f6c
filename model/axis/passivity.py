"""The passivity observer and controller: what the drive has taken and given, and a damper while it has given more.

The observer adds up the energy that the drive has taken from the handle. The drive holds from sample to sample, so with
the position of the handle at a sample that is a product, without a velocity:

    energy <- energy - drive (position - last position)      drive: the one that answers the last sample

The position is known better than a count. If the count has changed by one at a sample, one edge has passed, and the
handle is still near it: at the lower end of its count after a step up, at the upper end after a step down. After
several edges in a sample it is somewhere in its count, whose middle is taken. So an ideal wall of any stiffness gets no
damping at all, at any speed of up to one edge a sample. In this measure, a handle that shakes about an edge does not
move.

Energy taken from the handle is a credit, energy given to it a debt. A credit is dropped where the wall renders no
force, and is forgotten within `MEMORY_S`: an early impact would otherwise pay for a chatter long after it. A debt
stays, across contacts, disables and faults. A preload or a shift of the origin, after which the position is another,
begins with neither.

In debt, where the wall renders a force, the controller adds a damper to it:

    given = force - part velocity,     part = min(passivity_damping, what dissipates the debt until the next actuation)

It takes a force to zero at most, and never turns it: it cannot pull where the wall pushes. The force is within the
axis's range before the damper is taken off; in float64, where a wall has no range, behind it. The hardware halves the
damper where float64 divides. The part is passivity_damping 2**-n with the least n that satisfies this: the bits of the
damper's force, the velocity and the samples until the next actuation are together at most the bits of the debt. Unless
n is 0, less than twice the debt is dissipated until then. At least a quarter of the debt is dissipated where the
samples of an actuation are a power of two, else an eighth. One exception is the rounding of the part to zero: a debt of
less than the work of one force LSB stays.

Formats, derived, with the force LSB r and the count q:

- The energy has the unit r q / 2, in which force times position is whole. It saturates at the work of the largest drive
  over the whole travel, or up to twice that, where its word ends.
- `passivity_damping` has the format of the wall's largest damping. The velocity keeps the fraction bits that can move
  the damper's force by half a force LSB; the damper's force is rounded once, half up, and saturates with the force.

Source: Hannaford and Ryu, Time-domain passivity control of haptic interfaces, IEEE Transactions on Robotics and
Automation 18(1), 2002. The energy by positions instead of velocities follows Ryu, Preusche, Hannaford and Hirzinger,
IEEE Transactions on Control Systems Technology 13(5), 2005. The position by edges, and the halving, are this project's.
"""

import math
from typing import NamedTuple

from ..arithmetic.fixed import SQ, bits_for, length_of, saturate, shift_floor, shift_round_half_up, wrap
from ..requirements import AxisRequirements
from ..runtime.compiled import by_type, compiled, inlined
from ..words import Word
from .wall import damper_formats

FLAGS = ("passivity_active",)
LATENCY = 3
"""Clocks from the wall's force to what is given on: see `hardwall.hdl.axis.passivity`."""
BEHIND = 3
"""Clocks from the velocity to the wall's force, at least: what else the controller needs is known then."""
MEMORY_S = 0.25
"""The time in which a credit falls to 1/e, s; the nearest power of two samples."""
LOWER, MIDDLE, UPPER = 0, 1, 2
"""Where in its count the handle is, half counts above its lower end."""


class Absent(NamedTuple):
    """Parameters of an axis without a controller. Numba compiles no tuple without a field."""

    none: int


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    damping: int
    count_width: int
    velocity_shift: int
    damper_shift: int
    spare_bits: int
    memory: int
    energy_max: int
    force_max: int


class FloatParams(NamedTuple):
    """Float64 parameters: damping in force LSB a count/sample, unrounded."""

    damping: float
    count_width: int
    decimation: int
    kept: float
    energy_max: float
    force_max: float


class State(NamedTuple):
    """The energy that the drive has taken, force LSB half counts; the last count, and where in it the handle was."""

    energy: float
    last_count: int
    within: int


ABSENT = Absent(0)
START = State(0, 0, MIDDLE)
FLOAT_START = State(0.0, 0, MIDDLE)


class Design:
    """Formats and run-time words of the observer and controller of an axis, with a velocity of format `velocity`.

    Attributes:
        damping: format of the controller's damping.
        coarse: format of the velocity as the damper takes it.
        displacement: format of the change of position in a sample, half counts.
        energy: format of the energy, force LSB half counts; its least word is not used.
        shift: fraction bits of the product of damping and velocity.
        spare_bits: bits of the dissipation until the next actuation, in addition to the bits of its factors'
            magnitudes.
        memory: a credit loses 2**-memory of itself in a sample.
        words: `passivity_damping`.
    """

    latency = LATENCY
    behind = BEHIND
    flags = FLAGS

    def __init__(self, axis: AxisRequirements, velocity: SQ):
        q, r, tau = axis.count_m, axis.force_resolution_n, 1 / axis.sample_hz
        self.count_width = axis.count_width
        self.decimation = axis.samples_per_actuation
        self.force = axis.force
        self.velocity = velocity
        self.damping, self.coarse, _ = damper_formats(axis, velocity)
        self.shift = self.damping.f + self.coarse.f
        # A clock counts one edge at most. A sample's largest change begins and ends anywhere in a count.
        self.displacement = SQ(1 + bits_for(2 * min(axis.clocks_per_sample, 1 << axis.count_width - 1) + 3), 0)
        self.energy = SQ(1 + (axis.force_limit_word * math.ceil(2 * axis.travel_m / q)).bit_length(), 0)
        self.spare_bits = 1 - self.coarse.f + (self.decimation - 1).bit_length()
        self.memory = max(round(math.log2(MEMORY_S * axis.sample_hz)), 1)
        self.words = (
            Word(
                "passivity_damping", self.damping, r * tau / q, "N s/m", 0,
                "largest damping that the passivity controller adds; 0: it adds none",
            ),
        )  # fmt: skip

    def params(self, words: dict[str, int]) -> Params:
        """Return the kernel's parameters for the given run-time words."""
        return Params(
            damping=words["passivity_damping"],
            count_width=self.count_width,
            velocity_shift=self.velocity.f - self.coarse.f,
            damper_shift=self.shift,
            spare_bits=self.spare_bits,
            memory=self.memory,
            energy_max=self.energy.max,
            force_max=self.force.max,
        )

    def float_params(self, damping_n_s_per_m: float) -> FloatParams:
        """Return the float64 kernel's parameters, with the damping unrounded."""
        return FloatParams(
            damping_n_s_per_m / self.words[0].si_per_unit,
            self.count_width,
            self.decimation,
            1.0 - 2.0**-self.memory,
            float(self.energy.max),
            float(self.force.max),
        )


@by_type
def step(params, state, count, restart, velocity, force, drive):
    """Take one sample: return (state, force that is given on, flags).

    Args:
        params: `Params`, `FloatParams`, or `ABSENT` for an axis without a controller: its force is given on as it is.
        state: `START`, `FLOAT_START` or `ABSENT`, or the state that the previous call returned.
        count: position, counts, as a signed word that may have wrapped.
        restart: true if the count was preloaded or shifted since the last sample.
        velocity: word of the estimator's velocity format (float: counts a sample).
        force: the wall's force on the handle, force LSB.
        drive: the drive that answers the last sample, force LSB, as if it acted from that sample on.
    """


@step.register(Absent)
@inlined
def _nothing(params, state, count, restart, velocity, force, drive):
    return state, force, 0


@compiled
def _step(params, state, count, restart, velocity, force, drive):
    moved = wrap(count - state.last_count, params.count_width)
    within = LOWER if moved == 1 else UPPER if moved == -1 else MIDDLE
    if moved == 0:
        within = state.within
    half_counts = 2 * moved + within - state.within
    energy = saturate(state.energy - drive * half_counts, -params.energy_max, params.energy_max)
    if restart:
        within, energy = MIDDLE, 0 * energy
    damper = part_of(params, energy, velocity) if energy < 0 and force != 0 else 0 * force
    most = params.force_max
    given = saturate(force - damper, -most if force < 0 else 0 * most, most if force > 0 else 0 * most)
    if energy > 0:
        energy = 0 * energy if force == 0 else forgotten(params, energy)
    return State(energy, count, within), given, int(damper != 0)


step.register(Params)(_step)
step.register(FloatParams)(_step)


@by_type
def part_of(params, energy, velocity):
    """Return the force of the part of the damper that a debt, an energy below 0, takes."""


@by_type
def forgotten(params, energy):
    """Return what a sample leaves of a credit."""


@compiled
def significant_bits(value):
    """Return the number of bits of a value without its leading copies of the sign; 0 and -1 have none."""
    return length_of(value if value >= 0 else ~value)


@part_of.register(Params)
@compiled
def word_part_of(params, energy, velocity):
    coarse = shift_floor(velocity, params.velocity_shift)
    damper = shift_round_half_up(params.damping * coarse, params.damper_shift)
    damper = saturate(damper, -params.force_max, params.force_max)
    bits = significant_bits(damper) + significant_bits(coarse) + params.spare_bits
    part = abs(damper) >> min(max(bits - significant_bits(energy), 0), 63)
    return part if damper > 0 else -part


@part_of.register(FloatParams)
@compiled
def float_part_of(params, energy, velocity):
    speed = abs(velocity)
    part = params.damping * speed
    owed = -energy / 2.0
    # Without a division by a velocity near 0.
    if part * speed * params.decimation > owed:
        part = owed / (speed * params.decimation)
    return part if velocity > 0.0 else -part


@forgotten.register(Params)
@compiled
def word_forgotten(params, energy):
    return energy - ((energy + (1 << params.memory) - 1) >> params.memory)


@forgotten.register(FloatParams)
@compiled
def float_forgotten(params, energy):
    return energy * params.kept
