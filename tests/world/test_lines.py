"""What the lines of an encoder do in time: jitter, glitches and dead channels, counted at the pins."""

import math
from fractions import Fraction

import numpy as np
import pytest
import scipy

from hardwall.model.stamped import Edges
from hardwall.sim.estimates import motions
from hardwall.sim.world.advance import Interval
from hardwall.sim.world.encoder import Encoder
from hardwall.sim.world.lines import A, B, Lines, carried, carry, waiting

NEVER = math.inf
QUIET = Lines(0.0, 0.0, 0.0, 0.0, 0.0, NEVER, 0.0, NEVER, NEVER, 1)
NS = 1e9
"""A clock that resolves times of a nanosecond."""
NO_EDGES = Edges(np.zeros(0, np.int64), np.zeros(0, np.int64))


def jittering(sigma_s: float, seed: int = 1) -> Lines:
    return QUIET._replace(jitter_s=sigma_s, late_s=4 * sigma_s, seed=seed)


def moving(lines: Lines | None, speed=0.1, seconds=0.1, clock_hz=NS) -> motions.Encoded:
    """Return the edges of a handle that moves steadily upwards, in counts of 1 um."""
    return motions.encoded(motions.Steady(speed, 0.3e-6), Encoder(1e-6, clock_hz, lines=lines), seconds, 1e-3, 0)


def toggles(edges: Edges, level: int) -> np.ndarray:
    """Return the lines that change at each edge; fail if it is not one."""
    changed = edges.levels ^ np.concatenate([[level], edges.levels])[:-1]
    assert set(changed.tolist()) <= {A, B}
    return changed


def counted(edges: Edges, level: int) -> np.ndarray:
    """Return the count after each edge, by the order of the levels."""
    order = [0b00, 0b01, 0b11, 0b10]
    places = np.array([order.index(word) for word in [level, *edges.levels.tolist()]])
    change = np.diff(places) % 4
    assert set(change.tolist()) <= {1, 3}
    return np.cumsum(np.where(change == 1, 1, -1))


@pytest.mark.parametrize("sigma_s", [50e-9, 400e-9])
def test_edges_jitter_normally_by_sigma_and_none_comes_before_its_time(sigma_s):
    plain, shown = moving(None), moving(jittering(sigma_s))
    late_s = (shown.edges.clocks - plain.edges.clocks) / NS
    assert len(late_s) > 9000
    assert late_s.min() >= -1 / NS
    assert late_s.max() <= 8 * sigma_s + 1 / NS
    drawn = late_s / sigma_s - 4
    assert drawn.std() == pytest.approx(1, rel=0.03)
    assert abs(drawn.mean()) < 0.05
    assert scipy.stats.kstest(drawn, "norm").pvalue > 1e-3
    assert (shown.edges.levels == plain.edges.levels).all()


def test_jitter_is_less_than_a_clock_too():
    """A tenth of a clock of jitter moves a part of the stamps by one clock, as often as the edges are that close."""
    clock_hz, sigma_s = 1e6, 1e-7
    plain, shown = (moving(lines, 0.0123, 0.5, clock_hz) for lines in (None, jittering(sigma_s)))
    moved = shown.edges.clocks - plain.edges.clocks
    # The mean lateness is 0.4 clocks, on edges that are anywhere between two clocks.
    assert set(moved.tolist()) == {0, 1}
    assert moved.mean() == pytest.approx(0.4, abs=0.03)


def test_edges_that_overtake_each_other_are_shown_in_order_and_none_is_lost():
    """1 m/s passes an edge a microsecond, with as much jitter."""
    shown = moving(jittering(1e-6), 1.0, 0.02)
    assert (np.diff(shown.edges.clocks) >= 0).all()
    changed = toggles(shown.edges, shown.start_level)
    assert (changed == A).sum() == (changed == B).sum() == 10_000
    assert shown.edges.levels[-1] == moving(None, 1.0, 0.02).edges.levels[-1]


