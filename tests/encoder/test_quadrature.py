"""The quadrature decoder: RTL against model at every clock, and the model's behaviour, clock by clock."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import cocotb
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hardwall.hdl.encoder.quadrature import Quadrature
from hardwall.model.arithmetic.fixed import wrap
from hardwall.model.encoder import quadrature as model
from hardwall.model.encoder.quadrature import NO_STROBES, START, Inputs, Params, State, Strobes, advance, run, step
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import SAMPLES, SEED, Recorded, check, parameters, play, rng, simulate
from stimuli.lengths import some_of
from stimuli.pins import (
    INPUTS,
    directed,
    faulty,
    joined,
    jumping,
    meeting,
    pins,
    pulses,
    random_stimulus,
    starting,
    stimulus,
    turning,
)

N_OUTPUTS = State._fields.index("first")
OUTPUTS = (*State._fields[:N_OUTPUTS], "fault")
WIDE = {"count_width": 32, "stamp_width": 24}
NARROW = {"count_width": 4, "stamp_width": 5, "glitch_width": 4, "fault_width": 2}
PARAMS = Quadrature(**NARROW).params
TO_COUNT = model.latency(0) - 1  # clocks from the one that samples a pin to the one that counts, without a filter


def expected(params: Params, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the outputs after every clock; a reset, which must come first, leaves the outputs of START."""
    resets = np.flatnonzero(inputs["reset"])
    record = np.empty((N_OUTPUTS, len(inputs["reset"])), np.int64)
    for begin, end in zip(resets, [*resets[1:], record.shape[1]], strict=True):
        record[:, begin] = START[:N_OUTPUTS]
        after = run_all(params, {name: inputs[name][begin + 1 : end] for name in INPUTS})
        record[:, begin + 1 : end] = after[:N_OUTPUTS]
    outputs = dict(zip(OUTPUTS, record, strict=False))
    return {**outputs, "fault": outputs["illegal"] | outputs["overspeed"] | outputs["wrapped"]}


def run_all(params: Params, columns: dict[str, np.ndarray]) -> State:
    """Return the states after every clock of a record of all inputs, by name."""
    return run(params, *(kind(*(columns[name] for name in kind._fields)) for kind in (Inputs, Strobes)))


def meeting_steps() -> int:
    """Return the counts that `meeting` makes."""
    return int(expected(PARAMS, meeting("clear", 1))["count"][-1])


# RTL against model.


def make(**widths: int) -> Recorded:
    return Recorded(Quadrature(**widths))


@cocotb.test()
async def follows_model(dut):
    stimuli = joined(directed(), random_stimulus(rng(), SAMPLES, parameters()["count_width"]))
    recorded = make(**parameters())
    inputs, outputs = await play(dut, recorded, stimuli)
    for part in (inputs, outputs):
        assert all(len(set(part.column(name))) > 1 for name in part.names), "a pin never moved"
    params, columns = recorded.component.params, {name: inputs.column(name) for name in inputs.names}
    check(inputs, outputs, expected(params, columns))


@cocotb.test()
async def counts_after_the_promised_latency(dut):
    a = np.arange(50) >= 10
    recorded = make(**parameters())
    stimuli = joined(*(stimulus(50, a=a, glitch_clocks=length) for length in range(16)))
    _, outputs = await play(dut, recorded, stimuli)
    counted = outputs.column("count").reshape(16, 50).argmax(axis=1)
    assert [*(counted - 10 + 1)] == [recorded.component.latency(length) for length in range(16)]


@pytest.mark.parametrize("widths", some_of([WIDE, NARROW], 1))
def test_rtl(widths):
    simulate(__file__, make, **widths)


# The model's behaviour, clock by clock; by `directed` the RTL is checked on the same stimuli.


@pytest.mark.parametrize("glitch_clocks", range(16))
@pytest.mark.parametrize("channel", "abz")
def test_only_pulses_longer_than_the_limit_pass(channel, glitch_clocks):
    seen = expected(PARAMS, pulses(channel, glitch_clocks))
    # A handle that passes Z starts behind its first edge, and ends before it.
    passes = channel == "z"
    assert seen["stepped"].sum() == (4 * (glitch_clocks + 3) - 1 if passes else 4)
    assert (np.diff(seen["index_latched"]) > 0).sum() == seen["indexed"].sum() == (2 if channel == "z" else 0)
    assert seen["count"][-1] == -passes
    assert seen["fault"][-1] == 0


