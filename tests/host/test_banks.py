"""A host of several axes: words and acts reach one axis alone, and what there is once is there once."""

import time
from collections.abc import Iterator

import pytest

from hardwall.host import (
    Axes,
    Axis,
    ChangedError,
    ForeignError,
    HeldError,
    NotReadyError,
    SilentError,
    State,
    connect,
    connect_axes,
    share,
)
from hardwall.host.banks import BankPort
from hardwall.host.device import AXES_AT
from hardwall.host.port import Port
from hardwall.host.requests import PLAIN, Sending
from hardwall.model.axes import register_file as banked_file
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.registers import BANK, AxesMap
from hardwall.model.axis.capture import DONE, TRIGGERED, WAITING
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import ARMED, CAUSES, DISARMED, TRIPPED
from hardwall.model.spec import AxisSpec
from host.twin_board import PATIENT, TwinBoard
from oracles.banked_server import BankedServer
from stimuli.captures import records, window
from stimuli.specs import MHZ

FAULT = 1 << [cause.name for cause in CAUSES].index("external_fault")
AXES = 3


class Board(TwinBoard):
    """A board of several axes whose supervisors do what they are asked for, while they may."""

    def __init__(self):
        registers = AxesMap(AxesSpec(**MHZ, axes=AXES, estimator="fdm"))
        super().__init__(registers, BankedServer(banked_file.Design(registers)))
        self.registers, self.started = registers, []
        for axis in range(AXES):
            self.show_of(axis, ready=1, live=1)

    def show_capture(self, state: int, **words: int) -> None:
        """Let the one capture memory show its state, in every bank."""
        for axis in range(AXES):
            self.show_of(axis, capture_state=state, **words)

    def show_of(self, axis: int, **words: int) -> None:
        """Let an axis show words of its status, and refuse what it then does."""
        status = self.server.file.statuses[axis]
        status |= words
        refused = {"arm": not status["ready"], **dict.fromkeys(("preload", "origin_shift"), status["state"] == ARMED)}
        self.server.file.refused_of[axis] = frozenset(name for name, is_so in refused.items() if is_so)

    def react(self, pulses: tuple[str, ...]) -> None:
        axis, file = self.server.file.bank, self.server.file
        if "arm" in pulses:
            self.show_of(axis, state=ARMED, ready=0)
        if "disarm" in pulses and file.statuses[axis]["state"] == ARMED:
            self.show_of(axis, state=DISARMED, ready=1)
        if "capture_start" in pulses:
            self.started.append(dict(file.active))
            self.show_capture(WAITING)
        if "capture_trigger" in pulses:
            self.show_capture(TRIGGERED)
        if "acknowledge" in pulses and file.acknowledged == file.statuses[axis]["latched"]:
            self.show_of(axis, state=DISARMED, latched=0, ready=1)

    def trip(self, axis: int) -> None:
        self.show_of(axis, state=TRIPPED, latched=FAULT, first=FAULT, ready=0)


@pytest.fixture
def board() -> Iterator[Board]:
    with Board() as found:
        yield found


@pytest.fixture
def axes(board) -> Iterator[Axes]:
    with connect_axes(board.name, **PATIENT) as found:
        yield found


def states(axes: Axes) -> list[State]:
    return [axis.status.state for axis in axes]


def test_the_port_of_a_bank_does_all_that_a_line_does(board, axes):
    public = {name for name in vars(Port) if not name.startswith("_")}
    assert public <= set(vars(BankPort))
    assert axes[2].line_s(10) == axes[0].line_s(10) > 0
    assert axes[2].read_registers(0, 2) == axes[0].read_registers(0, 2)


