"""The monitor of a clock: RTL against model at every clock of the oscillator, and the promises about what it finds."""

import random as plain

import cocotb
import numpy as np
import pytest

from hardwall.hdl.board.clock_monitor import ClockMonitor
from hardwall.model.board import clock_monitor
from hardwall.model.board.clock_monitor import OSCILLATOR_HZ, START, Design, Inputs, State
from hardwall.testing import SAMPLES, SEED, Recorded, check, parameters, play, simulate
from stimuli.lengths import some_of

SLOW_ECP5_HZ, SLOW_ICE40_HZ, SLOW_GW1NR_HZ = 2.16e6, 5.4e6, 5.625e6
"""The internal oscillators of `constraints/`, a tenth too slow."""
CLOCKS_HZ = [460_800, 12_000_000, 25_000_000, 50_000_000, 1_000_000_000]


def make(clock_hz: int) -> Recorded:
    return Recorded(ClockMonitor(Design(clock_hz)))


def campaign(design: Design, clocks: int) -> np.ndarray:
    """Return the level of a beat at every clock: it changes soon, at the last moment, too late, or stands."""
    random, limit = plain.Random(SEED), design.params.limit
    levels, level = [], 0
    while len(levels) < clocks:
        held = random.choice((random.randint(1, 3), limit - 1, limit, limit + 1, random.randint(1, 3 * limit)))
        levels += [level] * held
        level ^= 1
    return np.array(levels[:clocks])


