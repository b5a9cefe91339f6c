"""What a rival sees: the same counts at the same samples as this project's estimators, and readings in time."""

import numpy as np
import pytest

from hardwall.model.stamped import Edges
from hardwall.sim.estimates import signals
from hardwall.sim.estimates.motions import Encoded, encoded, position
from hardwall.sim.estimates.rivals.hostmot2 import Hostmot2
from hardwall.sim.estimates.rivals.rival import Seen, estimates, seen_of
from hardwall.sim.world.encoder import Encoder, level, locate, offsets
from stimuli.rivals import every, read_at, steady

RATE, CLOCK_HZ = 2000, 50e6


@pytest.mark.parametrize("errors", [(0.0, 0.0, 0.0, 0.0), offsets(0.25, 0.1)])
@pytest.mark.parametrize("name", ["sweep", "flicker"])
def test_the_cell_after_the_edges_up_to_a_sample_is_the_cell_of_the_place(name, errors):
    signal, scale = signals.load(name), Encoder(1e-6, CLOCK_HZ, errors)
    found = encoded(signal.motion, scale, signal.seconds, signal.turns_apart_s, 0)
    seen = seen_of(found, CLOCK_HZ)
    times_s = np.arange(int(signal.seconds * RATE)) / RATE
    many = np.searchsorted(seen.times_s, times_s, side="right")
    numbers = np.concatenate([[seen.start], seen.numbers])[many]
    assert numbers.tolist() == [locate(scale, position(signal.motion, at_s)).number for at_s in times_s]
    assert len(seen.numbers) >= 100


def test_levels_are_counted_by_hand():
    """Two up, both pins at once, which counts nothing, and one down."""
    clocks = np.array([10, 20, 30, 40])
    levels = np.array([int(level(number)) for number in (8, 9, 7, 6)])
    seen = seen_of(Encoded(Edges(clocks, levels), int(level(7)), 7), 10.0)
    assert seen.start == 7
    assert seen.times_s.tolist() == [1.0, 2.0, 4.0]
    assert seen.numbers.tolist() == [8, 9, 8]


@pytest.mark.parametrize("period", [1, 7])
def test_a_run_reads_in_every_period_and_holds_between(period):
    edges = steady(0, 130.0, 1, 100)
    seen = Seen(0, np.array([at for at, _ in edges]), np.array([number for _, number in edges]))
    out = np.zeros(1001)
    estimates(Hostmot2(0.5), seen, 1000.0, period, out)
    read = read_at(Hostmot2(0.5), 0, edges, every(period * 1e-3, 1.0))
    assert out.tolist() == pytest.approx(np.repeat(read, period)[: len(out)].tolist())
    assert len({*out.tolist()}) > 2