def test_what_an_axis_sends_goes_out_as_it_says(axes, monkeypatch):
    """A pulse that counts twice is not sent twice, and a disarm does not wait for a beat."""
    sent, write = [], Port.write

    def seen(self: Port, address: int, registers: tuple[int, ...], sending: Sending = PLAIN) -> None:
        sent.append((address - BANK, sending.once, sending.at_once, sending.check is not None))
        write(self, address, registers, sending)

    monkeypatch.setattr(Port, "write", seen)
    for name in ("disarm", "clear_flags"):
        axes[1].pulse(name)
    registers = axes.device.registers
    disarm, clear = registers["disarm"].address, registers["clear_flags"].address
    assert sent == [(disarm, False, True, False), (clear, True, False, True)]


def test_words_reach_one_axis_alone(board, axes):
    assert len(axes) == axes.device.axes == AXES
    for number, axis in enumerate(axes):
        axis.set(wall_stiffness=1e3 * (1 + number), supervisor_force_limit=1.0 + number)
    for number, axis in enumerate(axes):
        assert axis.get("wall_stiffness") == pytest.approx(1e3 * (1 + number), rel=1e-2)
        assert axis.get("supervisor_force_limit") == pytest.approx(1.0 + number, rel=1e-2)
    board.show_of(2, count=700)
    assert [axis.status.position_m for axis in axes] == pytest.approx([0.0, 0.0, 700e-6])
    assert 0 < axes[1].counters["link_requests"] < axes[2].counters["link_requests"]


def test_one_axis_trips_and_is_mended_while_the_others_are_armed(board, axes):
    for axis in axes:
        axis.arm()
    board.trip(1)
    assert states(axes) == [State.ARMED, State.TRIPPED, State.ARMED]
    assert axes[1].trip.first == ("external_fault",)
    axes[1].acknowledge()
    assert states(axes) == [State.ARMED, State.DISARMED, State.ARMED]
    with pytest.raises(NotReadyError):
        axes[0].preload(0.0)
    axes[1].preload(0.0)
    axes[0].disarm()
    assert states(axes) == [State.DISARMED, State.DISARMED, State.ARMED]


def beats_of_another_host(board: Board, axis: Axis, place: int) -> None:
    """Beat as another host does, while an axis is armed again and again.

    One beat may pass: a beat of ours that had read the word before it writes the next number over it.
    """
    for _ in range(100):
        board.server.file.live[place] += 5
        axis.disarm()
        axis.arm()


def test_the_words_of_the_host_are_there_once(board, axes):
    axes[2].set(supervisor_watchdog=0.1)
    file = board.server.file
    assert [axis.get("supervisor_watchdog") for axis in axes] == [0.1] * AXES
    assert file.active["supervisor_watchdog"] == 100
    # The others take it for theirs, and beat as often.
    for axis in axes:
        axis.arm()
    place = file.design.registers["heartbeat"].address
    assert file.active["heartbeat"] == file.live[place + 1] > 0
    assert [file.live[BANK * axis + place + 1] for axis in (1, 2)] == [0, 0]
    # Another host is found out by whichever axis.
    with pytest.raises(ChangedError):
        beats_of_another_host(board, axes[0], place + 1)


def test_no_axis_beats_beside_one_that_is_left_armed(board, axes, monkeypatch):
    monkeypatch.setattr(Axis, "_lease_s", 0.05)
    file = board.server.file
    axes[1].arm()
    time.sleep(0.1)
    # The lease of axis 1 has ended: nothing that axis 0 does beats for it.
    beaten = file.active["heartbeat"]
    with pytest.raises(SilentError, match=r"axis 1 is ARMED and its lease has ended"):
        axes[0].renew()
    assert file.active["heartbeat"] == beaten
    # One that has tripped, or is disarmed, or lives again, is in nobody's way.
    board.trip(1)
    axes[0].renew()
    assert file.active["heartbeat"] != beaten
    axes[1].acknowledge()
    for mend in (axes[1].disarm, axes[1].renew):
        axes[1].arm()
        time.sleep(0.1)
        mend()
        axes[0].renew()