@cocotb.test()
async def follows_model(dut):
    design = Design(parameters()["clock_hz"])
    beat = campaign(design, SAMPLES // 2)
    inputs, outputs = await play(dut, make(design.clock_hz), {"reset": np.zeros_like(beat), "beat": beat})
    state, running = START, []
    for level in inputs.column("beat"):
        state = clock_monitor.step(design.params, state, Inputs(level))
        running.append(state.running)
    check(inputs, outputs, {"running": running})
    assert set(running) == {0, 1}


@pytest.mark.parametrize("clock_hz", some_of([12_000_000, 50_000_000], 0))
def test_rtl(clock_hz):
    simulate(__file__, make, clock_hz=clock_hz)


def watched(design: Design, oscillator_hz: float, phase: float, stops_s: float, lasts_s: float) -> tuple[list, list]:
    """Return the times of the oscillator's edges and `running` after each, for a clock that stops."""
    state, times, running = START, [], []
    for k in range(int(lasts_s * oscillator_hz)):
        now = (k + phase) / oscillator_hz
        edges = int(min(now, stops_s) * design.clock_hz)
        state = clock_monitor.step(design.params, state, Inputs(edges // design.beat_clocks & 1))
        times.append(now)
        running.append(state.running)
    return times, running


@pytest.mark.parametrize("clock_hz", CLOCKS_HZ)
def test_a_clock_that_runs_is_never_taken_for_one_that_stands_and_one_that_stops_is_found_in_time(clock_hz):
    design, random = Design(clock_hz), plain.Random(SEED)
    level_s = design.beat_clocks / clock_hz
    for oscillator_hz in (*OSCILLATOR_HZ, *(random.uniform(*OSCILLATOR_HZ) for _ in range(8))):
        # Three levels pass at most until the second change has been seen.
        started_s, latency_s = 3 * level_s + 4 / oscillator_hz, design.stop_latency_s(oscillator_hz)
        stops_s = started_s + 20 * level_s + random.random() * level_s
        times, running = watched(design, oscillator_hz, random.random(), stops_s, stops_s + latency_s + 3 * level_s)
        for now, runs in zip(times, running, strict=True):
            if started_s < now < stops_s:
                assert runs, (oscillator_hz, now)
            if now > stops_s + latency_s:
                assert not runs, (oscillator_hz, now)


@pytest.mark.parametrize("clock_hz", CLOCKS_HZ)
def test_no_level_of_the_beat_is_missed(clock_hz):
    design = Design(clock_hz)
    assert design.beat_clocks / clock_hz >= 2 / OSCILLATOR_HZ[0]
    # It is the shortest such level of a power of two.
    assert design.beat_clocks == clock_monitor.BEAT_MIN or design.beat_clocks / 2 / clock_hz < 2 / OSCILLATOR_HZ[0]


@pytest.mark.parametrize("clock_hz", CLOCKS_HZ[:4])
def test_a_clock_that_comes_back_makes_edges_before_it_is_taken_to_run(clock_hz):
    design, random = Design(clock_hz), plain.Random(SEED)
    for _ in range(200):
        oscillator_hz = random.choice((*OSCILLATOR_HZ, random.uniform(*OSCILLATOR_HZ)))
        ticks, edges = random.random(), random.randrange(10 * design.beat_clocks)
        # A stop that is just long enough to be found, or longer; and a beat at any of its clocks.
        stop_s = design.stop_latency_s(oscillator_hz) * random.choice((0.95, 1.0, random.uniform(0.9, 3)))
        state, found, since = State(running=1, left=design.params.limit, began=1), False, 0
        before = edges // design.beat_clocks & 1
        state = state._replace(levels=7 * before)
        for tick in range(int((stop_s + 8 * design.beat_clocks / clock_hz) * oscillator_hz)):
            now = (tick + ticks) / oscillator_hz
            since = max(int((now - stop_s) * clock_hz) + 1, 0) if now > stop_s else 0
            state = clock_monitor.step(design.params, state, Inputs((edges + since) // design.beat_clocks & 1))
            if not state.running:
                found, low = True, since
            elif found:
                # These edges of the clock have come while it was taken to stand, the last of them before this tick.
                assert low >= clock_monitor.BEAT_MIN
                break
        assert state.running


@pytest.mark.parametrize(
    ("oscillator_hz", "promised_s"), [(SLOW_ECP5_HZ, 21e-6), (SLOW_ICE40_HZ, 9e-6), (SLOW_GW1NR_HZ, 8e-6)]
)
def test_a_stop_is_found_in_the_time_that_pages_promise_of_any_clock(oscillator_hz, promised_s):
    random = plain.Random(SEED)
    # The longest level of a beat is that of a clock for which a shorter one just does not last long enough.
    turns = [OSCILLATOR_HZ[0] * (1 << power) // 2 for power in range(2, 11)]
    clocks_hz = [turn + more for turn in turns for more in (0, 1)]
    clocks_hz += [random.randint(turns[0], 10**9) for _ in range(99)]
    assert clocks_hz[0] == 2_000_000
    longest_s = max(Design(clock_hz).stop_latency_s(oscillator_hz) for clock_hz in clocks_hz)
    # A page gives whole microseconds, and no more of them than it must.
    assert promised_s - 1e-6 < longest_s <= promised_s


@pytest.mark.parametrize(
    ("clock_hz", "oscillator_hz", "promised_s"),
    [(25_000_000, SLOW_ECP5_HZ, 15e-6), (12_000_000, SLOW_ICE40_HZ, 6e-6), (27_000_000, SLOW_GW1NR_HZ, 6e-6)],
)
def test_a_stop_of_a_boards_own_clock_is_found_in_the_time_that_pages_promise(clock_hz, oscillator_hz, promised_s):
    design, random = Design(clock_hz), plain.Random(SEED)
    assert promised_s - 1e-6 < design.stop_latency_s(oscillator_hz) <= promised_s
    longest_s = 0.0
    for _ in range(300):
        stops_s = 20e-6 + random.random() * 2 * design.beat_clocks / clock_hz
        times, running = watched(design, oscillator_hz, random.random(), stops_s, stops_s + 2 * promised_s)
        last = max(k for k, runs in enumerate(running) if runs)
        # The last edge of the clock is up to one of its periods before the stop.
        longest_s = max(longest_s, times[last + 1] - int(stops_s * clock_hz) / clock_hz)
    assert promised_s - 2e-6 < longest_s <= promised_s


def test_wrong_clocks_are_refused():
    with pytest.raises(ValueError, match=r"^clock_hz must be 1 or more, not 0$"):
        Design(0)
    with pytest.raises(TypeError, match=r"not 3$"):
        ClockMonitor(3)
