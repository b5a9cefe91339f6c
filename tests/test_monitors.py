"""The monitors: RTL against model at every clock, and what each of them sees and does not."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.monitors import Monitors
from hardwall.model import monitors
from hardwall.model.monitors import IDLE_EDGES, MADE, START, Inputs
from hardwall.model.supervisor import CAUSES, names
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, rng, simulate
from stimuli.magnitudes import magnitudes
from stimuli.specs import spec

OUTPUTS = monitors.State._fields[:2]


def design(name: str, estimator: str = "levant") -> monitors.Design:
    axis = spec(name, estimator)
    return monitors.Design(axis, axis.design.estimator.velocity)


def make(name: str, estimator: str) -> Recorded:
    return Recorded(Monitors(design(name, estimator)))


def campaign(d: monitors.Design, clocks: int) -> dict[str, np.ndarray]:
    """Return inputs at every clock, held for a while: every word near and far from what it is compared with."""
    random = rng()

    def held(values: np.ndarray, longest: int) -> np.ndarray:
        return np.repeat(values, random.integers(1, longest, len(values)))[:clocks]

    def word(low: int, high: int, longest: int) -> np.ndarray:
        return held(magnitudes(random, low, high, clocks, max(high.bit_length(), 1)), longest)

    def bit(probability: float, longest: int) -> np.ndarray:
        return held((random.random(clocks) < probability).astype(np.int64), longest)

    half, force = 1 << (d.count_width - 1), d.limit.max
    a, b = bit(0.5, 40), bit(0.5, 40)
    columns = {
        "reset": (random.random(clocks) < 1e-3).astype(np.int64),
        "count": word(-half, half - 1, 30),
        "stepped": bit(0.5, 2), "edge_kind": held(random.integers(0, 4, clocks) & ~1, 60) ^ bit(0.05, 60),
        "indexed": bit(0.2, 2), "valid": bit(0.5, 3), "saturated": bit(0.7, 200),
        "velocity": word(d.velocity.min, d.velocity.max, 3), "driven": word(-force, force, 60),
        "force_limit": word(0, force, 200), "a": a, "a_n": a ^ bit(0.7, 30), "b": b, "b_n": b ^ bit(0.7, 30),
        **{word_.name: word(word_.format.min, word_.format.max, 300) for word_ in d.words},
    }  # fmt: skip
    columns["reset"][0] = 1
    return columns


def expected(d: monitors.Design, columns: dict[str, np.ndarray]) -> dict[str, list[int]]:
    """Return the outputs after every clock."""
    state, seen = START, []
    for reset, *row in zip(columns["reset"].tolist(), *(columns[n].tolist() for n in Inputs._fields), strict=True):
        state = START if reset else monitors.step(d.params, state, Inputs(*row))
        seen.append(state[: len(OUTPUTS)])
    return dict(zip(OUTPUTS, map(list, zip(*seen, strict=True)), strict=True))


@cocotb.test()
async def follows_model(dut):
    recorded = make(**parameters())
    d = recorded.component.design
    inputs, outputs = await play(dut, recorded, campaign(d, SAMPLES // 2))
    after = expected(d, {column: inputs.column(column) for column in inputs.names})
    check(inputs, outputs, after)
    causes = np.array(after["causes"])
    for cause in names(int(np.bitwise_or.reduce(causes))):
        assert cause in MADE
    for bit, cause in enumerate(CAUSES):
        if cause.name in MADE:
            assert 0 < np.count_nonzero(causes >> bit & 1) < len(causes), cause.name
    assert set(after["a_channel_idle"]) == {0, 1}


@pytest.mark.parametrize(("name", "estimator"), [("mhz", "levant"), ("narrow", "levant-adaptive")])
def test_rtl(name, estimator):
    simulate(__file__, make, name=name, estimator=estimator)


class Bench:
    """The monitors' model, clocked by hand, with its words as after reset."""

    def __init__(self, **words: int):
        self.design, self.state = design("mhz"), START
        self.inputs = Inputs(**{word.name: word.reset for word in self.design.words} | words)

    def clock(self, **changed: int) -> list[str]:
        self.state = monitors.step(self.design.params, self.state, self.inputs._replace(**changed))
        return names(self.state.causes)