def test_an_axis_that_an_earlier_host_has_left_armed_is_in_the_way_until_it_is_disarmed(board):
    board.show_of(2, state=ARMED, ready=0)
    with connect_axes(board.name, **PATIENT) as axes:
        with pytest.raises(SilentError, match="axis 2"):
            axes[0].arm()
        axes[2].disarm()
        axes[0].arm()
        assert states(axes) == [State.ARMED, State.DISARMED, State.DISARMED]


def test_a_capture_takes_the_axis_that_was_started(board, axes):
    words = records(board.registers, 2)
    assert [axis.capture.state for axis in axes] == ["IDLE"] * AXES
    axes[2].capture.start("fall", before=3, decimation=2, level_m=-2e-3)
    wanted = {"capture_axis": 2, "capture_sources": 0b1000, "capture_before": 3, "capture_decimation": 2}
    assert board.started[0].items() >= {**wanted, "capture_level": -2000}.items()
    # For the others there is none: neither can they trigger it, nor read it.
    assert [axis.capture.state for axis in axes] == ["IDLE", "IDLE", "WAITING"]
    with pytest.raises(NotReadyError, match="the capture is of axis 2, not of axis 0"):
        axes[0].capture.trigger()
    axes[2].capture.trigger()
    assert axes[2].capture.state == "TRIGGERED"
    board.server.file.capture = window(words)
    board.show_capture(DONE, capture_place=3)
    found = axes[2].capture.read()
    assert found.position_m.tolist() == (words["count"] * board.registers["count"].lsb).tolist()
    assert found.place == 3
    with pytest.raises(NotReadyError, match="the capture is IDLE"):
        axes[0].capture.read()
    # What was written for one is no other host's writing to another.
    for axis in axes:
        axis.arm()
    axes[0].capture.start()
    assert (len(board.started), board.started[1]["capture_axis"]) == (2, 0)
    assert [axis.capture.state for axis in axes] == ["WAITING", "IDLE", "IDLE"]


def test_who_has_the_first_axis_alone_captures_that(board, axes):
    axes[1].capture.start()
    axes.close()
    with connect(board.name, **PATIENT) as axis:
        assert axis.capture.state == "IDLE"
        axis.capture.start()
        assert [started["capture_axis"] for started in board.started] == [1, 0]
        assert axis.capture.state == "WAITING"


def test_all_are_disarmed_at_the_end(board):
    with connect_axes(board.name, **PATIENT) as axes:
        for axis in axes:
            axis.arm()
    assert [status["state"] for status in board.server.file.statuses] == [DISARMED] * AXES


def test_the_first_axis_is_had_alone_and_one_axis_is_several(board):
    with connect(board.name, **PATIENT) as axis:
        axis.set(wall_stiffness=5e3)
    file = board.server.file
    place = file.design.registers["active_wall_stiffness"].address + 1
    assert [file.live[BANK * number + place] > 0 for number in range(AXES)] == [True, False, False]
    with TwinBoard(RegisterMap(AxisSpec(**MHZ))) as alone, connect_axes(alone.name, **PATIENT) as found:
        assert (len(found), found.device.axes) == (1, 1)
        found[0].set(wall_stiffness=5e3)
        assert found[0].get("wall_stiffness") == pytest.approx(5e3, rel=1e-2)


def test_too_many_axes_are_none_of_ours(board):
    board.server.file.live[AXES_AT + 1] = 33
    with pytest.raises(ForeignError, match="must have at most 32 axes, not 33"):
        connect_axes(board.name, **PATIENT)


def test_of_a_board_that_is_shared_any_program_may_disarm_each_axis(board):
    with share(board.name, **PATIENT) as relay, connect_axes(relay.name, **PATIENT) as first:
        for axis in first:
            axis.arm()
        with connect_axes(relay.name, **PATIENT) as second:
            with pytest.raises(HeldError):
                second[1].set(wall_stiffness=1.0)
            assert states(first) == [ARMED, ARMED, ARMED]
            second[2].disarm()
            assert states(first) == [ARMED, ARMED, DISARMED]
