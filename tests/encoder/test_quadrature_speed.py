"""The quadrature decoder's model at any speed: the count is exact, or a flag rises."""

import math

import numpy as np
import pytest

from hardwall.model.arithmetic.fixed import wrap
from hardwall.model.encoder.quadrature import NO_STROBES, START, Inputs, Params, advance, step
from hardwall.model.encoder.quadrature_speed import clocks_to_fault, glitch_clocks_for, max_edge_rate
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import rng


def test_max_edge_rate():
    assert [max_edge_rate(60e6, length) for length in (0, 1, 2, 3, 15)] == [60e6, 60e6, 40e6, 30e6, 7.5e6]
    assert [max_edge_rate(1.0, length, 0.25) for length in (0, 1, 2, 3)] == [0.5, 0.5, 0.5, 0.375]
    with pytest.raises(ValueError, match=r"not 0\.5$"):
        max_edge_rate(1.0, 0, 0.5)


# Steady motion. Positions are integers of 2**-32 counts, so that the true count is exact.

ONE = 1 << 32


@compiled
def turn(params, glitch_clocks, rate, places, clocks):
    """Turn steadily; return the clocks of the first wrong count and of the first flag, or `clocks` if there is none.

    Args:
        places: the positions where A rises, B rises, A falls and B falls in a cycle of 4 counts.
    """
    state = START
    delay = glitch_clocks + 3
    true = np.zeros(clocks, np.int64)
    wrong = fault = clocks
    for clock in range(clocks):
        position = rate * clock
        for place in places:
            true[clock] += (position - place) >> 34
        a = int((position - places[0]) % (4 * ONE) < places[2] - places[0])
        b = int((position - places[1]) % (4 * ONE) < places[3] - places[1])
        state = step(params, state, Inputs(a, b, 0, glitch_clocks, 0), NO_STROBES)
        if clock >= delay and state.count != wrap(true[clock - delay] - true[0], params.count_width):
            wrong = min(wrong, clock)
        if state.illegal | state.overspeed:
            fault = min(fault, clock)
        if max(wrong, fault) < clocks:
            break
    return wrong, fault


def edge_rates(glitch_clocks: int, edge_error: float) -> np.ndarray:
    """Return rates up to 4 edges a clock: at the limits, close to them, simple fractions, and random rates between."""
    limits = [max_edge_rate(1.0, glitch_clocks, error) for error in (0.0, edge_error)]
    limits += [4 - limits[0], 2 - 2 * edge_error]
    near = [limit * (1 + way * 10.0**-k) for limit in limits for way in (1, -1) for k in range(1, 5)]
    simple = [1 / 4, 1 / 3, 1 / 2, 2 / 3, 3 / 4, 1, 4 / 3, 3 / 2, 2, 5 / 2, 3, math.sqrt(2), math.e, math.pi]
    rates = np.array([*limits, *near, *simple, *np.exp(rng().uniform(math.log(0.01), math.log(4), 40))])
    return np.floor(rates[rates < 4] * ONE).astype(np.int64)


@pytest.mark.parametrize("glitch_clocks", range(16))
@pytest.mark.parametrize("edge_error", [0.0, 0.1, 0.3, 0.49])
def test_steady_motion_is_exact_or_flagged(glitch_clocks, edge_error):
    generator = rng()
    ideal, exact = (int(max_edge_rate(1.0, glitch_clocks, error) * ONE) for error in (0.0, edge_error))
    flagged = 0
    for rate in edge_rates(glitch_clocks, edge_error):
        bound = clocks_to_fault(rate / ONE, glitch_clocks)
        clocks = 4000 if math.isinf(bound) else min(bound, 50_000)
        for way in (1, -1):
            errors = edge_error * generator.choice([-1.0, 1.0, generator.uniform(-1, 1)], 4)
            places = ((np.arange(4) + errors + generator.uniform(0, 4)) * ONE).astype(np.int64)
            wrong, fault = turn(Params(32, 8, 8), glitch_clocks, way * rate, places, clocks)
            slow_record = 4 * ONE - rate <= ideal and edge_error == 0
            if rate <= exact:
                assert wrong == fault == clocks, rate / ONE
            elif slow_record:
                assert wrong < fault == clocks, rate / ONE
            elif rate <= (2 - 2 * edge_error) * ONE:
                assert fault <= wrong, rate / ONE
            if clocks == bound and (rate <= (2 - 2 * edge_error) * ONE or edge_error == 0):
                assert fault < bound, rate / ONE
                flagged += 1
    assert flagged >= 10