def test_an_axis_within_its_specification_is_never_wrong():
    bench, axis = Bench(), spec("mhz")
    travel = int(axis.travel_m / axis.count_m)
    speed = int(axis.speed_max_counts_per_sample * 2**bench.design.velocity.f)
    for count in range(-travel, travel, 997):
        for way in (-1, 1):
            assert (
                bench.clock(count=count, valid=1, velocity=way * speed, driven=way * 39_999, force_limit=40_000) == []
            )


def test_the_position_is_held_to_its_range_and_to_the_range_of_the_count():
    bench = Bench(supervisor_position_low=-10, supervisor_position_high=20)
    assert [bench.clock(count=count) for count in (-10, 20)] == [[], []]
    assert [bench.clock(count=count) for count in (-11, 21)] == [["position_range"]] * 2
    bench = Bench(supervisor_position_low=-(1 << 20), supervisor_position_high=(1 << 20) - 1)
    quarter = 3 << 18
    assert [bench.clock(count=count) for count in (quarter - 1, -quarter)] == [[], []]
    assert [bench.clock(count=count) for count in (quarter, -quarter - 1)] == [["position_wrap"]] * 2


def test_the_speed_is_looked_at_with_every_estimate():
    bench = Bench(supervisor_velocity_limit=100)
    assert bench.clock(velocity=101) == []
    assert bench.clock(valid=1, velocity=100) == []
    assert [bench.clock(valid=1, velocity=velocity) for velocity in (101, -101)] == [["velocity_limit"]] * 2


@pytest.mark.parametrize("way", [1, -1])
def test_a_handle_that_runs_against_the_largest_drive_is_a_runaway(way):
    bench = Bench(supervisor_runaway=50)
    drive = {"driven": -40 * way, "force_limit": 40}
    for moved in range(-200, 51):  # coming back with the drive, and then as far as may be
        bench.clock(count=-200 * way, driven=0) if moved == -200 else None
        assert bench.clock(count=max(moved, 0) * way, **drive) == []
    assert bench.clock(count=51 * way, **drive) == ["runaway"]
    assert bench.clock(count=51 * way, driven=-39 * way, force_limit=40) == []
    # From where the drive comes to its limit again, the way begins anew.
    assert bench.clock(count=51 * way, **drive) == []
    assert bench.clock(count=101 * way, **drive) == []
    assert bench.clock(count=102 * way, **drive) == ["runaway"]


def test_a_way_with_the_drive_is_no_runaway():
    bench = Bench(supervisor_runaway=50)
    for count in range(0, -1000, -7):
        assert bench.clock(count=count, driven=-40, force_limit=40) == []


def test_an_estimate_may_be_saturated_for_a_while():
    bench = Bench(supervisor_saturated=5)
    for _ in range(3):
        assert [bench.clock(valid=1, saturated=1) for _ in range(5)] == [[]] * 5
        assert bench.clock(valid=0, saturated=1) == []
        assert bench.clock(valid=1, saturated=0) == []
    for _ in range(5):
        bench.clock(valid=1, saturated=1)
    assert bench.clock(valid=1, saturated=1) == ["estimator_saturated"]


@pytest.mark.parametrize("channel", "ab")
def test_a_channel_that_equals_its_complement_is_lost(channel):
    bench = Bench(supervisor_loss=3)
    for level in (0, 1):
        bench.clock()
        lost = {channel: level, f"{channel}_n": level}
        assert [bench.clock(**lost) for _ in range(4)] == [[], [], [], ["encoder_loss"]]


def test_index_edges_are_turns_apart():
    bench = Bench(supervisor_turn=1000, supervisor_index_tolerance=2)
    counts = (17, 19, 1018, 2020, 1019, 17, 17, 1020, 1023)
    # Edges may come at successive clocks; the cause of each comes `index_clocks` later.
    found = [bench.clock(indexed=1, count=count) for count in counts]
    found += [bench.clock(count=500) for _ in range(Monitors(bench.design).index_clocks)]
    assert found == [[]] * 10 + [["index_spacing"]] * 2 + [[]]


def test_edges_of_one_channel_alone_are_a_warning():
    bench = Bench()
    for edge in range(4 * IDLE_EDGES):
        bench.clock(stepped=1, edge_kind=edge % 4)
        assert not bench.state.a_channel_idle
    for edge in range(IDLE_EDGES):
        assert not bench.state.a_channel_idle
        bench.clock(stepped=1, edge_kind=edge % 2 * 2)
    assert bench.state.a_channel_idle
    bench.clock(stepped=1, edge_kind=1)
    assert not bench.state.a_channel_idle


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Monitors(3)
