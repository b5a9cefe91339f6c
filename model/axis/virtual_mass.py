"""Virtual mass: a force against the acceleration of the handle, in the wall and in free space.

    M = wall_mass where the wall acts, else free_mass
    given = force - M acceleration                              on the handle

A positive M makes the handle heavier. A negative one makes it lighter: it compensates a part of the handle's inertia.
In a wall that may not pull (`wall_forbid_pull`) the sum does not pull either, also where the wall's force is 0. Where
a wall acts is `wall.acts`: a force law of one's own that is to have a virtual mass has a variant of it.

Bounds. Both words are within `virtual_mass_max_kg`, rounded up to a word, which must be less than the mass of the
handle. A word beyond it acts as the bound. Let the handle have the mass m, and the acceleration be known exactly, but
late. In m a = -M a', with a' of one force period before, a grows from period to period if |M| > m, with either sign. So
a larger M is not stable with an exact acceleration. An estimator's own delay and noise matter, too: `hardwall mass` has
the maps. After reset both words are 0.

Formats, with the force LSB r, the count q and the sample period tau:

- `mass` is a signed word of 16 bits, in force LSB a count/sample^2, with the finest resolution that holds the bound.
- The acceleration keeps the fraction bits that can move the force by half an LSB at the largest mass; the other bits
  are dropped (floor).
- The product is rounded once, half up, to a force LSB. It is then at most twice the largest force, which no sum with a
  force can tell from more. The sum saturates at the largest magnitude of the force format.

So fixed point differs from the exact equation on the same words and force by at most one force LSB.

Source: Gil, Rubio and Savall, IEEE Transactions on Control Systems Technology 17(4), 2009, for less apparent inertia;
they use a sensor of force. The bound is derived above.
"""

import math
from typing import NamedTuple

from ..arithmetic.fixed import SQ, saturate, shift_floor, shift_round_half_up
from ..checks import FieldError
from ..estimators.acceleration import acceleration_of
from ..requirements import AxisRequirements
from ..runtime.compiled import by_type, compiled, inlined
from ..words import ROUNDING, Word, gain_format
from .wall import acts

LATENCY = 1
"""Clocks from the wall's force to the force that is given on."""
BEHIND = 2
"""Clocks from the strobe with the acceleration to the force of the same sample, at least."""
FIELD = "virtual_mass_max_kg"
"""The field of an axis that gives it this block."""
PRODUCT_BITS = 60
"""The most bits of a product, and of what is rounded off it."""


class Absent(NamedTuple):
    """Parameters of an axis without a virtual mass. Numba compiles no tuple without a field."""

    none: int


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    in_wall: int
    in_free_space: int
    acceleration_shift: int
    mass_shift: int
    inertia_max: int
    force_max: int


class FloatParams(NamedTuple):
    """Float64 parameters: masses in force LSB a count/sample^2, unrounded."""

    in_wall: float
    in_free_space: float
    force_max: float


ABSENT = Absent(0)