def emitting(period_s: float, separation_s: float, phase: float = 0.0) -> Lines:
    return QUIET._replace(emission_s=period_s, emission_phase=phase, separation_s=separation_s)


@pytest.mark.parametrize("speed", [0.02, 0.15, -0.15, 1.0, 1.9])
@pytest.mark.parametrize("phase", [0.0, 0.25])
def test_edges_wait_for_the_next_emission_and_keep_their_separation(speed, phase):
    """Every 20 us the edges that were passed come 500 ns apart, in order: exactly, by rationals."""
    clock_hz, period, apart = 50_000_000, Fraction(20, 10**6), Fraction(1, 2 * 10**6)
    plain = moving(None, speed, 0.02, clock_hz)
    shown = moving(emitting(20e-6, 500e-9, phase), speed, 0.02, clock_hz)
    free, expected = Fraction(0), []
    for clock in plain.edges.clocks.tolist():
        at = (math.ceil(Fraction(clock, clock_hz) / period - Fraction(phase)) + Fraction(phase)) * period
        expected.append(math.ceil(max(at, free) * clock_hz))
        free = max(at, free) + apart
    assert shown.edges.clocks.tolist() == expected
    assert (shown.edges.levels == plain.edges.levels).all()


def test_three_edges_come_in_a_burst_every_20_us_at_150_mm_per_s():
    shown = moving(emitting(20e-6, 500e-9), 0.15, 0.01, 50e6)
    assert sorted(set(np.diff(shown.edges.clocks[1:]).tolist())) == [25, 950]


def glitching(hz: float, length_s: float, seed: int = 1) -> Lines:
    return QUIET._replace(glitch_gap_s=1 / hz, glitch_s=length_s, seed=seed)


@pytest.mark.parametrize("seed", [1, 2])
def test_glitches_come_independently_at_their_rate_with_their_length_on_either_line(seed):
    hz, seconds = 1000.0, 5.0
    shown = carried(glitching(hz, 2e-7, seed), NO_EDGES, 0b01, seconds, 50e6)
    changed = toggles(shown, 0b01)
    assert len(changed) % 2 == 0
    number = len(changed) // 2
    assert abs(number - hz * seconds) < 4 * (hz * seconds) ** 0.5
    for line in (A, B):
        begins, ends = shown.clocks[changed == line][::2], shown.clocks[changed == line][1::2]
        # 200 ns of 50 MHz are 10 clocks, wherever they begin; two that overlap leave what neither has, or both have.
        alone = ends - begins == 10
        assert alone.mean() > 0.99
        assert abs(len(begins) - number / 2) < 4 * (number / 4) ** 0.5
    gaps = np.diff(np.sort(shown.clocks[::2])) / 50e6 * hz
    assert scipy.stats.kstest(gaps, "expon").pvalue > 1e-3


def test_a_glitch_between_two_clocks_is_seen_by_none():
    """A tenth of a clock is seen if a clock is within: one in ten, and then for one clock."""
    shown = carried(glitching(1e4, 1e-9), NO_EDGES, 0, 2.0, 100e6)
    assert len(shown.clocks) // 2 == pytest.approx(2000, abs=4 * 2000**0.5)
    assert (shown.clocks[1::2] - shown.clocks[::2] == 1).all()


def test_glitches_are_counted_forth_and_back():
    encoded = moving(glitching(2000.0, 1e-7), clock_hz=50e6)
    plain = moving(None, clock_hz=50e6)
    assert len(encoded.edges.clocks) > len(plain.edges.clocks) + 200
    counts = counted(encoded.edges, encoded.start_level)
    assert counts[-1] == counted(plain.edges, plain.start_level)[-1]


