"""The M/T method: whole counts between two edges that are a window apart, over the time between them, in fixed point.

With c clocks a sample, and for the last edge its number N on the scale and its stamp S, in clocks:

    v = c (N - N') / (S - S')       N', S': the last edge that was known half a window to a whole one ago
    bound |v| <= 3 c / 2 A          the last edge was A ago, and the next is at most 1.5 counts from it

The classical method counts the edges of a sample (M). It times them (T) from the last edge before the sample to the
last edge in it. So counts and time belong together and neither has a fraction. Here samples may be much shorter than
the window. Two edges are kept: every half window, of `half` samples, the newer one becomes the older one and the last
edge becomes the newer one. v is made anew in every sample, over half a window to a whole one. If no edge came it is
over longer, as in the method. While the older edge is the last one, v is held within the bound. Before there are two
edges v = 0.

N is the number of the edge itself, `count + down`, not the count. After a turn the same edge has the same number. So v
is the mean velocity between two instants of known position, whatever the direction. It has the edges' errors in full,
because any two edges may be of different kinds: what repeats every four edges, `period` is immune to.

Guarantee. Let |f''| <= C counts/sample^2, and each edge be displaced by at most p counts. Then v over W samples is off
by at most C W / 2 from acceleration and 2 p / W from the edges. For W between `half` and twice that, the sum is at most
C half + 2 p / half, least at half = sqrt(2 p / C): `window_s`, a whole window, is 2 sqrt(2 p q / C). p is the axis's
`edge_error_max_counts`, q a count. A clock of error in a stamp adds v / W clocks, one part in thousands.

Sources: T. Ohmae, T. Matsuda, K. Kamiyama, M. Tachikawa, A Microprocessor-Controlled High-Accuracy Wide-Range Speed
Regulator for Motor Drives, IEEE Transactions on Industrial Electronics, 1982: the M/T method. The two kept edges, and
the rule for the window, are this project's.

`kept_edges` derives the formats, and has the kernels.

At standstill v = 0, exactly, once the last edge is forgotten, or earlier if the bound is less than half an LSB. The
velocity saturates at its format's largest word, with either sign, and the flag `velocity_saturated`. Count and stamps
may wrap. The first sample, and a sample with a restart, forget the past; an edge is known once one came since.
"""

from ..arithmetic.divide import latency as divide_latency
from . import kept_edges
from .kept_edges import KeptDesign

STEPS = kept_edges.LATENCY + 4
"""Clocks of the sequence besides the division."""


class Design(KeptDesign):
    """Formats and latency for an axis, derived as `kept_edges` says."""

    name = "mt"

    @property
    def latency(self) -> int:
        return STEPS + divide_latency(self.velocity.width)
