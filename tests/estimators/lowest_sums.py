"""Rows that lead the Kalman filter's acceleration, by the model, to a sum an LSB beyond its lowest."""

from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.kalman import START, Design, State

BRINKS = {"mhz": (3, 47911, 8782)}
"""For how many rows the lead waits, and the gains of velocity and then of position: those that end it where it must."""


def brink(d: Design, wait: int, velocity: int, position: int) -> tuple[list[tuple[int, ...]], list[tuple[State, int]]]:
    """Return rows that lead the acceleration, by the model, to its lowest, and the states and flags from the start on.

    There it comes to the one sum that is an LSB beyond the range, and then stays. That comes by no chance: the lead
    must be within what the least gain makes an LSB of, above 0 and a sample later below.
    """
    one, half = 1 << d.lead.f, 1 << (d.count_width - 1)
    rows, seen, count = [], [(START, 0)], 0

    def lead(goal: int, *words: int) -> None:
        """Add a row that brings the lead to the goal or up to a count more, as far as a step may."""
        nonlocal count
        state, _ = seen[-1]
        onward = (2 * state.v + (state.a >> (d.a.f - d.v.f))) >> (d.v.f - d.lead.f + 1)
        moved = (state.lead + onward - goal * one) >> d.lead.f
        count += max(-d.step_max, min(d.step_max, moved))
        count = (count + half) % (2 * half) - half
        rows.append((count, int(not rows), *words))
        params = d.params(dict(zip((word.name for word in d.words), words, strict=True)))
        state, _, flags = estimate(params, state, seen_count(count), rows[-1][1])
        seen.append((state, flags))

    while seen[-1][0].a != -d.a.max:
        lead(2 * half, 0, 0, d.words[2].format.max)
    while seen[-1][0].lead > 100 * one:
        lead(0, 0, 0, 1)
    for _ in range(wait):
        lead(100, 0, velocity, 1)
    while seen[-1][0].lead > 30 * one:
        lead(0, 0, velocity, 1)
    lead(0, position, 0, 1)
    while seen[-1][0].lead > one:
        lead(0, 0, 0, 1)
    lead(0, 0, 0, 1)
    return rows, seen