# Any motion.


@compiled
def motion(before, now):
    """Return the counts between two samples of A and B; 0 where both differ."""
    change = before ^ now
    return ((change ^ change >> 1) & 1) * (2 * ((now ^ before >> 1) & 1) - 1)


@compiled
def explore(shortest, longest, memory):
    """Try all pins A and B and all limits from `shortest` to `longest` at every clock, until a flag rises.

    Return three numbers: the different states met; the states from which the pins could rest without a flag while the
    count is wrong or a jump is missed; and the states in which the count is no position within the time that it may
    lag. A state is the state of the decoder, the pins of the last `memory` clocks, and the error of the count.
    """
    params = Params(4, 1, 1)
    met = {np.int64(-1)}
    todo = [
        (advance(params, START, Inputs(pins & 1, pins >> 1, 0, 0, 0), 100), pins * (((1 << 2 * memory) - 1) // 3), 0, 0)
        for pins in range(4)
    ]
    wrong = late = 0
    while len(todo) > 0:
        state, history, position, jumped = todo.pop()
        now = history & 3
        if memory > 2 * longest + 4:
            known = False
            past = position
            for back in range(2 * longest + 4):
                known |= back >= shortest + 3 and state.count == wrap(past, 4)
                past -= motion(history >> 2 * back + 2 & 3, history >> 2 * back & 3)
            late += not known
        for glitch_clocks in range(shortest, longest + 1):
            rest = advance(params, state, Inputs(now & 1, now >> 1, 0, glitch_clocks, 0), longest + 4)
            wrong += (rest.illegal | rest.overspeed) == 0 and (jumped > 0 or rest.count != wrap(position, 4))
            for pins in range(4):
                after = step(params, state, Inputs(pins & 1, pins >> 1, 0, glitch_clocks, 0), NO_STROBES)
                if after.illegal | after.overspeed:
                    continue
                where = position + motion(now, pins)
                seen = (history << 2 | pins) & ((1 << 2 * memory) - 1)
                lost = jumped | int(now ^ pins == 3)
                key = seen << 4 | (where - after.count) & 15
                for part in (after.level, after.moved, after.up, after.pending, after.crossed, lost):
                    key = key << 2 | part
                key = key << 8 | after.held_a << 4 | after.held_b
                if key not in met:
                    met.add(key)
                    todo.append((after, seen, where, lost))
    return len(met) - 1, wrong, late


@pytest.mark.parametrize(
    ("shortest", "longest", "memory", "at_least"),
    [(0, 0, 5, 700), (1, 1, 7, 6_000), (2, 2, 9, 50_000), (3, 3, 11, 400_000), (0, 2, 9, 200_000), (0, 15, 3, 10_000)],
)
def test_no_record_of_the_pins_loses_a_count_without_a_flag(shortest, longest, memory, at_least):
    met, wrong, late = explore(shortest, longest, memory)
    assert (wrong, late) == (0, 0)
    assert met > at_least


@pytest.mark.parametrize(
    ("edges_per_clock", "edge_error", "expected"),
    [
        (1.0, 0.0, 0),
        (0.5, 0.0, 1),
        (1 / 6, 0.0, 5),
        (1 / 6, 0.25, 3),
        (1 / 16, 0.0, 15),
        (1e-9, 0.49, 15),
        (0.2, 0.4, 2),
    ],
)
def test_the_default_filter_is_the_longest_for_twice_the_speed(edges_per_clock, edge_error, expected):
    assert glitch_clocks_for(edges_per_clock, edge_error) == expected
