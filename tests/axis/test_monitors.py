"""The monitors: RTL against model at every clock, and what each of them sees and does not."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axis.monitors import Monitors
from hardwall.model.axis import monitors
from hardwall.model.axis.monitors import IDLE_EDGES, LOSS_BITS, MADE, START, Inputs
from hardwall.model.axis.supervisor import CAUSES, names
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, rng, simulate
from stimuli.lengths import some_of
from stimuli.magnitudes import magnitudes
from stimuli.specs import spec

OUTPUTS = monitors.State._fields[:2]


def design(name: str, estimator: str = "levant") -> monitors.Design:
    axis = spec(name, estimator)
    return monitors.Design(axis, axis.design.estimator)


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

    half = 1 << (d.count_width - 1)
    a, b = bit(0.5, 40), bit(0.5, 40)
    columns = {
        "reset": (random.random(clocks) < 1e-3).astype(np.int64),
        "count": word(-half, half - 1, 30),
        "stepped": bit(0.5, 2), "edge_kind": held(random.integers(0, 4, clocks) & ~1, 60) ^ bit(0.05, 60),
        "edge_down": bit(0.5, 9), "indexed": bit(0.2, 2), "valid": bit(0.5, 3), "saturated": bit(0.7, 200),
        "velocity": word(d.velocity.min, d.velocity.max, 3), "at_limit": bit(0.7, 60), "negative": bit(0.5, 200),
        "a": a, "a_n": a ^ bit(0.7, 30), "b": b, "b_n": b ^ bit(0.7, 30),
        **{word_.name: word(word_.format.min, word_.format.max, 300) for word_ in d.words},
    }  # fmt: skip
    # At first both channels equal their complements for longer than the largest word lets them.
    lost = slice(1, (1 << LOSS_BITS) + 10)
    columns["reset"][lost], columns["supervisor_loss"][lost] = 0, (1 << LOSS_BITS) - 1
    columns["a_n"][lost], columns["b_n"][lost] = a[lost], b[lost]
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


@pytest.mark.parametrize(("name", "estimator"), some_of([("mhz", "levant"), ("narrow", "levant-adaptive")], 0))
def test_rtl(name, estimator):
    simulate(__file__, make, name=name, estimator=estimator)


class Bench:
    """The monitors' model, clocked by hand, with its words as after reset."""

    def __init__(self, **words: int):
        self.design, self.state = design("mhz"), START
        self.inputs = Inputs(**{word.name: word.reset for word in self.design.words} | words)
        self.latency = Monitors(self.design).latency

    def clock(self, **changed: int) -> list[str]:
        self.state = monitors.step(self.design.params, self.state, self.inputs._replace(**changed))
        return names(self.state.causes)

    def last(self, cause: str, **held: int) -> list[str]:
        """Return the causes after the clocks that one takes to be found."""
        return [self.clock(**held) for _ in range(self.latency(cause))][-1]

    def moves(self, count: int) -> None:
        """Move the handle, an edge a clock."""
        way = 1 if count > self.inputs.count else -1
        while self.inputs.count != count:
            self.inputs = self.inputs._replace(count=self.inputs.count + way, edge_down=int(way < 0))
            self.clock(stepped=1)

    def index(self, count: int, way: int = 1) -> list[str]:
        """Find an index at a count with the edge that leaves it, and return the causes at every clock."""
        self.moves(count)
        self.inputs = self.inputs._replace(count=count + way, edge_down=int(way < 0))
        return self.clock(stepped=1, indexed=1) + [cause for _ in range(3) for cause in self.clock()]


def test_an_axis_within_its_specification_is_never_wrong():
    bench, axis = Bench(), spec("mhz")
    assert bench.last("position_range") == []
    travel = int(axis.travel_m / axis.count_m)
    speed = int(axis.speed_max_counts_per_sample * 2**bench.design.velocity.f)
    for count in range(-travel, travel, 997):
        for way in (-1, 1):
            assert bench.clock(count=count, valid=1, velocity=way * speed, negative=int(way < 0)) == []


def test_the_position_is_held_to_its_range():
    bench = Bench(supervisor_position_low=-10, supervisor_position_high=20)
    for first_clock in range(2):
        bench.last("position_range")
        for count in (-10, 20, 0):
            assert [bench.clock(count=count) for _ in range(5)] == [[]] * 5
        for count in (-11, 21):
            # Found within its clocks, whichever of the limits is compared first, and held without a gap.
            assert bench.last("position_range", count=count) == ["position_range"]
            assert [bench.clock(count=count) for _ in range(5)] == [["position_range"]] * 5
            assert bench.last("position_range") == []
        # From here on the limits are compared at the other clocks.
        bench.clock() if first_clock == 0 else None


def test_a_new_range_holds_a_clock_later_than_a_new_count():
    for clocks in range(4):
        bench = Bench(supervisor_position_low=-10, supervisor_position_high=20)
        for _ in range(clocks):
            assert bench.clock() == []
        for word in ("supervisor_position_low", "supervisor_position_high"):
            bench.clock(**{word: 5 if word.endswith("low") else -5})
            later = [
                bench.clock(**{word: 5 if word.endswith("low") else -5}) for _ in range(bench.latency("position_range"))
            ]
            assert later[-1] == ["position_range"]
            assert [bench.clock() for _ in range(4)][-1] == []


