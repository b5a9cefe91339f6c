"""A watch over the times of cycles: whether an encoder emits its edges in bursts, which no cycle can time.

Some interpolators emit their edges on a clock of their own, several at once. The time of a cycle within a burst, or
across the silence between two bursts, says little of the speed. The watch tells such an encoder from others:

    a silence     the age of the last edge at the last sample before the next edge
    an event      a silence of more than SILENCE_COUNTS at the speed of m cycles in D clocks that contain it, in one
                  direction: 4 m silence > SILENCE_COUNTS D
    bursts        EVENTS events, each within the time of `doubt_samples` after the one before; until no event comes for
                  that time

At a constant speed two edges of any scale that the decoder takes are less than 2 counts apart, so that misplaced edges
are no event. An axis that stops and goes on makes one. Every estimator that bounds the speed by silence takes
`doubt_samples` for the time in which silence is no evidence.

The watch forgets everything while no edge is known.
"""

from typing import NamedTuple

from ..compiled import compiled
from ..requirements import AxisRequirements

SILENCE_COUNTS = 2.25
"""Counts of a silence that misplaced edges do not explain."""
EVENTS = 3
"""Events that are bursts."""
DOUBT_S, DOUBT_SAMPLES = 1e-3, 16
"""How long the evidence of a burst is remembered: so long, and at least so many samples."""
LATENCY = 3
"""Clocks from the times of a sample to the result: see `hardwall.hdl.estimators.bursts`."""


class Watch(NamedTuple):
    """The state: the last age, the longest silence that no event has used, events so far, and samples left for more."""

    quiet: int
    silence: int
    events: int
    left: int


NOTHING = Watch(0, 0, 0, 0)


def doubt_samples(axis: AxisRequirements) -> int:
    """Return for how many samples the evidence of a burst is remembered."""
    return max(round(DOUBT_S * axis.sample_hz), DOUBT_SAMPLES)


@compiled
def watch(params, state, times):
    """Take the `cycle_times.Times` of a sample: return (state, whether edges come in bursts).

    `params` may be any tuple with `cycles_max` and `doubt`.
    """
    if times.age == 0:
        return Watch(0, 0, 0, 0), 0
    silence, left = state.silence, max(state.left - 1, 0)
    events = state.events if left else 0
    if times.news:
        silence = max(silence, state.quiet)
        if times.cycles:
            if silence > times.cycle:
                silence = 0
            elif 16 * min(times.cycles, params.cycles_max) * silence > 9 * times.cycle:
                silence, events, left = 0, min(events + 1, EVENTS), params.doubt
    return Watch(times.age, silence, events, left), int(events == EVENTS)
