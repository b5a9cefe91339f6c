"""The positions of the past: RTL against model, and the model against lists of plain integers."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.history import History
from hardwall.model.estimators import history
from hardwall.model.estimators.history import change_over, take
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, simulate
from stimuli.lengths import some_of
from stimuli.seeded import seeded
from stimuli.specs import spec

WINDOWS = {"paper": 2e-3, "narrow": 40e-6, "mhz": 20e-3}
"""Windows in s: 20, 20 and 20000 samples; the last are too many for the memory."""


def design(name: str) -> history.Design:
    return history.Design(spec(name), WINDOWS[name])


def make(name: str) -> History:
    return History(design(name))


def rows(d: history.Design, samples: int):
    """Yield (count, restart, age): motion, jumps, wraps, restarts, and ages over the whole memory."""
    random, half, fast, oldest = seeded(), 1 << (d.count_width - 1), d.change.max, d.age_max
    count = 0
    for k in range(samples):
        way = (k // 500) % 4
        if way < 2:
            count += (fast, -fast - 1)[way]
        elif way == 2:
            count += random.randint(-2 * fast, 2 * fast)
        elif k % 50 == 0:
            count = random.choice([-half, half - 1, 0])
        age = random.choice([1, 2, oldest - 1, oldest, random.randint(1, oldest)])
        # A memory that is thinned out has a long time without restarts, in which it fills.
        restart = random.random() < 0.001 and (d.every == 1 or k % 40_000 < 3_000)
        yield (count + half) % (2 * half) - half, int(restart), max(age, 1)


@compiled
def _run(params, state, counts, restarts, ages, stored, limited, change):
    for k in range(len(counts)):
        state, stored[k], limited[k] = take(params, state, counts[k], restarts[k])
        change[k] = change_over(params, state, ages[k])


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = make(**parameters())
    d, bench = component.design, Bench(dut, component)
    await bench.reset()
    # The change is ready with the earliest next strobe; one more row strobes for the last, which forgets everything.
    later = bench.monitor("strobe", "change")
    every = (*rows(d, SAMPLES // 5), (0, 1, 1), (0, 0, 1))
    inputs, outputs = await bench.campaign(
        "strobe",
        "valid",
        ("count", "restart", "age"),
        ("stored", "limited"),
        every,
        every=component.latency + 1,
        momentary=("count", "restart"),
    )
    stored, limited, change = (np.zeros(len(inputs.clocks), np.int64) for _ in range(3))
    columns = (inputs.column(name) for name in inputs.names)
    _run(d.params(), d.start(), *columns, stored, limited, change)
    check(inputs, outputs, {"stored": stored, "limited": limited}, component.latency)
    # Where a position is not stored, its change means nothing.
    compared = np.append(False, stored[:-1] == 1)
    check(inputs, later, {"change": np.where(compared, np.append(0, change[:-1]), later.column("change"))})
    assert compared.any()
    assert set(limited) == {0, 1}


@pytest.mark.parametrize("name", some_of(["narrow", "mhz"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


@pytest.mark.parametrize("name", WINDOWS)
def test_model_is_a_list_of_the_limited_sums(name):
    d = design(name)
    params, state, half = d.params(), d.start(), 1 << (d.count_width - 1)
    positions, last, most, fastest = [], None, 0, d.change.max
    for count, restart, age in rows(d, 100_000):
        state, stored, limited = take(params, state, count, restart)
        if restart or last is None:
            positions = [0]
        else:
            moved = (count - last + half) % (2 * half) - half
            change = max(-fastest, min(moved, fastest))
            assert limited == (change != moved)
            positions.append(positions[-1] + change)
        last, most = count, max(most, len(positions))
        assert stored == ((len(positions) - 1) % d.every == 0)
        if stored:
            back = len(positions) - 1 - age * d.every
            assert change_over(params, state, age) == positions[-1] - (positions[back] if back > 0 else 0)
    assert most > 2000


def test_memory_is_within_its_limit():
    sizes = {name: (design(name).every, design(name).age_bits, design(name).width) for name in WINDOWS}
    assert [every for every, _, _ in sizes.values()] == [1, 1, 16]
    for name, (every, age_bits, width) in sizes.items():
        assert width << age_bits <= history.MEMORY_BITS
        # The memory is not thinned out more than necessary.
        assert every == 1 or (width << age_bits) * 4 > history.MEMORY_BITS
        window = WINDOWS[name] * spec(name).sample_hz
        assert abs(design(name).longest * every - window) <= every / 2


def test_runs_do_not_share_their_memory():
    d = design("paper")
    assert d.start().positions is not d.start().positions


@pytest.mark.parametrize("window_s", [1e9, 0.0, -1.0])
def test_a_window_that_cannot_be_held_is_refused(window_s):
    with pytest.raises(ValueError, match=r"^window_s must be more than 0 and at most .* at these rates, not"):
        history.Design(spec("paper"), window_s)


def test_the_longest_window_is_accepted():
    with pytest.raises(ValueError, match="at most") as caught:
        history.Design(spec("paper"), 1e9)
    most = float(str(caught.value).split("at most ")[1].split()[0])
    assert history.Design(spec("paper"), most * (1 - 1e-5), 12).width <= history.WIDTH_MAX + 1


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        History(3)