@pytest.mark.parametrize("first", [0, 1])
def test_a_count_that_is_beyond_its_range_for_two_clocks_is_never_missed(first):
    found = []
    for clocks in (1, 2):
        bench = Bench(supervisor_position_low=-10, supervisor_position_high=20)
        counts = [0] * (4 + first) + [21] * clocks + [0] * 4
        found.append(["position_range"] in [bench.clock(count=count) for count in counts])
    # One clock may be that of the other limit: a filter of a clock lets no count turn back so soon.
    assert found == [bool(first), True]


def test_the_position_is_held_to_the_range_of_the_count():
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
    def drives(at_limit: int) -> None:
        bench.inputs = bench.inputs._replace(at_limit=at_limit, negative=int(way > 0))
        bench.clock()

    bench = Bench(supervisor_runaway=50)
    bench.moves(-200 * way)
    drives(1)
    bench.moves(-150 * way)
    assert bench.last("runaway") == []
    bench.moves(-149 * way)
    assert bench.clock() == ["runaway"]
    bench.moves(-150 * way)
    assert bench.clock() == []
    # From where the drive comes to its limit again, the way begins anew.
    drives(0)
    drives(1)
    bench.moves(-100 * way)
    assert bench.last("runaway") == []
    bench.moves(-99 * way)
    assert bench.clock() == ["runaway"]


def test_a_way_with_the_drive_is_no_runaway():
    bench = Bench(supervisor_runaway=50)
    bench.inputs = bench.inputs._replace(at_limit=1, negative=1)
    for count in range(0, -1000, -7):
        bench.moves(count)
        assert bench.clock() == []


def test_a_drive_below_its_limit_is_no_runaway():
    bench = Bench(supervisor_runaway=0)
    bench.inputs = bench.inputs._replace(negative=1)
    bench.moves(100)
    assert bench.last("runaway") == []


def test_a_preload_is_no_motion():
    bench = Bench(supervisor_runaway=50, supervisor_turn=1000)
    bench.inputs = bench.inputs._replace(at_limit=1, negative=1)
    assert bench.index(0) == []
    bench.moves(50)
    bench.inputs = bench.inputs._replace(count=7777)
    assert bench.last("runaway") == []
    bench.moves(7776)
    bench.moves(8727)
    assert bench.clock() == ["runaway"]
    bench.inputs = bench.inputs._replace(at_limit=0)
    bench.last("runaway")
    assert bench.index(8727) == []


def test_an_estimate_may_be_saturated_for_a_while():
    bench = Bench(supervisor_saturated=5)
    for _ in range(3):
        assert [bench.clock(valid=1, saturated=1) for _ in range(5)] == [[]] * 5
        assert bench.clock(valid=0, saturated=1) == []
        assert bench.clock(valid=1, saturated=0) == []
    for _ in range(5):
        bench.clock(valid=1, saturated=1)
    assert bench.clock(valid=1, saturated=1) == []
    assert bench.latency("estimator_saturated") == 2
    assert bench.clock() == ["estimator_saturated"]


@pytest.mark.parametrize("channel", "ab")
def test_a_channel_that_equals_its_complement_is_lost(channel):
    bench = Bench(supervisor_loss=3)
    for level in (0, 1):
        bench.clock()
        lost = {channel: level, f"{channel}_n": level}
        assert [bench.clock(**lost) for _ in range(4)] == [[], [], [], ["encoder_loss"]]


def test_index_edges_are_turns_apart():
    bench = Bench(supervisor_turn=1000, supervisor_index_tolerance=2)
    # In each pair the count of an index edge, and whether it is out of its place.
    for count, wrong in (
        (17, 0), (19, 0), (1018, 0), (2020, 0), (1019, 0), (17, 0), (17, 0), (1020, 1), (1023, 1), (1025, 0),
        (22, 1), (-979, 0), (-977, 0), (-974, 1), (1027, 1), (3028, 1), (3026, 0), (2028, 0),
    ):  # fmt: skip
        assert bench.index(count, 1) == ["index_spacing"] * wrong, count
        assert bench.index(count, -1) == [], "the same place again is no distance"


def test_an_index_is_found_within_its_clocks():
    bench = Bench(supervisor_turn=1000, supervisor_index_tolerance=2)
    bench.index(0)
    bench.moves(500)
    found = [bench.clock(stepped=1, indexed=1), *(bench.clock() for _ in range(bench.latency("index_spacing")))]
    assert found == [*([[]] * (len(found) - 2)), ["index_spacing"], []]


def test_indexes_may_come_at_successive_clocks():
    for down in (0, 1):
        bench = Bench(supervisor_turn=4, supervisor_index_tolerance=0)
        found = []
        for count in range(1, 30):
            bench.inputs = bench.inputs._replace(count=-count if down else count, edge_down=down)
            found += bench.clock(stepped=1, indexed=int((count - 1) % 4 == 0 or count - 1 in {21, 22}))
        # At 21 and 22, and at 24, which is no turn from 22.
        assert found == ["index_spacing"] * 3


def test_an_index_is_at_one_place_from_both_sides():
    """A handle turns round at the index, at which it is again and again, with an edge a clock or every fourth one."""
    for pause in (0, 3):
        bench, found, place, last = Bench(supervisor_turn=9999, supervisor_index_tolerance=0), [], 0, 0
        for way in (1, 1, -1, 1, -1, -1, 1, 1, 1, -1, -1, -1, -1, 1, 1, 1, 1, -1, -1, -1):
            passes = place == 1 and way == last
            place, last = place + way, way
            bench.inputs = bench.inputs._replace(count=place, edge_down=int(way < 0))
            found += bench.clock(stepped=1, indexed=int(passes))
            for _ in range(pause):
                found += bench.clock()
        found += [cause for _ in range(4) for cause in bench.clock()]
        assert found == []


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
