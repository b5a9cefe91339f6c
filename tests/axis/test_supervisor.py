"""The supervisor: RTL against model at every clock, and the model's promises about arming, trips and limits."""

import dataclasses

import cocotb
import numpy as np
import pytest

from hardwall.hdl.axis.supervisor import Supervisor
from hardwall.model.axis import supervisor
from hardwall.model.axis.supervisor import (
    ALL,
    ARMED,
    CAUSES,
    COUNT_BITS,
    DISARMED,
    LINK,
    REQUIRED,
    START,
    TRIPPED,
    Inputs,
)
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, simulate
from stimuli.hosts import Host, settled
from stimuli.lengths import some_of
from stimuli.specs import spec

# Clocks at which milliseconds are few clocks: 10, for which the divider of `alive` has nothing to count, and 1 000.
SLOW = {"clock_hz": 10_000, "sample_hz": 250, "actuation_hz": 250, "gains": None}
SLOW |= {"speed_max_m_per_s": 0.005, "acceleration_max_m_per_s2": 3.0}
SLOWER = {
    "slow": ("paper", SLOW),
    "narrow": ("narrow", {"clock_hz": 1_000_000, "sample_hz": 10_000, "actuation_hz": 10_000}),
}
MOST = (1 << COUNT_BITS) - 1
OUTPUTS = supervisor.State._fields[: supervisor.State._fields.index("counts") + 1]


def design(name: str) -> supervisor.Design:
    of, slower = SLOWER.get(name, (name, {}))
    return supervisor.Design(dataclasses.replace(spec(of), **slower))


def make(name: str) -> Recorded:
    return Recorded(Supervisor(design(name)))


def campaign(name: str, clocks: int) -> dict[str, np.ndarray]:
    """Return inputs at every clock: a host that is interrupted at random, and every cause until its count is full.

    Where milliseconds are few clocks, the host is also silent for so many that every bit of what is left to it falls,
    and for so many that some of its bits are high at once: what counts through all of its values comes to the same end
    in whichever order.
    """
    host = Host(design(name))
    host.clock(reset=1)
    host.is_interrupted(clocks)
    host.clock(reset=1)
    for bit in range(len(CAUSES)):
        host.trips(bit, MOST + 2)
    if name == "slow":
        host.is_silent(1026)
        host.is_silent(0b101101100)
    host.clock()
    host.clock(reset=1)
    return dict(zip(("reset", *Inputs._fields), np.array(host.rows, np.int64).T, strict=True))


def expected(d: supervisor.Design, columns: dict[str, np.ndarray]) -> dict[str, list[int]]:
    """Return the outputs after every clock."""
    state, seen = START, []
    for reset, *row in zip(columns["reset"].tolist(), *(columns[n].tolist() for n in Inputs._fields), strict=True):
        state = START if reset else supervisor.step(d.params, state, Inputs(*row))
        seen.append(state[: len(OUTPUTS)])
    return dict(zip(OUTPUTS, map(list, zip(*seen, strict=True)), strict=True))


