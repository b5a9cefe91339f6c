"""The virtual wall: a unilateral spring and damper; or a virtual coupling, whose surface moves and holds on both sides.

    depth = side (count - wall)                            side = +1: the wall fills greater positions; -1: smaller ones
    push  = K depth + B side (velocity - wall_velocity)    for depth > 0, else 0
    force = -side push                                     on the handle

With `forbid_pull`, push is never negative: a damper that pulls back a leaving handle would make the wall sticky.

A `Design` with `coupling` has two words more. `wall_velocity` is the surface's velocity, else 0. With `two_sided` the
wall pushes at every depth, inside and outside. So a simulated tool can be coupled to the handle by a spring and a
damper at the rate of the axis. The tool itself may be simulated at a lower rate. (Colgate, Stanley and Brown, Issues in
the haptic display of tool use, IROS 1995.)

Formats, derived, with the force LSB r, the count q and the sample period tau:

- The depth has a bit more than the count, so that it is exact: a wall is at a place, and a far one is far. Differences
  of two counts of a handle are taken modulo the count's width; this one is none.
- `stiffness` and `damping` are gain words in force LSB a count and a count/sample.
- The velocity keeps only as many fraction bits as can move the push by half a force LSB at the largest damping; the
  other bits are dropped (floor). The surface's velocity has as many fraction bits, also where the estimator's has
  fewer. A finite difference has none: for the damper, a surface slower than a count a sample would then stand still.
- The products are added exactly and rounded once, half up, to a force LSB; then push saturates at the largest
  magnitude of the force format.

In total, fixed point differs from the exact equation on the same words by at most one force LSB.
"""

from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ, saturate, shift_floor, shift_round_half_up
from ..checks import FieldError
from ..requirements import AxisRequirements
from ..runtime.compiled import by_type, compiled
from ..words import Word, gain_format

LEAD = 2
"""Clocks from the pulse `lead`, with a sample's count, to the strobe with its velocity, at least.

The next sample's `lead` may come with that strobe, so these are also the clocks from one lead to the next.
"""
LATENCY = 3
"""Clocks from the strobe to `valid`: see `hardwall.hdl.axis.wall`."""


class Params(NamedTuple):
    """Words and shifts of the integer kernel; see `Design` for the formats."""

    stiffness: int
    damping: int
    position: int
    left: int
    forbid_pull: int
    velocity: int
    two_sided: int
    velocity_shift: int
    spring_shift: int
    damper_shift: int
    surface_shift: int
    push_shift: int
    force_max: int


class FloatParams(NamedTuple):
    """Float64 parameters: stiffness in force LSB a count, damping in force LSB a count/sample, both unrounded; the
    surface's velocity in counts/sample, and what a unit of its word is."""

    stiffness: float
    damping: float
    position: int
    left: int
    forbid_pull: int
    velocity: float
    two_sided: int
    velocity_lsb: float


def damper_formats(axis: AxisRequirements, velocity: SQ) -> tuple[UQ, SQ, SQ]:
    """Return three formats: of a damping word, in force LSB a count/sample; of the velocity as the damper takes it; and
    of a velocity with every bit that a damper can use."""
    tau = 1 / axis.sample_hz
    damping = gain_format(axis.damping_max_n_s_per_m * axis.count_m / tau / axis.force_resolution_n)
    whole = SQ(velocity.i, max(1 + damping.i, 1 - velocity.i))
    return damping, SQ(velocity.i, max(min(velocity.f, whole.f), 1 - velocity.i)), whole


