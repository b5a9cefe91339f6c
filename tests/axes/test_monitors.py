"""Monitors that look once a sample: what each of them sees and does not; the RTL is held to them with the axes."""

import pytest

from hardwall.model.axes import monitors as sampled_monitors
from hardwall.model.axes.monitors import START, Inputs, Params
from hardwall.model.axis import monitors, supervisor
from hardwall.model.axis.monitors import IDLE_EDGES
from hardwall.model.axis.supervisor import names
from stimuli.specs import spec

ROTA = 16


class Bench:
    """The monitors' model, sample by sample, with its words as after reset.

    Attributes:
        let_out: the supervisor's state that says how much of the drive is let out.
    """

    def __init__(self, **words: int):
        axis = spec("mhz")
        design = monitors.Design(axis, axis.design.estimator)
        self.params, self.state, self.let_out = Params(*design.params, ROTA), START, supervisor.START
        self.inputs = Inputs(**{word.name: word.reset for word in design.words} | words)

    def sample(self, **changed: int) -> list[str]:
        """Take a sample with some inputs otherwise; the count stays."""
        self.inputs = self.inputs._replace(count=changed.get("count", self.inputs.count))
        self.state = sampled_monitors.step(self.params, self.state, self.inputs._replace(**changed), self.let_out)
        return names(self.state.causes)

    def presses(self, negative: int) -> None:
        """Let the drive come to its limit on one side."""
        self.let_out = supervisor.START._replace(at_limit=1, negative=negative)
        self.sample()


def test_the_position_is_held_to_both_limits_in_every_sample():
    bench = Bench(supervisor_position_low=-10, supervisor_position_high=20)
    for count in (-10, 20, 0):
        assert bench.sample(count=count) == []
    for count in (-11, 21, -500):
        assert bench.sample(count=count) == ["position_range"]


def test_the_position_is_held_to_the_range_of_the_count():
    bench = Bench(supervisor_position_low=-(1 << 20), supervisor_position_high=(1 << 20) - 1)
    quarter = 3 << 18
    assert [bench.sample(count=count) for count in (quarter - 1, -quarter)] == [[], []]
    assert [bench.sample(count=count) for count in (quarter, -quarter - 1)] == [["position_wrap"]] * 2


def test_the_speed_of_every_sample_is_looked_at():
    bench = Bench(supervisor_velocity_limit=100)
    found = [bench.sample(velocity=velocity) for velocity in (100, -100, 101, -101)]
    assert found == [[], [], ["velocity_limit"], ["velocity_limit"]]


@pytest.mark.parametrize("way", [1, -1])
def test_the_longest_way_that_is_accepted_is_not_jumped_over(way):
    """As fast as a decoder counts, the way is within its width when it is too long, whatever is left to the limit."""
    axis = spec("mhz")
    words = monitors.Design(axis, axis.design.estimator, ROTA).words
    (longest,) = [word.high for word in words if word.name == "supervisor_runaway"]
    assert longest == (1 << 20) - ROTA
    for short in range(3 * ROTA):
        bench = Bench(supervisor_runaway=longest)
        start = -way * 3 << 18
        bench.sample(count=start)
        bench.presses(int(way > 0))
        bench.state = bench.state._replace(way=short - longest)
        (before, found) = [bench.sample(count=start + way * ROTA * n) for n in (short // ROTA, short // ROTA + 1)]
        assert ("runaway" in before, "runaway" in found) == (False, True)


@pytest.mark.parametrize("way", [1, -1])
def test_a_handle_that_runs_against_the_largest_drive_is_a_runaway(way):
    bench = Bench(supervisor_runaway=50)
    bench.sample(count=-200 * way)
    bench.presses(int(way > 0))
    assert bench.sample(count=-150 * way) == []
    assert bench.sample(count=-149 * way) == ["runaway"]
    assert bench.sample(count=-150 * way) == []
    # A preload is no motion, and hides that of one sample.
    assert bench.sample(count=7777 * way, fresh=1) == []
    assert bench.sample(count=7778 * way) == ["runaway"]
    # Nor is a shift of the origin.
    assert bench.sample(count=6778 * way, shifted=1, shift=-1000 * way) == ["runaway"]
    bench.sample(count=7778 * way, shifted=1, shift=1000 * way)
    # On the other side, and where the drive comes to its limit again, the way begins anew.
    bench.presses(int(way < 0))
    bench.presses(int(way > 0))
    assert bench.sample(count=7828 * way) == []
    bench.let_out = supervisor.START
    assert bench.sample(count=7928 * way) == []


def test_a_way_with_the_drive_or_below_its_limit_is_no_runaway():
    bench = Bench(supervisor_runaway=0)
    for count in range(0, 1000, 7):
        assert bench.sample(count=count) == []
    bench.presses(1)
    for count in range(994, 0, -7):
        assert bench.sample(count=count) == []


def test_an_estimate_may_be_saturated_for_so_many_samples():
    bench = Bench(supervisor_saturated=5)
    for _ in range(3):
        assert [bench.sample(saturated=1) for _ in range(5)] == [[]] * 5
        assert bench.sample() == []
    assert [bench.sample(saturated=1) for _ in range(7)] == [[]] * 5 + [["estimator_saturated"]] * 2


@pytest.mark.parametrize("channel", ["lost_a", "lost_b"])
@pytest.mark.parametrize(("longest", "rotas"), [(ROTA - 1, 1), (ROTA, 2), (3 * ROTA, 4)])
def test_a_channel_is_lost_after_so_many_clocks_of_whole_rotas(channel, longest, rotas):
    bench = Bench(supervisor_loss=longest)
    for _ in range(2):
        found = [bench.sample(**{channel: 1}) for _ in range(rotas + 2)]
        assert found == [[]] * (rotas - 1) + [["encoder_loss"]] * 3
        assert bench.sample() == []


def test_index_edges_are_turns_apart():
    bench = Bench(supervisor_turn=1000, supervisor_index_tolerance=2)
    # In each pair the count of an index edge, and whether it is out of its place.
    for count, wrong in (
        (17, 0), (19, 0), (1018, 0), (2020, 0), (1019, 0), (17, 0), (17, 0), (1020, 1), (1023, 1), (1025, 0),
        (22, 1), (-979, 0), (-977, 0), (-974, 1), (1027, 1), (3028, 1), (3026, 0), (2028, 0),
    ):  # fmt: skip
        assert bench.sample(count=count + 5, indexed=1, index_count=count) == ["index_spacing"] * wrong, count
        assert bench.sample(count=count) == []
    # The last one moves with the origin.
    assert bench.sample(shifted=1, shift=-2000) == []
    assert bench.sample(indexed=1, index_count=30) == []
    assert bench.sample(shifted=1, shift=7, indexed=1, index_count=1040) == ["index_spacing"]
    assert bench.sample(indexed=1, index_count=1041) == []
    # A preload forgets it.
    assert bench.sample(fresh=1) == []
    assert bench.sample(indexed=1, index_count=300) == []
    assert bench.sample(indexed=1, index_count=303) == ["index_spacing"]


def test_samples_with_edges_of_one_channel_alone_are_a_warning():
    bench = Bench()
    for sample in range(4 * IDLE_EDGES):
        bench.sample(edge_a=sample & 1, edge_b=sample & 2)
        assert not bench.state.a_channel_idle
    bench.sample(edge_a=1, edge_b=1)
    for _ in range(IDLE_EDGES):
        assert not bench.state.a_channel_idle
        bench.sample(edge_b=1)
        bench.sample()
    assert bench.state.a_channel_idle
    bench.sample(edge_a=1)
    assert not bench.state.a_channel_idle
