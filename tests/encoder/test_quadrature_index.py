"""The index: one edge of Z's pulse is one place, from whichever side, whatever the handle does about it.

The encoder here is exact: positions are fractions of a count, and every level is that of a position.
"""

from fractions import Fraction
from itertools import product
from math import floor

import numpy as np
import pytest

from hardwall.model.encoder import quadrature
from hardwall.model.encoder.quadrature import Inputs, Params, State, Strobes
from hardwall.testing import rng
from stimuli.lengths import LONG

PARAMS = Params(16, 8, 8)
PARTS = 16
"""Places in a count. A handle is at an odd one, moves by two, and Z changes at multiples of four."""
EDGES = range(0, 4 * PARTS, 4)
WIDTHS = range(4, 6 * PARTS + 1, 4)
SHAPES = list(product(EDGES[::3], WIDTHS))
"""Where Z rises, and how wide its pulse is."""


def run(
    places: np.ndarray, z: np.ndarray, invert: int, glitch_clocks: int, holds: np.ndarray, strobes: Strobes
) -> State:
    """Return the states at every clock of handles in cells of `places` (lane, move), each held for some clocks."""
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
    return np.where(states.indexed, states.count + np.where(states.down, 1, -1), -9999)


def lagging(places: np.ndarray, by: int) -> np.ndarray:
    """Return what a part with a hysteresis sees of places (lane, move): it follows a handle that goes on by `by`."""
    seen = np.empty_like(places)
    seen[:, 0] = places[:, 0]
    for move in range(1, places.shape[1]):
        seen[:, move] = np.clip(seen[:, move - 1], places[:, move] - by, places[:, move] + by)
    return seen


def wandering(lanes: int, moves: int) -> np.ndarray:
    """Return places (lane, move) of handles that begin anywhere, keep their way for a while, and tremble."""
    random, span = rng(), 10 * PARTS
    ways = np.repeat(random.choice([-1, 1], (lanes, moves)), random.integers(1, 30, moves), axis=1)[:, :moves]
    began = random.integers(-PARTS, 8 * PARTS, (lanes, 1)) // 2 * 2 + 1
    places = began + 2 * np.cumsum(ways, axis=1)
    return np.abs((places + span) % (2 * span) - span) // 2 * 2 + 1 - PARTS


@pytest.mark.parametrize(
    ("lag", "lag_z", "late", "off"),
    [
        # Hysteresis of A and B, and of Z, in parts of a count, and clocks by which Z is late. How far it may be off.
        pytest.param(0, 0, 0, 0, id="exact"),
        pytest.param(5, 5, 0, 0, id="one hysteresis"),
        pytest.param(7, 0, 0, 1, id="hysteresis of A and B"),
        pytest.param(0, 7, 0, 1, id="hysteresis of Z"),
        pytest.param(0, 0, 2, 1, id="Z is late"),
        pytest.param(0, 0, -2, 1, id="Z is early"),
        pytest.param(7, 2, 2, 1, id="all"),
    ],
)
@pytest.mark.parametrize(("invert", "glitch_clocks"), list(product([0, 1], [0, 1, 4])) if LONG else [(0, 4), (1, 0)])
def test_every_index_is_at_one_edge_of_the_pulse(invert, glitch_clocks, lag, lag_z, late, off):
    """Handles tremble, turn round within a count, and begin anywhere, on the pulse too."""
    random, moves = rng(), 1500
    rises = np.array([rise for rise, _ in SHAPES])[:, None]
    falls = rises + np.array([width for _, width in SHAPES])[:, None]
    places = wandering(len(SHAPES), moves)
    holds = random.integers(glitch_clocks + 1, glitch_clocks + 4, moves)
    at_z = lagging(places, lag_z)
    z = np.repeat((rises <= at_z) & (at_z < falls), holds, axis=-1)
    if late:
        still = np.repeat(z[:, :1] if late > 0 else z[:, -1:], abs(late), axis=1)
        z = np.hstack([still, z[:, :-late]] if late > 0 else [z[:, -late:], still])
    seen = np.repeat(lagging(places, lag), holds, axis=-1)
    arm = (random.random(z.shape) < 0.01).astype(np.int64)
    states = run(seen, z, invert, glitch_clocks, np.ones(z.shape[1], int), Strobes(arm=arm))
    assert not states.illegal.any()
    assert not states.overspeed.any()
    found = indexes(states)
    for lane, (rise, width) in enumerate(SHAPES):
        first = seen[lane, 0] // PARTS
        wanted = place_of(rise, rise + width, invert) + (first if invert else -first)
        near = {*range(wanted - off, wanted + off + 1)}
        assert set(found[lane][states.indexed[lane] == 1]) <= near, (rise, width)
        assert set(states.index_count[lane][states.index_latched[lane] == 1]) <= near, (rise, width)
    # All but the narrowest pulses were met again and again.
    assert (states.indexed.sum(axis=1) > 3).mean() > 0.8
    assert (np.diff(states.index_latched, axis=1) > 0).any(axis=1).mean() > 0.7


@pytest.mark.parametrize("invert", [0, 1])
@pytest.mark.parametrize("glitch_clocks", [0, 3])
def test_a_pass_finds_the_index_once(glitch_clocks, invert):
    """From either side, unless the pulse is between two edges."""
    there = np.arange(-4 * PARTS + 1, 12 * PARTS, 2)
    there = there[::-1] if invert else there
    for rise, width in SHAPES:
        for way in (1, -1):
            places = there[::way]
            z = (rise <= places) & (places < rise + width)
            states = run(places, z, invert, glitch_clocks, np.full(len(places), glitch_clocks + 1), Strobes())
            # Z is looked at on the lower side of an edge.
            ends = (-rise - width, -rise) if invert else (rise, rise + width)
            edge_within = any(ends[0] < edge <= ends[1] for edge in range(-12 * PARTS, 12 * PARTS, PARTS))
            assert states.indexed.sum() == edge_within, (rise, width, way)


def test_a_handle_that_turns_round_within_a_count_takes_no_other_edge():
    """It comes from below, passes the falling edge of Z, and goes back over that within the count: Z rises there."""
    rises, falls = 4, 4 * PARTS + 8
    turn = 4 * PARTS + 11
    there = np.concatenate([np.arange(-PARTS + 1, turn + 1, 2), np.arange(turn, -3 * PARTS, -2)])
    states = run(there, (rises <= there) & (there < falls), 0, 0, np.ones(len(there), int), Strobes())
    assert indexes(states)[states.indexed == 1].tolist() == [1, 1]


def test_a_handle_that_turns_round_within_the_hysteresis_takes_no_other_edge():
    """It comes down past Z's other edge and an edge, and turns: Z changes at once, and A or B later."""
    # Down over Z's other edge and into cell 5, back over Z alone, and then with A or B.
    cells, z = np.repeat([7, 6, 6, 5, 5, 6], 9), np.repeat([0, 0, 1, 1, 0, 0], 9)
    states = run(cells * PARTS, z, 0, 0, np.ones(len(cells), int), Strobes())
    assert not states.indexed.any()


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