class Design:
    """Formats and run-time words of the wall for an axis, with a velocity of format `velocity`.

    Args:
        axis: the axis.
        velocity: format of the estimator's velocity.
        coupling: whether the surface may move, and hold on both sides.
        borne: whether a virtual mass follows, which asks where the wall acts.

    Attributes:
        coupling, borne: as given.
        stiffness, damping: gain formats.
        depth: format of the depth.
        coarse: format of the velocity as the damper takes it.
        surface: format of the surface's velocity; for a wall at rest the format of `coarse`.
        push: fraction bits in which the products are added.
        lean_bits: bits of what the surface's velocity adds, with half a force LSB.
        total_bits: bits of the whole sum.
        words: `wall_stiffness`, `wall_damping`, `wall_position`, `wall_left`, `wall_forbid_pull`; for a coupling
            `wall_velocity` and `wall_two_sided`, too.

    Raises:
        FieldError: if the sum would not fit the model's int64.
    """

    latency = LATENCY
    lead = interval = LEAD

    def __init__(self, axis: AxisRequirements, velocity: SQ, coupling: bool = False, borne: bool = False):
        q, r, tau = axis.count_m, axis.force_resolution_n, 1 / axis.sample_hz
        self.count_width = axis.count_width
        self.force = axis.force
        self.velocity = velocity
        self.coupling, self.borne = coupling, borne
        self.stiffness = gain_format(axis.stiffness_max_n_per_m * q / r)
        self.damping, self.coarse, whole = damper_formats(axis, velocity)
        self.surface = whole if coupling else self.coarse
        self.push = max(self.stiffness.f, self.damping.f + self.surface.f, 0)
        self.depth = SQ(axis.count_width + 1, 0)
        spring_bits = 16 + self.depth.width + self.push - self.stiffness.f
        damper_bits = 16 + self.surface.width + self.push - self.damping.f - self.surface.f
        for name, bits in (("stiffness_max_n_per_m", damper_bits), ("damping_max_n_s_per_m", spring_bits)):
            if bits > 61:
                value = getattr(axis, name)
                least = value * 2.0 ** (bits - 61)
                raise FieldError(
                    name,
                    f"must be at least {least:g} beside the other gain's largest and the largest speed, not {value!r}",
                )
        for name, fraction in (
            ("stiffness_max_n_per_m", self.stiffness.f),
            ("damping_max_n_s_per_m", self.damping.f + self.surface.f),
        ):
            if fraction + self.force.width > 61:
                value = getattr(axis, name)
                least = value * 2.0 ** (fraction + self.force.width - 61)
                raise FieldError(name, f"must be at least {least:g} beside the force's resolution, not {value!r}")
        self.lean_bits = max(damper_bits, self.push + self.force.width) + 1
        self.total_bits = max(spring_bits + 1, self.lean_bits) + 1
        moving = (
            Word("wall_velocity", self.surface, q / tau, "m/s", 0, "velocity of the surface"),
            Word("wall_two_sided", UQ(1, 0), 1.0, "", 0, "1: the wall holds on both sides, if it may pull"),
        )
        self.words = (
            Word("wall_stiffness", self.stiffness, r / q, "N/m", 0, "spring of the wall"),
            Word("wall_damping", self.damping, r * tau / q, "N s/m", 0, "damper of the wall"),
            Word("wall_position", SQ(axis.count_width, 0), q, "m", 0, "surface of the wall"),
            Word("wall_left", UQ(1, 0), 1.0, "", 0, "0: the wall fills greater positions; 1: smaller ones"),
            Word("wall_forbid_pull", UQ(1, 0), 1.0, "", 1, "1: the wall never pulls the handle in"),
            *(moving if coupling else ()),
        )

    def params(self, words: dict[str, int]) -> Params:
        """Return the kernel's parameters for the given run-time words."""
        return Params(
            stiffness=words["wall_stiffness"],
            damping=words["wall_damping"],
            position=words["wall_position"],
            left=words["wall_left"],
            forbid_pull=words["wall_forbid_pull"],
            velocity=words.get("wall_velocity", 0),
            two_sided=words.get("wall_two_sided", 0),
            velocity_shift=self.velocity.f - self.coarse.f,
            spring_shift=self.push - self.stiffness.f,
            damper_shift=self.push - self.damping.f - self.coarse.f,
            surface_shift=self.push - self.damping.f - self.surface.f,
            push_shift=self.push,
            force_max=self.force.max,
        )

    def float_params(self, stiffness_n_per_m: float, damping_n_s_per_m: float, words: dict[str, int]) -> FloatParams:
        """Return the float64 kernel's parameters, with gains unrounded."""
        stiffness, damping = self.words[:2]
        return FloatParams(
            stiffness_n_per_m / stiffness.si_per_unit,
            damping_n_s_per_m / damping.si_per_unit,
            words["wall_position"],
            words["wall_left"],
            words["wall_forbid_pull"],
            words.get("wall_velocity", 0) * self.surface.lsb,
            words.get("wall_two_sided", 0),
            self.surface.lsb,
        )


@by_type
def render(params, count, velocity):
    """Return the wall's force on the handle, in force LSB.

    Args:
        params: `Params` (integer words) or `FloatParams` (float64).
        count: position, counts, a signed word.
        velocity: word of the estimator's velocity format (float: counts a sample).
    """


@compiled
def _depth(params, count):
    offset = params.position - count
    return offset if params.left else -offset


@render.register(Params)
@compiled
def step(params, count, velocity):
    depth = _depth(params, count)
    if not (params.two_sided or depth > 0):
        return 0
    damper = (params.damping * shift_floor(velocity, params.velocity_shift)) << params.damper_shift
    damper -= (params.damping * params.velocity) << params.surface_shift
    spring = (params.stiffness * depth) << params.spring_shift
    push = shift_round_half_up(spring - damper if params.left else spring + damper, params.push_shift)
    push = saturate(push, 0 if params.forbid_pull else -params.force_max, params.force_max)
    return push if params.left else -push


@render.register(FloatParams)
@compiled
def float_step(params, count, velocity):
    depth = _depth(params, count)
    if not (params.two_sided or depth > 0):
        return 0.0
    relative = velocity - params.velocity
    inward = -relative if params.left else relative
    push = params.stiffness * depth + params.damping * inward
    if params.forbid_pull:
        push = max(push, 0.0)
    return push if params.left else -push


@by_type
def acts(params, count):
    """Return whether the force at a position may be positive, and whether it may be negative; neither in free space.

    A wall without a spring and a damper is free space.

    Args:
        params, count: as of `render`.
    """


@compiled
def _acts(params, count):
    inside = (params.two_sided or _depth(params, count) > 0) and (params.stiffness != 0 or params.damping != 0)
    return int(inside and (params.left or not params.forbid_pull)), int(inside and not params.left * params.forbid_pull)


acts.register(Params)(_acts)
acts.register(FloatParams)(_acts)


@by_type
def moved(params, position, velocity):
    """Return the parameters with the words `wall_position` and `wall_velocity` changed.

    Args:
        params: `Params` or `FloatParams` of a coupling.
        position, velocity: the words.
    """


@moved.register(Params)
@compiled
def word_moved(params, position, velocity):
    return Params(
        params.stiffness,
        params.damping,
        position,
        params.left,
        params.forbid_pull,
        velocity,
        params.two_sided,
        params.velocity_shift,
        params.spring_shift,
        params.damper_shift,
        params.surface_shift,
        params.push_shift,
        params.force_max,
    )


@moved.register(FloatParams)
@compiled
def float_moved(params, position, velocity):
    return FloatParams(
        params.stiffness,
        params.damping,
        position,
        params.left,
        params.forbid_pull,
        velocity * params.velocity_lsb,
        params.two_sided,
        params.velocity_lsb,
    )
