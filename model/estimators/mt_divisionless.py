"""The M/T method without a divider: `mt` bit for bit, with one reciprocal by multiplications, in fixed point.

    v = c N / S, or 3 c / 2 A if that is less       by 2 N A > 3 S, so that one of the two quotients is made
    the reciprocal of the time by a table and a step of Newton's method, the quotient by its corrections

`hardwall.model.arithmetic.divisionless` has the arithmetic and derives its bounds.

As in `mt`, N and S are the counts and clocks between two edges a window apart. A is the age of the last edge. Window,
formats, start, standstill, restart and saturation are the same. The kernels are in `kept_edges`. The corrections end in
the exact quotient, rounded half up. So the bound on the reciprocal's error, 2**-10 of it, adds no error to v, and each
word equals the word of `mt`. The lesser of two quotients, each rounded, is the lesser quotient rounded.

What multiplying is for is time: a divider makes a bit a clock, a product DIGIT bits. It takes a larger multiplier, and
more logic than a divider, which is small if it makes a bit a clock.

Sources: as of `mt`. The idea is from Sensors 2018, 18(10), 3250 and Electronics 2019, 8(3), 361: an M/T method without
a divider, in which multiplications correct the reciprocal of the time. Only their abstracts were read: the arithmetic
here is this project's, and no figure is theirs.
"""

from ..arithmetic.divisionless import latency as quotient_latency
from . import kept_edges
from .kept_edges import KeptDesign

STEPS = kept_edges.LATENCY + 4
"""Clocks of the sequence besides the quotient."""


class Design(KeptDesign):
    """Formats and latency for an axis, derived as `kept_edges` says."""

    name = "mt-divisionless"

    @property
    def latency(self) -> int:
        bits = self.velocity.width - 1
        return STEPS + quotient_latency(self.stamp_width + 1, bits, self.edges_max.bit_length())
