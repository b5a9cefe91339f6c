"""The kernels of Levant's differentiators of order 2 and 3, in fixed point and in float64, and their four designs.

Equations, formats and sources are in `levant_higher_design`. At the first sample every state is 0, and so is every
correction: the next state is the state of rest.
"""

from ..arithmetic import powers
from ..arithmetic.fixed import saturate, shift_floor, shift_round_half_up, wrap
from ..runtime.compiled import compiled
from .acceleration import acceleration_of
from .estimate import estimate
from .levant import sign_of
from .levant_higher_design import Design, FloatParams, JerkGains, Params, SnapGains, State


class Order2(Design):
    """Order 2, the equation of the paper of 2003."""

    name = "levant-2"
    gains_class = JerkGains
    order = 2


class Order3(Design):
    """Order 3, the equation of the paper of 2003."""

    name = "levant-3"
    gains_class = SnapGains
    order = 3


class Filtering2(Design):
    """Order 2 with filtering of order 1, the equation of the paper of 2020."""

    name = "levant-2-filtering"
    gains_class = JerkGains
    order, filtering = 2, 1


class Filtering3(Design):
    """Order 3 with filtering of order 1, the equation of the paper of 2020."""

    name = "levant-3-filtering"
    gains_class = SnapGains
    order, filtering = 3, 1


@compiled
def held(word, largest):
    """Return a word held within two's complement, whose largest word is given."""
    return saturate(word, -largest - 1, largest)


@compiled
def distance(params, state, seen):
    """Return (z0 less the count, the same within its format)."""
    far_gap = state.lead - (wrap(seen.count - state.count, params.count_width) << params.fractions[1])
    return far_gap, held(far_gap, params.limits[1])


@compiled
def advance(params, state, far_gap, gap, octaves):
    """Return ((w, lead, z1, z2, z3), velocity, flags) after a sample, at L raised by `octaves`."""
    f_w, f_0, f_1, f_2, f_3 = params.fractions
    most_w, _, most_1, most_2, most_3 = params.limits
    first = params.filtering

    error = state.w if first else gap
    size = ~error if error < 0 else error
    away = -sign_of(error)
    terms = params.powers

    # What Taylor's series adds, at the fraction of the state that it is added to.
    z1 = state.z1 - params.half
    half_2, half_3 = shift_round_half_up(state.z2, f_2 - f_1 + 1), shift_round_half_up(state.z3, f_3 - f_2 + 1)
    lead = gap + shift_round_half_up(z1 + half_2, f_1 - f_0) + away * powers.term(terms, first, size, octaves)
    more_1 = shift_round_half_up(state.z2 + half_3, f_2 - f_1)
    far_1 = state.z1 + more_1 + away * powers.term(terms, first + 1, size, octaves)
    relay = params.relays[octaves - params.least_octave]
    if params.order == 2:
        far_2, far_3 = state.z2 + away * relay, 0
    else:
        far_2 = (
            state.z2 + shift_round_half_up(state.z3, f_3 - f_2) + away * powers.term(terms, 2 + first, size, octaves)
        )
        far_3 = state.z3 + away * relay
    far_w = 0
    if first:
        far_w = state.w + shift_round_half_up(gap, f_0 - f_w) + away * powers.term(terms, 0, size, octaves)

    w, next_1, next_2, next_3 = held(far_w, most_w), held(far_1, most_1), held(far_2, most_2), held(far_3, most_3)
    flags = int(gap != far_gap or w != far_w) | int(next_1 != far_1) << 1 | int(next_2 != far_2 or next_3 != far_3) << 2
    if next_1 != far_1:
        next_2 = next_3 = 0
    return (w, lead, next_1, next_2, next_3), next_1 >> params.output_shift, flags


@estimate.register(Params)
@compiled
def step(params, state, seen, restart):
    if restart or not state.running:
        return State(1, seen.count, 0, 0, params.half, 0, 0), 0, 0
    far_gap, gap = distance(params, state, seen)
    moved, velocity, flags = advance(params, state, far_gap, gap, params.octaves)
    return State(1, seen.count, *moved), velocity, flags


@compiled
def float_advance(params, state, gap, share):
    """Return (w, lead, z1, z2, z3) after a sample, without a limit; L is raised by the power N + 1 of `share`."""
    first, gains = params.filtering, params.gains
    error = state.w if first else gap
    away, degree = -sign_of(error), params.order + first + 1
    root = abs(error) ** (1 / degree)

    def term(n):
        return away * gains[n] * share ** (n + 1) * root ** (degree - 1 - n)

    lead = gap + state.z1 + state.z2 / 2 + term(first)
    z1 = state.z1 + state.z2 + state.z3 / 2 + term(first + 1)
    z2 = state.z2 + state.z3 + term(first + 2)
    z3 = state.z3 + term(degree - 1) if params.order == 3 else 0.0
    w = state.w + gap + term(0) if first else 0.0
    return w, lead, z1, z2, z3


@estimate.register(FloatParams)
@compiled
def float_step(params, state, seen, restart):
    """Take one sample by the published algorithm in float64, unsaturated: the reference for the cost of fixed point."""
    if restart or not state.running:
        return State(1, seen.count, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0
    gap = state.lead - wrap(seen.count - state.count, params.count_width)
    moved = float_advance(params, state, gap, 1.0)
    return State(1, seen.count, *moved), moved[2], 0


@acceleration_of.register(Params)
@compiled
def acceleration(params, state):
    return shift_floor(state.z2, params.acceleration_shift)


@acceleration_of.register(FloatParams)
@compiled
def float_acceleration(params, state):
    return state.z2