@pytest.mark.parametrize("glitch_clocks", range(4))
def test_a_count_that_turns_back_has_lasted_a_clock_more_than_the_limit(glitch_clocks):
    random, clocks = rng(), 20_000
    a, b = (np.repeat(random.integers(0, 2, clocks), random.integers(1, 6, clocks))[:clocks] for _ in range(2))
    counts = run(Params(16, 8, 8), Inputs(a, b, 0, glitch_clocks)).count
    steps = np.diff(counts)
    edges = np.flatnonzero(steps)
    back = steps[edges[1:]] == -steps[edges[:-1]]
    # The monitor of the position's range relies on two clocks with a limit of one.
    assert np.diff(edges)[back].min() == glitch_clocks + 1


@pytest.mark.parametrize("way", [1, -1])
def test_count_and_stamps_wrap(way):
    inputs = turning(way)
    seen = expected(PARAMS, inputs)
    clock = np.arange(200)
    position = way * (clock // 5)
    counts = 4 * way + position[1:-TO_COUNT]
    assert (seen["count"][1 + TO_COUNT :] == wrap(counts, 4)).all()
    assert len(set(seen["count"])) == 16
    assert (seen["wrapped"][1 + TO_COUNT :] == np.logical_or.accumulate(wrap(counts, 4) != counts)).all()
    assert (seen["stamp"] == clock % 32).all()
    for channel in "ab":
        for kind, change in (("rise", 1), ("fall", -1)):
            edges = np.diff(inputs[channel], prepend=inputs[channel][0]) == change
            stamps = np.where(edges, clock + TO_COUNT - 1, 0)[:-TO_COUNT]
            decoded = np.append(np.zeros(TO_COUNT, int), np.maximum.accumulate(stamps))
            assert (seen[f"stamp_{channel}_{kind}"] == decoded % 32).all()


@pytest.mark.parametrize("way", [1, -1])
def test_the_last_edge_is_named_and_its_run_counted(way):
    """The motion goes 10 counts there and 10 counts back."""
    clock = np.arange(100)
    position = way * np.minimum(clock // 5, np.maximum(20 - clock // 5, 0))
    seen = expected(PARAMS, stimulus(100, **pins(position)))
    for now in range(1 + TO_COUNT, 100):
        passed = np.diff(position[1 : now - TO_COUNT + 1])
        ways = passed[passed != 0]
        run = next((i for i, turn in enumerate(ways[::-1]) if turn != ways[-1]), len(ways))
        assert seen["run"][now] == min(run, 4)
        if run:
            assert seen["down"][now] == (ways[-1] < 0)
            # Upwards, A rises as position 1 is entered; downwards, every edge is reversed.
            assert seen["edge"][now] == (position[now - TO_COUNT] + (2 if ways[-1] < 0 else 3)) % 4


@pytest.mark.parametrize("state", range(4))
def test_a_jump_of_both_channels_is_illegal_and_not_counted(state):
    seen = expected(PARAMS, jumping(state))
    jumps = np.maximum((np.arange(40) - TO_COUNT) // 5 - 1, 0)
    assert (seen["illegal_count"] == np.minimum(jumps, 3)).all()
    assert (seen["illegal"] == (jumps > 0)).all()
    told = {"stamp", "indexed", "illegal", "illegal_count", "fault"}
    assert not any(seen[name].any() for name in OUTPUTS if name not in told)


@pytest.mark.parametrize("widths", [WIDE, NARROW])
@pytest.mark.parametrize("state", range(4))
def test_the_count_of_illegal_changes_stops_when_it_is_full_until_a_clear(state, widths):
    params = Quadrature(**widths).params
    seen = expected(params, faulty(state))
    changes = np.clip(np.arange(320) - 9 - TO_COUNT, 0, 300)
    wanted = np.where(np.arange(320) < 315, np.minimum(changes, 2**params.fault_width - 1), 0)
    assert (seen["illegal_count"] == wanted).all()


@pytest.mark.parametrize("glitch_clocks", [0, 1, 15])
@pytest.mark.parametrize("edge", range(6))
def test_the_pins_first_sampled_are_the_start(edge, glitch_clocks):
    for levels in range(8):
        seen = expected(PARAMS, starting(levels, edge, glitch_clocks))
        up = 1 if (levels & 1) == (levels >> 1 & 1) else -1
        # The first clock after the reset samples the start; later differences from it are motion.
        assert seen["count"][-1] == (0 if edge == 0 else up)
        assert seen["stepped"].sum() == (0 if edge == 0 else 1)
        assert not any(seen[name].any() for name in ("fault", "index_count", "illegal_count"))


@pytest.mark.parametrize("when", range(1, 60))
def test_strobes_that_meet_what_they_act_on(when):
    seen = expected(PARAMS, meeting("preload", when))
    steps = (np.arange(12, 18) + TO_COUNT >= when).sum() - (when <= 51 + TO_COUNT + 2)
    assert seen["count"][-1] == wrap(5 + steps, 4)

    seen = expected(PARAMS, meeting("arm", when))
    # Position 5; the jump is behind it.
    # It is found by the edge that leaves it.
    index, now = 17 + TO_COUNT, max(when, 29)
    assert (seen["index_armed"][now], seen["index_latched"][now]) == ((0, 1) if when < index else (1, 0))
    assert seen["index_count"][-1] == (0 if when == index else 5)
    assert seen["index_latched"][-1] == 0

    # Whenever the origin is shifted, no edge is lost, and the index is where it is.
    seen = expected(PARAMS, meeting("origin_shift", when))
    assert seen["count"][-1] == meeting_steps() - 5
    assert seen["index_count"][-1] == 0
    assert seen["referenced"].any() == (index < when < 30 + TO_COUNT)

    seen = expected(PARAMS, meeting("slip", when))
    # Nor is an index found by two edges with a slip between them, or with the first of them.
    assert seen["index_latched"][29] == (not index - 1 <= when <= 29)

    seen = expected(PARAMS, meeting("clear", when))
    assert seen["illegal"][-1] == seen["illegal_count"][-1] == (when <= 30 + TO_COUNT)
    assert seen["overspeed"][-1] == (when <= 52 + 2)


def test_a_limit_lowered_with_two_edges_waiting_is_illegal():
    clock = np.arange(40)
    inputs = stimulus(40, a=clock >= 10, b=clock >= 13, glitch_clocks=np.where(clock < 18, 15, 0))
    seen = expected(PARAMS, inputs)
    assert (seen["count"][-1], seen["stepped"].sum(), seen["illegal_count"][-1]) == (0, 0, 1)


# The forms of one model.


@compiled
def stepwise(params, state, inputs, clocks):
    for _ in range(clocks):
        state = step(params, state, inputs, NO_STROBES)
    return state


HOLDS = st.lists(st.tuples(st.integers(0, 7), st.integers(0, 40), st.integers(0, 15), st.integers(0, 1)), max_size=30)


@settings(max_examples=200, deadline=None)
@given(armed=st.booleans(), holds=HOLDS)
@example(armed=False, holds=[(0, 1, 0, 0), (1, 2, 0, 0)])
def test_advance_is_so_many_steps(armed, holds):
    slow = fast = step(PARAMS, START, Inputs(1, 0, 0), Strobes(arm=1)) if armed else START
    for levels, clocks, glitch_clocks, invert in holds:
        inputs = Inputs(levels & 1, levels >> 1 & 1, levels >> 2, glitch_clocks, invert)
        slow = stepwise(PARAMS, slow, inputs, clocks)
        fast = advance(PARAMS, fast, inputs, clocks)
        assert slow == fast


def test_advance_jumps():
    still = advance(PARAMS, START, Inputs(1, 1, 0), 1 << 61)
    assert still == stepwise(PARAMS, START, Inputs(1, 1, 0), 32)


def test_lanes_are_single_records():
    lanes = [random_stimulus(np.random.default_rng([SEED, lane]), 500, 4) for lane in range(5)]
    together = run_all(PARAMS, {name: np.stack([lane[name] for lane in lanes]) for name in INPUTS})
    assert together.count.shape == (5, 500)
    for index, lane in enumerate(lanes):
        alone = run_all(PARAMS, lane)
        assert all((both[index] == one).all() for both, one in zip(together, alone, strict=True))


def digest() -> str:
    inputs = random_stimulus(rng(), 2000, 4)
    record = np.stack(run_all(PARAMS, inputs))
    rest = advance(PARAMS, State(*record[:, -1].tolist()), Inputs(1, 0, 1, 3), 1000)
    return hashlib.sha256(record.tobytes() + repr(tuple(map(int, rest))).encode()).hexdigest()


def test_the_same_without_compilation():
    code = "from encoder import test_quadrature; print(test_quadrature.digest())"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(Path(__file__).parents[1])}
    plain = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert plain.stdout.strip() == digest()


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("count_width", 1, ValueError),
        ("count_width", 63, ValueError),
        ("stamp_width", 0, ValueError),
        ("stamp_width", 63, ValueError),
        ("glitch_width", 0, ValueError),
        ("fault_width", 33, ValueError),
        ("count_width", 8.0, TypeError),
        ("fault_width", "8", TypeError),
    ],
)
def test_bad_widths_are_refused(name, value, error):
    with pytest.raises(error, match=f"{name} .* not {value!r}$"):
        Quadrature(**{**WIDE, name: value})
