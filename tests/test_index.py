"""The index: one edge of Z's pulse is one place, from whichever side, whatever the handle does about it.

The encoder here is exact: positions are fractions of a count, and every level is that of a position.
"""

from fractions import Fraction
from itertools import product
from math import floor

import numpy as np
import pytest

from hardwall.model import quadrature
from hardwall.model.quadrature import Inputs, Params, State, Strobes
from hardwall.testing import rng

PARAMS = Params(16, 8, 8)
PARTS = 16
"""Places in a count. A handle is at an odd one, moves by two, and Z changes at multiples of four."""
EDGES = range(0, 4 * PARTS, 4)
WIDTHS = range(4, 6 * PARTS + 1, 4)
ORIGIN = 64
"""The count at which a turn of the walks begins."""


def run(
    places: np.ndarray, z: np.ndarray, invert: int, glitch_clocks: int, holds: np.ndarray, strobes: Strobes
) -> State:
    """Return the states at every clock of handles that are at places (lane, move), each held for some clocks."""
    cell = places // PARTS
    levels = ((cell + 3) % 4 < 2, (cell + 2) % 4 < 2, z)
    a, b, z = (np.repeat(level, holds, axis=-1).astype(np.int64) for level in levels)
    return quadrature.run(PARAMS, Inputs(a, b, z, glitch_clocks, invert), strobes)


def place_of(rises: int, falls: int, invert: int) -> int:
    """Return the count of the one edge at which Z rises as the count goes up, if a count is 0 in cell 0.

    A count that is inverted goes up as the handle goes down, where Z rises at the other end of its pulse.
    """
    return floor(1 - Fraction(falls, PARTS)) if invert else floor(Fraction(rises, PARTS))


def indexes(states: State) -> np.ndarray:
    """Return the place of the index at every clock with one, elsewhere -9999, as the monitors take it."""
    return np.where(states.indexed, states.count + (states.stepped & states.down), -9999)


@pytest.mark.parametrize("glitch_clocks", [0, 1, 4])
@pytest.mark.parametrize("invert", [0, 1])
def test_every_index_is_at_one_edge_of_the_pulse(invert, glitch_clocks):
    """Handles tremble, turn round within a count, and begin anywhere, on the pulse too."""
    random, moves = rng(), 1500
    shapes = list(product(EDGES, WIDTHS))
    rises = np.array([rise for rise, _ in shapes])[:, None]
    falls = rises + np.array([width for _, width in shapes])[:, None]
    # A way that is kept for a while, and places near the pulse.
    ways = np.repeat(random.choice([-1, 1], (len(shapes), moves)), random.integers(1, 30, moves), axis=1)[:, :moves]
    began = random.integers(-PARTS, 8 * PARTS, (len(shapes), 1)) // 2 * 2 + 1
    places = began + 2 * np.cumsum(ways, axis=1)
    span = 10 * PARTS
    places = np.abs((places + span) % (2 * span) - span) // 2 * 2 + 1 - PARTS
    holds = random.integers(glitch_clocks + 1, glitch_clocks + 4, moves)
    z = (rises <= places) & (places < falls)
    clocks = holds.sum()
    arm = (random.random((len(shapes), clocks)) < 0.01).astype(np.int64)
    states = run(places, z, invert, glitch_clocks, holds, Strobes(arm=arm))
    assert not states.illegal.any()
    assert not states.overspeed.any()
    found = indexes(states)
    for lane, (rise, width) in enumerate(shapes):
        first = places[lane, 0] // PARTS
        wanted = place_of(rise, rise + width, invert) + (first if invert else -first)
        assert set(found[lane][states.indexed[lane] == 1]) <= {wanted}, (rise, width)
        assert set(states.index_count[lane][states.index_latched[lane] == 1]) <= {wanted}, (rise, width)
    # All but the narrowest pulses were met again and again.
    assert (states.indexed.sum(axis=1) > 3).mean() > 0.9
    assert (np.diff(states.index_latched, axis=1) > 0).any(axis=1).mean() > 0.8