class Design:
    """Formats and run-time words of the virtual mass of an axis, with an acceleration of format `acceleration`.

    Args:
        axis: the axis.
        acceleration: format of the estimator's acceleration.
        most_kg: the largest magnitude of a mass, kg.

    Attributes:
        mass: format of a mass.
        most: the largest magnitude of its word.
        coarse: format of the acceleration as the masses take it.
        shift: fraction bits of the product.
        inertia: format of the rounded product, force LSB.
        words: `wall_mass`, `free_mass`.

    Raises:
        FieldError: if it is so large or small that the product would not fit the model's int64.
    """

    latency = LATENCY
    behind = BEHIND

    def __init__(self, axis: AxisRequirements, acceleration: SQ, most_kg: float):
        unit_kg = axis.force_resolution_n / (axis.velocity_unit_m_per_s * axis.sample_hz)
        # A bit is the sign's, and the bound is rounded up to a word.
        gain = gain_format(most_kg / unit_kg * (1 + 2.0**-14))
        self.mass = SQ(gain.i + 1, gain.f - 1)
        self.most = math.ceil(most_kg / (self.mass.lsb * unit_kg) * (1 - ROUNDING))
        self.force, self.acceleration = axis.force, acceleration
        self.coarse = SQ(acceleration.i, max(min(acceleration.f, self.mass.i), 1 - acceleration.i))
        self.shift = self.mass.f + self.coarse.f
        self.inertia = SQ(axis.force.width + 1, 0)
        wide = self.mass.width + self.coarse.width - self.shift - PRODUCT_BITS
        fine = self.shift - PRODUCT_BITS
        if wide > 0:
            accepted = f"at most {most_kg * 2.0**-wide:g} beside the resolution of force and acceleration"
        elif fine > 0:
            accepted = f"at least {most_kg * 2.0**fine:g} beside the force's resolution"
        if wide > 0 or fine > 0:
            raise FieldError(FIELD, f"must be {accepted}, not {most_kg!r}")
        bounds = -self.most, self.most
        self.words = (
            Word("wall_mass", self.mass, unit_kg, "kg", 0, "virtual mass where the wall acts", *bounds),
            Word("free_mass", self.mass, unit_kg, "kg", 0, "virtual mass elsewhere; it is below 0 to lighten", *bounds),
        )

    def params(self, words: dict[str, int]) -> Params:
        """Return the kernel's parameters for the given run-time words."""
        return Params(
            in_wall=saturate(words["wall_mass"], -self.most, self.most),
            in_free_space=saturate(words["free_mass"], -self.most, self.most),
            acceleration_shift=self.acceleration.f - self.coarse.f,
            mass_shift=self.shift,
            inertia_max=self.inertia.max,
            force_max=self.force.max,
        )

    def float_params(self, wall_kg: float, free_kg: float) -> FloatParams:
        """Return the float64 kernel's parameters, with the masses unrounded."""
        unit_kg = self.words[0].si_per_unit
        return FloatParams(wall_kg / unit_kg, free_kg / unit_kg, float(self.force.max))


@by_type
def borne(params, wall, estimator, state, count, force):
    """Return the force of a sample behind the virtual mass, force LSB.

    Args:
        params: `Params` (integer words), `FloatParams` (float64), or `ABSENT`: the force is given on as it is.
        wall, estimator: the parameters of these blocks.
        state: what the estimator has returned.
        count: position, counts, a signed word.
        force: the wall's force on the handle, force LSB.
    """


@borne.register(Absent)
@inlined
def _not_borne(params, wall, estimator, state, count, force):
    return force


@compiled
def _borne(params, wall, estimator, state, count, force):
    positive, negative = acts(wall, count)
    return weighed(params, acceleration_of(estimator, state), force, positive, negative)


borne.register(Params)(_borne)
borne.register(FloatParams)(_borne)


@by_type
def weighed(params, acceleration, force, positive, negative):
    """Return the force less what the mass takes, force LSB.

    Args:
        params: `Params` or `FloatParams`.
        acceleration: word of the estimator's acceleration (float: counts a sample^2).
        force: the wall's force on the handle, force LSB.
        positive, negative: the signs that the force may have; neither in free space: see `wall.acts`.
    """


@compiled
def _limited(params, total, positive, negative):
    """Return a sum within the range of the force, and with a sign that it may have."""
    most, free = params.force_max, not (positive or negative)
    return saturate(total, -most if negative or free else 0 * most, most if positive or free else 0 * most)


@weighed.register(Params)
@compiled
def word_weighed(params, acceleration, force, positive, negative):
    mass = params.in_wall if positive or negative else params.in_free_space
    product = mass * shift_floor(acceleration, params.acceleration_shift)
    inertia = saturate(shift_round_half_up(product, params.mass_shift), -params.inertia_max, params.inertia_max)
    return _limited(params, force - inertia, positive, negative)


@weighed.register(FloatParams)
@compiled
def float_weighed(params, acceleration, force, positive, negative):
    mass = params.in_wall if positive or negative else params.in_free_space
    return _limited(params, force - mass * acceleration, positive, negative)