@pytest.mark.parametrize(("dead", "lives"), [("a", B), ("b", A), ("both", None)])
def test_a_dead_line_keeps_its_level_from_its_time_on(dead, lives):
    at_s = 0.03
    times = {f"dead_{line}_s": at_s for line in "ab" if dead in (line, "both")}
    encoded = moving(QUIET._replace(**times), clock_hz=1e6)
    plain = moving(None, clock_hz=1e6)
    before = plain.edges.clocks < at_s * 1e6
    shared = int(before.sum())
    assert (encoded.edges.clocks[:shared] == plain.edges.clocks[:shared]).all()
    assert (encoded.edges.levels[:shared] == plain.edges.levels[:shared]).all()
    rest = Edges(encoded.edges.clocks[shared:], encoded.edges.levels[shared:])
    changed = toggles(rest, int(encoded.edges.levels[shared - 1]))
    assert set(changed.tolist()) == ({lives} if lives else set())
    # The other line's edges are counted forth and back: the count stands still to one count.
    counts = counted(encoded.edges, encoded.start_level)
    assert np.abs(counts[shared:] - counts[shared - 1]).max(initial=0) <= 1


ALL = Lines(3e-6, 12e-6, 20e-6, 0.3, 3e-6, 2e-4, 5e-6, 0.02, NEVER, 3)
KINDS = {
    "jitter": ALL._replace(emission_s=0.0, separation_s=0.0, glitch_gap_s=NEVER, dead_a_s=NEVER),
    "emission": QUIET._replace(emission_s=20e-6, emission_phase=0.3, separation_s=3e-6),
    "glitches": glitching(5e3, 5e-6),
    "all": ALL,
}


@pytest.mark.parametrize("name", KINDS)
def test_a_loop_shows_interval_by_interval_what_a_record_has(name):
    """Edges are given when they are passed, stamped when they are shown; some intervals are of a clock, some long."""
    lines, clock_hz, random = KINDS[name], 1e6, np.random.default_rng(5)
    passed = np.sort(random.integers(1, 40_000, 3000))
    stamps = passed + (random.integers(0, 24, 3000) if lines.jitter_s else 0)
    steps = np.cumsum(random.choice([-1, 1], 3000))
    quarter = (steps + 1) & 3
    levels = quarter ^ (quarter >> 1)
    whole = carried(lines, Edges(stamps, levels), 0b01, 0.04, clock_hz)

    edges = Edges(np.zeros(1000, np.int64), np.zeros(1000, np.int64))
    kept, clock, clocks, words = waiting(lines, 0b01, edges), 0, [], []
    while clock < 40_000:
        length = int(random.choice([1, 3, 50, 400]))
        inside = np.flatnonzero((passed > clock) & (passed <= clock + length))
        before = int(random.integers(0, 3))
        edges.clocks[before : before + len(inside)] = stamps[inside]
        edges.levels[before : before + len(inside)] = levels[inside]
        end = carry(lines, kept, before, before + len(inside), Interval(0.0, clock, length), clock_hz)
        new = edges.clocks[before:end].tolist()
        assert all(clock < at <= clock + length for at in new)
        clocks += new
        words += edges.levels[before:end].tolist()
        clock += length
    # Where several lines change at one clock, the pins show the last; and a record's last glitches are cut by its end.
    until = np.searchsorted(whole.clocks, 39_900)
    assert clocks[:until] == whole.clocks[:until].tolist()
    last = np.append(np.diff(whole.clocks[:until]) > 0, False)
    assert np.array(words)[:until][last].tolist() == whole.levels[:until][last].tolist()


def test_lost_edges_stay_lost_and_full_arrays_are_reported():
    edges = Edges(np.zeros(4, np.int64), np.zeros(4, np.int64))
    kept = waiting(QUIET, 0, edges)
    assert carry(QUIET, kept, 0, -1, Interval(0.0, 0, 10), 1e6) == -1
    edges.clocks[:], edges.levels[:] = [1, 2, 3, 4], [1, 3, 2, 0]
    assert carry(QUIET, kept, 0, 4, Interval(0.0, 0, 10), 1e6) == 4
    assert edges.levels.tolist() == [1, 3, 2, 0]
    often = glitching(1e6, 3e-6)
    assert carry(often, waiting(often, 0, edges), 3, 3, Interval(0.0, 0, 100), 1e6) == -1


def test_without_lines_nothing_waits():
    assert waiting(None, 0, NO_EDGES) is None