@cocotb.test()
async def follows_model(dut):
    name = parameters()["name"]
    inputs, outputs = await play(dut, make(name), campaign(name, SAMPLES // 2))
    after = expected(design(name), {column: inputs.column(column) for column in inputs.names})
    check(inputs, outputs, after)
    # The campaign must reach every state, cause and limit.
    assert set(after["state"]) == {DISARMED, ARMED, TRIPPED}
    assert np.bitwise_or.reduce(after["latched"]) == ALL
    assert any(drive > 0 for drive in after["driven"])
    assert any(drive < 0 for drive in after["driven"])
    assert set(after["live"]) == {0, 1}
    assert set(after["alive"]) == {0, 1}
    assert max(after["counts"]) == (1 << COUNT_BITS * len(CAUSES)) - 1


@pytest.mark.parametrize("name", some_of(["slow", "narrow"], 1))
def test_rtl(name):
    simulate(__file__, make, name=name)


class Bench:
    """A supervisor's model, clocked by hand."""

    def __init__(self, name: str = "slow", **words: int):
        self.design, self.state = design(name), START
        self.inputs = settled(self.design, drive=self.design.force.max, **words)
        self.tick_clocks = self.design.params.pump_clocks * self.design.params.tick_turns

    def clock(self, **changed: int) -> supervisor.State:
        self.state = supervisor.step(self.design.params, self.state, self.inputs._replace(**changed))
        return self.state

    def arm(self) -> supervisor.State:
        self.inputs = self.inputs._replace(heartbeat=self.inputs.heartbeat ^ 1)
        self.clock()
        return self.clock(arm=1)


def test_nothing_arms_but_the_host_with_all_that_it_needs():
    ready = Bench()
    assert ready.arm().state == ARMED
    for missing in ({"enable": 0}, {"disarm": 1}, {"causes": 1}, {"supervisor_reference": 1}):
        bench = Bench()
        bench.inputs = bench.inputs._replace(**missing)
        assert bench.arm().state != ARMED, missing
    silent = Bench()
    assert silent.clock(arm=1).state == DISARMED
    referenced = Bench(supervisor_reference=1, referenced=1)
    assert referenced.arm().state == ARMED


@pytest.mark.parametrize("bit", [bit for bit in range(len(CAUSES)) if bit != LINK], ids=lambda bit: CAUSES[bit].name)
def test_a_cause_trips_at_the_next_clock_and_only_its_acknowledgement_and_an_arm_bring_the_drive_back(bit):
    bench = Bench(supervisor_causes=ALL)
    bench.arm()
    for _ in range(5):
        assert bench.clock(strobe=1).state == ARMED
    assert bench.state.driven > 0
    tripped = bench.clock(causes=1 << bit, stamp=77)
    assert (tripped.driven, tripped.state, tripped.latched, tripped.first_stamp) == (0, TRIPPED, 1 << bit, 77)
    assert bench.clock(arm=1).state == TRIPPED
    for wrong in (0, ALL, 1 << (bit + 1) % len(CAUSES)):
        assert bench.clock(acknowledge=1, acknowledged=wrong).state == TRIPPED
    late = 1 << (bit + 2) % len(CAUSES)
    if CAUSES[(bit + 2) % len(CAUSES)].always and late != 1 << LINK:
        # A cause that came after the host's look is not lost.
        bench.clock(causes=late, stamp=99)
        assert bench.clock(acknowledge=1, acknowledged=1 << bit).state == TRIPPED
        assert (bench.state.first, bench.state.first_stamp) == (1 << bit, 77)
    calm = bench.clock(acknowledge=1, acknowledged=bench.state.latched)
    assert (calm.state, calm.driven, calm.latched, calm.first) == (DISARMED, 0, 0, 1 << bit)
    assert bench.clock().driven == 0
    assert bench.arm().state == ARMED


def test_causes_that_cannot_harm_while_disarmed_are_watched_only_while_armed():
    for bit, cause in enumerate(CAUSES):
        if bit != LINK:
            assert Bench(supervisor_causes=ALL).clock(causes=1 << bit).state == (TRIPPED if cause.always else DISARMED)


def test_only_causes_that_are_not_required_can_be_disabled():
    for bit, cause in enumerate(CAUSES):
        if bit != LINK:
            bench = Bench(supervisor_causes=0)
            bench.arm()
            assert bench.clock(causes=1 << bit).state == (TRIPPED if cause.required else ARMED)


def test_a_silent_host_trips_within_the_time_that_it_has_set_and_no_word_switches_that_off():
    for held in (1, 50, 200, 2000, 2047):
        bench = Bench(supervisor_watchdog=held)
        bench.arm()
        clocks = 1
        while bench.clock(strobe=1).state == ARMED:
            clocks += 1
        ms = bench.tick_clocks
        assert bench.state.latched == 1 << LINK
        assert (held - 1) * ms - 2 <= clocks <= held * ms + 2


def test_a_host_that_goes_on_beating_stays_armed():
    bench = Bench(supervisor_watchdog=50)
    bench.arm()
    for _ in range(10):
        for _ in range(48 * bench.tick_clocks):
            bench.clock()
        bench.inputs = bench.inputs._replace(heartbeat=bench.inputs.heartbeat + 1)
    assert bench.clock().state == ARMED


def test_an_arm_is_announced():
    bench = Bench()
    assert bench.clock().ready == 0
    bench.inputs = bench.inputs._replace(heartbeat=1)
    assert [bench.clock().ready for _ in range(3)] == [0, 1, 1]
    assert bench.clock(enable=0).ready == 0
    assert bench.clock(causes=1).ready == 0


def test_enable_low_is_zero_at_once_and_high_again_brings_nothing_back():
    bench = Bench()
    bench.arm()
    for _ in range(10):
        bench.clock(strobe=1)
    off = bench.clock(enable=0)
    assert (off.driven, off.state, off.alive) == (0, DISARMED, 0)
    assert {bench.clock(strobe=1).driven for _ in range(10)} == {0}


def test_the_limit_rises_from_zero_in_the_time_that_is_set():
    bench = Bench("paper")
    assert bench.arm().driven == 0
    drives = []
    # Beats go on, but the model's milliseconds are many clocks: only strobes are played.
    for _ in range(6000):
        drives.append(bench.clock(strobe=1).driven)
    top = bench.design.limit.from_real(40_000)
    assert np.diff(drives).min() >= 0
    assert abs(drives.index(top) - supervisor.RAMP_S * 10_000) < 5
    assert drives[-1] == top


def test_a_lower_limit_holds_at_the_next_clock_and_a_higher_one_is_reached_like_the_first():
    bench = Bench("paper")
    bench.arm()
    for _ in range(6000):
        bench.clock(strobe=1)
    bench.inputs = bench.inputs._replace(supervisor_force_limit=7)
    assert bench.clock().driven == 7
    assert bench.clock(drive=bench.design.force.min).driven == -7
    bench.inputs = bench.inputs._replace(supervisor_force_limit=40_000)
    drives = [bench.clock(strobe=1).driven for _ in range(6000)]
    assert drives[0] == 7
    assert np.diff(drives).max() <= 8 == -(-40_000 // int(supervisor.RAMP_S * 10_000))
    assert drives[-1] == 40_000


@pytest.mark.parametrize("way", [1, -1])
def test_a_drive_that_is_all_that_may_be_is_at_its_limit(way):
    bench = Bench("paper", supervisor_ramp=design("paper").ramp.max)
    bench.arm()
    bench.clock(strobe=1)
    for limit in (1, 2, 500):
        for drive in (limit - 1, limit, limit + 1, bench.design.force.max):
            bench.clock(supervisor_force_limit=limit, drive=way * drive)
            assert (bench.state.at_limit, bench.state.magnitude) == (int(drive >= limit), min(drive, limit))
            bench.clock(strobe=1)
    assert not bench.clock(supervisor_force_limit=0).at_limit
    bench.clock(strobe=1)
    assert bench.clock().at_limit
    assert not bench.clock(enable=0).at_limit


@pytest.mark.parametrize("ramp", [1, 100_000, design("paper").ramp.max])
def test_a_drive_stays_at_its_limit_while_that_rises_after_arming_and_while_a_host_moves_it_again_and_again(ramp):
    bench, drives = Bench("paper", supervisor_ramp=ramp), []
    bench.arm()
    while len(drives) < 5000:
        limit = 1 + 7 * len(drives) - 5 * (len(drives) % 3)
        drives.append(bench.clock(strobe=1, supervisor_force_limit=limit).magnitude)
        # Before the ceiling has risen by the force LSB there is no drive.
        assert bench.state.at_limit == (drives[-1] > 0)
    assert drives[0] == 0 < drives[-1]


def test_every_cause_is_counted_once_however_long_it_stands_and_the_counts_saturate():
    for bit, cause in enumerate(CAUSES):
        if cause.always:
            bench = Bench(supervisor_causes=ALL)
            for times in range(1, 20):
                for _ in range(3):
                    bench.clock(causes=1 << bit)
                bench.clock()
                counts = bench.state.counts
                assert counts == min(times, MOST) << COUNT_BITS * bit


def test_alive_is_a_square_wave_of_its_rate_only_while_armed():
    bench = Bench("mhz")
    assert bench.clock().alive == 0
    bench.arm()
    levels = np.array([bench.clock().alive for _ in range(20_000)])
    edges = np.flatnonzero(np.diff(levels))
    assert set(np.diff(edges).tolist()) == {50_000_000 // (2 * supervisor.PUMP_HZ)}
    assert bench.clock(disarm=1).alive == 0


def test_names_and_words():
    assert supervisor.names(1 << LINK | 1) == ["encoder_illegal", "link_timeout"]
    assert REQUIRED >> LINK & 1
    for name in ("slow", "narrow", "mhz", "wide"):
        for word in design(name).words:
            assert word.name == "supervisor_reference" or word.reset > 0


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Supervisor(3)
