"""A layered wall: a stiff core under a soft skin.

    depth = side (count - wall)              side = +1: the wall fills position > wall; -1: position < wall
    push  = K depth + B side velocity + K_core (depth - core_depth)

The first two terms act for depth > 0, the last for depth > core_depth. Every layer is a `wall`, with its formats and
its rounding; the layers' forces are added exactly and saturate at the largest magnitude of the force format. So fixed
point differs from the exact equation on the same words by at most two force LSB where neither layer saturates.

`core_depth` has the bits that hold the travel, rounded up to a power of two. So a handle anywhere in the travel is less
than half of the count's range away from the core, and a core never pushes in free space.
"""

from typing import NamedTuple

from .arithmetic.fixed import SQ, UQ, bits_for, saturate, wrap
from .axis import wall
from .axis.wall import render
from .runtime.compiled import compiled
from .words import Word

LATENCY = wall.LATENCY + 1
"""Clocks from strobe to valid: the clocks of a layer, and one for the sum."""


class Params(NamedTuple):
    """The two layers' parameters, and the largest force."""

    skin: wall.Params
    core: wall.Params
    force_max: int


class FloatParams(NamedTuple):
    """The two layers' parameters in float64."""

    skin: wall.FloatParams
    core: wall.FloatParams


class Design:
    """Formats and run-time words of the layered wall for an axis, with a velocity of format `velocity`.

    Attributes:
        layer: the `wall.Design` of either layer.
        words: the words of the wall, and `core_stiffness` and `core_depth`.
    """

    latency = LATENCY
    lead, interval = wall.Design.lead, wall.Design.interval

    def __init__(self, axis, velocity: SQ):
        self.layer = wall.Design(axis, velocity)
        self.count_width, self.velocity, self.force = self.layer.count_width, velocity, self.layer.force
        q, r = axis.count_m, axis.force_resolution_n
        self.words = (
            *self.layer.words,
            Word("core_stiffness", self.layer.stiffness, r / q, "N/m", 0, "spring of the wall's core"),
            Word("core_depth", UQ(bits_for(axis.travel_m / q), 0), q, "m", 0, "depth at which the core begins"),
        )

    def _core(self, words: dict[str, int]) -> dict[str, int]:
        """Return the core's run-time words by the names that a wall's words have."""
        inwards = -words["core_depth"] if words["wall_left"] else words["core_depth"]
        position = wrap(words["wall_position"] + inwards, self.count_width)
        return {**words, "wall_stiffness": words["core_stiffness"], "wall_damping": 0, "wall_position": position}

    def params(self, words: dict[str, int]) -> Params:
        """Return the kernel's parameters for the given run-time words."""
        return Params(self.layer.params(words), self.layer.params(self._core(words)), self.force.max)

    def float_params(self, stiffness_n_per_m: float, damping_n_s_per_m: float, words: dict[str, int]) -> FloatParams:
        """Return the float64 wall's parameters; the core's stiffness is taken from its word."""
        core_stiffness = next(word for word in self.words if word.name == "core_stiffness")
        core_n_per_m = core_stiffness.to_si(words["core_stiffness"])
        return FloatParams(
            self.layer.float_params(stiffness_n_per_m, damping_n_s_per_m, words),
            self.layer.float_params(core_n_per_m, 0.0, self._core(words)),
        )


@render.register(Params)
@compiled
def step(params, count, velocity):
    force = render(params.skin, count, velocity) + render(params.core, count, velocity)
    return saturate(force, -params.force_max, params.force_max)


@render.register(FloatParams)
@compiled
def float_step(params, count, velocity):
    return render(params.skin, count, velocity) + render(params.core, count, velocity)
