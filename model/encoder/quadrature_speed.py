"""The highest speeds of an encoder at which the decoder of `quadrature` counts every edge or raises a flag.

Let the rate be r edges a clock, of A and B together. Every level of A and of B then lasts 2/r clocks. An edge follows
the previous edge after 1/r clocks. A level is accepted if it is seen at glitch_clocks + 1 clocks; this is certain if it
lasts that many clocks. Two edges are seen separately and in order if they are at least one clock apart. Every accepted
edge has the same delay, so the count is exact for r <= 1 / max(1, (glitch_clocks + 1) / 2): `max_edge_rate`.

Beyond that rate the decoder makes the following promises. They hold for any motion, steady or not, in which every level
of A and of B lasts a clock or more (for ideal quadrature: below 2 edges a clock). They hold for any glitch lengths,
even if these change during the motion: *no count is wrong before a flag is up*. Every edge is then seen, and there are
three ways to lose one. Two edges accepted in one clock raise `illegal` in the clock in which they are not counted. A
pulse that the filter rejects, with an edge of the other channel between its two ends, raises `overspeed` at its end.
The edge within it is counted later. A rejected pulse without such an edge came and went at one level of the other
channel. The motion went there and back: no count is lost, and no flag rises. (A flag may thus rise with no count lost,
if noise on one channel meets an edge of the other.)

Quadrature sampled at r and at r - 4 edges a clock gives the same record. So no synchronous decoder can distinguish a
motion within `max_edge_rate` of a multiple of 4 edges a clock from a slow motion. At every other steady rate of ideal
quadrature a flag is up within `clocks_to_fault`.
"""

import math

GLITCH_CLOCKS_MAX = 15
"""The longest glitch filter: its word has four bits."""
SPEED_MARGIN = 2.0
"""The margin of `glitch_clocks_for` over the largest speed. Formats hold twice that speed, too. An encoder of unknown
errors may have levels that are shorter than ideal ones."""


def max_edge_rate(clock_hz: float, glitch_clocks: int, edge_error: float = 0.0) -> float:
    """Return the highest steady rate of edges, in Hz, at which the count is exact and no flag rises.

    `edge_error` is how far, in counts, the encoder's edges may be from their ideal places. It shortens the shortest
    level from 2 to 2 - 2 `edge_error` counts. It shortens the least distance of two edges from 1 to 1 - 2 `edge_error`
    counts.

    Raises:
        ValueError: if `edge_error` is not from 0 to less than 0.5.
    """
    if not 0 <= edge_error < 0.5:
        raise ValueError(f"edge_error must be from 0 to less than 0.5 counts, not {edge_error!r}")
    apart = 1 / (1 - 2 * edge_error)
    long = (glitch_clocks + 1) / (2 - 2 * edge_error)
    return clock_hz / max(apart, long)


def glitch_clocks_for(edges_per_clock: float, edge_error: float = 0.0) -> int:
    """Return the glitch filter for a largest rate of edges: the longest that leaves `SPEED_MARGIN` times it.

    The shortest level at that rate r lasts (2 - 2 `edge_error`) / r clocks and must be at least glitch_clocks + 1
    clocks long: see `max_edge_rate`. The result is 0 where not even one clock can be filtered, and otherwise at most
    `GLITCH_CLOCKS_MAX`. Pulses up to that length then change nothing. Without a filter, every pulse that a clock sees
    is counted forth and back: its stamps look like an encoder moving two edges in the length of the pulse.
    """
    level_clocks = (2 - 2 * edge_error) / (SPEED_MARGIN * edges_per_clock)
    # A level of a whole number of clocks may be computed a rounding short.
    return min(max(math.floor(level_clocks * (1 + 1e-12)) - 1, 0), GLITCH_CLOCKS_MAX)


def clocks_to_fault(edges_per_clock: float, glitch_clocks: int) -> float:
    """Return the number of clocks within which a flag is up at a steady rate; infinite if no flag is certain.

    The bound holds for ideal quadrature of any rate, and with edges out of place as long as every level lasts a clock
    or more. The record has rate s, the distance of `edges_per_clock` from the nearest multiple of 4. With a filter, m
    (even) successive levels of a channel last 2m/s clocks and hold fewer than 2m/s + 1 samples. So not all of them can
    be seen at glitch_clocks + 1 clocks once m >= 1 / (glitch_clocks + 1 - 2/s). A level under way at the start and a
    level out of place come before. Without a filter, m clocks hold more than ms - 2 edges, so some clock has two edges
    once m >= 2 / (s - 1). Two clocks in the synchroniser, one in the filter and one to decode follow.
    """
    rate = abs(edges_per_clock - 4 * round(edges_per_clock / 4))
    if rate <= max_edge_rate(1.0, glitch_clocks):
        return math.inf
    if glitch_clocks == 0:
        return math.ceil(2 / (rate - 1)) + 4
    levels = 2 * math.ceil(0.5 / (glitch_clocks + 1 - 2 / rate)) + 2
    return math.ceil(levels * 2 / rate) + 4