@pytest.mark.parametrize("invert", [0, 1])
@pytest.mark.parametrize("glitch_clocks", [0, 3])
def test_a_pass_finds_the_index_once(glitch_clocks, invert):
    """Upwards always; downwards unless the pulse is within one count."""
    there = np.arange(-4 * PARTS + 1, 12 * PARTS, 2)
    there = there[::-1] if invert else there
    for rise, width in product(EDGES, WIDTHS):
        for way in (1, -1):
            places = there[::way]
            z = (rise <= places) & (places < rise + width)
            holds = np.full(len(places), glitch_clocks + 1)
            places, holds = np.append(places, [places[-1]] * 9), np.append(holds, [glitch_clocks + 1] * 9)
            z = np.append(z, [False] * 9)
            states = run(places, z, invert, glitch_clocks, holds, Strobes())
            ends = (-rise - width, -rise) if invert else (rise, rise + width)
            edge_within = any(ends[0] <= edge < ends[1] for edge in range(-12 * PARTS, 12 * PARTS, PARTS))
            assert states.indexed.sum() == (way == 1 or edge_within), (rise, width, way)


def test_a_handle_that_turns_round_within_a_count_takes_no_other_edge():
    """It comes from below, passes the falling edge of Z, and goes back over that within the count: Z rises there."""
    rises, falls = 4, 4 * PARTS + 8
    turn = 4 * PARTS + 11
    there = np.concatenate([np.arange(-PARTS + 1, turn + 1, 2), np.arange(turn, -PARTS, -2), [1 - PARTS] * 9])
    states = run(there, (rises <= there) & (there < falls), 0, 0, np.ones(len(there), int), Strobes())
    assert indexes(states)[states.indexed == 1].tolist() == [1, 1]


def test_a_start_on_the_pulse_is_no_index():
    for place in range(-PARTS + 1, 6 * PARTS, 2):
        there = np.full(60, place)
        z = np.full(60, 1)
        assert not run(there, z, 0, 0, np.ones(60, int), Strobes()).indexed.any()


SLIPS = ("illegal", "overspeed", "invert", "slip", "edge beyond the range", "shift beyond the range")


@pytest.mark.parametrize("what", [*SLIPS, "preload", "arm"])
def test_a_reference_falls_with_what_destroys_it(what):
    """At the very clock, and a shift by the index that was does not set it again."""
    clocks, homes, when = 60, 20, 30
    beyond = what == "edge beyond the range"
    params = Params(5, 8, 8)
    # Up by a count at clock 4, over the index at the next, and there until another edge at the last clock but some.
    place = np.minimum(np.arange(clocks), 6) + (np.arange(clocks) >= when - 3) * (beyond or 0)
    places = np.where(np.arange(clocks) < 4, 0, place - 3)
    a, b = ((places + 3) % 4 < 2).astype(int), ((places + 2) % 4 < 2).astype(int)
    z, invert, glitch = (places >= 2).astype(int), np.zeros(clocks, int), 0
    at = {name: np.zeros(clocks, int) for name in Strobes._fields}
    at["arm"][1], at["origin_shift"][homes] = 1, 1
    # The count is at the end of its range behind the shift, or in its middle.
    at["preload_count"][:] = 12 if beyond else 0
    if what == "illegal":
        a[when - 3 :] ^= 1
        b[when - 3 :] ^= 1
    elif what == "overspeed":
        glitch = np.where(np.arange(clocks) > homes, 3, 0)
        a[when - 4 : when - 2] ^= 1
        b[when - 3 :] ^= 1
    elif what == "invert":
        invert[when:] = 1
    elif what == "shift beyond the range":
        at["origin_shift"][when], at["preload_count"][when] = 1, 15
    elif not beyond:
        at[what][when] = 1
    again = when + 15
    at["origin_shift"][again], at["preload_count"][again] = 1, 0
    states = quadrature.run(params, Inputs(a, b, z, glitch, invert), Strobes(**at))
    assert states.referenced[homes : when + 1].tolist() == [1] * (when - homes) + [0]
    assert states.index_latched[homes : when + 1].tolist() == [1] * (when - homes) + [0]
    flags = {"illegal": states.illegal, "overspeed": states.overspeed}
    flags |= dict.fromkeys(SLIPS[-2:], states.wrapped)
    for name, flag in flags.items():
        assert flag[when] == (what == name or flag is flags.get(what)), name
    assert not states.referenced[when:].any()
