"""The watchdog: RTL against model at every clock, and the model against that of a single axis's supervisor."""

import dataclasses

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axis.watchdog import Watchdog
from hardwall.model.axis import supervisor, watchdog
from hardwall.model.axis.watchdog import START, Inputs
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, rng, simulate
from stimuli.lengths import some_of
from stimuli.specs import spec

OUTPUTS = watchdog.State._fields[:2]
CLOCK_HZ = {"slow": 10_000, "slower": 100_000}
"""Clocks at which milliseconds are few clocks: 10, for which the divider has nothing to count, and 100."""
RATES = {"sample_hz": 250, "actuation_hz": 250, "speed_max_m_per_s": 0.005, "acceleration_max_m_per_s2": 3.0}


def axis(name: str):
    return dataclasses.replace(spec("paper"), **RATES, gains=None, clock_hz=CLOCK_HZ[name])


def make(name: str) -> Recorded:
    return Recorded(Watchdog(watchdog.Design(axis(name))))


def campaign(d: watchdog.Design, clocks: int) -> dict[str, np.ndarray]:
    """Return inputs at every clock: a host that beats in bursts, and a word of every size.

    Many words are a power of two and little more: if a high bit of what is left were wrong, it would soon be nothing.
    """
    random = rng()
    changes = random.random(clocks) < np.repeat(random.choice([0.0, 0.0, 0.02, 0.5], clocks // 400 + 1), 400)[:clocks]
    width = d.word.format.width
    words = random.integers(0, d.word.format.max + 1, clocks) >> random.integers(0, width + 1, clocks)
    powers = (1 << random.integers(2, width, clocks)) + random.integers(0, 4, clocks)
    words = np.where(random.random(clocks) < 0.5, powers, words)
    reset = (random.random(clocks) < 2e-4).astype(np.int64)
    reset[0] = 1
    beats = np.where(changes, random.integers(0, 1 << supervisor.BEAT_BITS, clocks), 0)
    # At the end the host falls silent until it is overdue, for words that are one more than a power of two: a bit that
    # is wrongly toggled with that power is so once, and not back again.
    tick = d.params.pump_clocks * d.params.tick_turns
    for word in (17, 33, 65):
        silence = (word + 2) * tick
        words, reset = np.append(words, np.full(silence, word)), np.append(reset, np.zeros(silence, np.int64))
        beats = np.append(beats, [1, *[0] * (silence - 1)])
    return {"reset": reset, "heartbeat": np.bitwise_xor.accumulate(beats), "supervisor_watchdog": words}


def expected(d: watchdog.Design, columns: dict[str, np.ndarray]) -> dict[str, list[int]]:
    """Return the outputs after every clock."""
    state, seen = START, []
    for reset, *row in zip(columns["reset"].tolist(), *(columns[n].tolist() for n in Inputs._fields), strict=True):
        state = START if reset else watchdog.step(d.params, state, Inputs(*row))
        seen.append(state[: len(OUTPUTS)])
    return dict(zip(OUTPUTS, map(list, zip(*seen, strict=True)), strict=True))


@cocotb.test()
async def follows_model(dut):
    recorded = make(**parameters())
    d = recorded.component.design
    inputs, outputs = await play(dut, recorded, campaign(d, SAMPLES // 2))
    after = expected(d, {column: inputs.column(column) for column in inputs.names})
    check(inputs, outputs, after)
    assert all(set(after[name]) == {0, 1} for name in OUTPUTS)


@pytest.mark.parametrize("name", some_of(CLOCK_HZ, 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", CLOCK_HZ)
def test_it_is_that_of_a_supervisor(name):
    alone, whole = watchdog.Design(axis(name)), supervisor.Design(axis(name))
    columns = campaign(alone, 5_000)
    state, single, lives = START, supervisor.START, set()
    for row in zip(*(columns[field].tolist() for field in Inputs._fields), strict=True):
        state = watchdog.step(alone.params, state, Inputs(*row))
        given = dict(zip(Inputs._fields, row, strict=True))
        single = supervisor.step(whole.params, single, supervisor.Inputs(**given))
        assert state.live == single.live
        lives.add(state.live)
    assert lives == {0, 1}


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Watchdog(3)
