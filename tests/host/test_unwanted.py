"""No drive that nobody asked for: what a host does with a board of which it does not know whether it is ARMED."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
import pytest

from hardwall.host.axis import Axis
from hardwall.host.connect import connect
from hardwall.host.errors import ChangedError, HostError, NotReadyError, SilentError, TrippedError
from hardwall.host.status import State
from hardwall.model.axis.supervisor import CAUSES
from hardwall.model.checks import FieldError
from host.twin_board import PATIENT, TwinBoard

PATIENCE_S = 60.0
FOR_GOOD = 1 << 30
"""More answers than a host waits for."""


class Supervised:
    """What a board's supervisor does at pulses.

    Attributes:
        board: the board.
        heard: the pulses.
        lost_at: the pulse whose answer is lost; its next only.
        deaf: whether it hears none.
    """

    def __init__(self, board: TwinBoard):
        self.board, self.heard, self.lost_at, self.deaf = board, [], "", False
        board.show(ready=1, live=1, state=State.DISARMED)
        board.react = self._react

    def _react(self, pulses: tuple[str, ...]) -> None:
        if self.deaf:
            return
        for pulse in pulses:
            self.heard.append(pulse)
            if pulse == self.lost_at:
                self.lost_at, self.board.lost = "", 1
            if pulse in ("arm", "disarm"):
                self.board.show(state=State.ARMED if pulse == "arm" else State.DISARMED)

    @property
    def state(self) -> int:
        return self.board.server.file.status["state"]


@pytest.fixture
def supervised(board) -> Supervised:
    return Supervised(board)


def beats(board: TwinBoard) -> int:
    """Return the word of the last beat that a board has heard."""
    return board.server.file.active["heartbeat"]


@pytest.fixture
def armed(board, supervised, axis) -> Axis:
    axis.arm()
    assert supervised.state == State.ARMED
    return axis


def test_a_board_that_another_host_left_armed_is_disarmed_before_the_first_beat(board, supervised):
    board.show(state=State.ARMED)
    with connect(board.name, **PATIENT) as axis:
        # Who only looks changes nothing, and lets the watchdog end it.
        assert axis.status.state is State.ARMED
        assert supervised.heard == []
        before = beats(board)
        disarmed = []
        board.react = lambda pulses: disarmed.append(beats(board)) if "disarm" in pulses else None
        axis.renew()
        assert disarmed[0] == before != beats(board)


def test_words_are_not_written_to_a_board_that_another_host_left_armed(board, supervised):
    board.show(state=State.ARMED)
    with connect(board.name, **PATIENT) as axis:
        axis.set(wall_stiffness=5e3)
        assert supervised.heard == ["disarm", "commit"]


def test_an_arming_whose_answer_is_lost_ends_disarmed(supervised, axis):
    supervised.lost_at = "arm"
    with pytest.raises(SilentError, match="which may have been carried out"):
        axis.arm()
    assert supervised.heard[-2:] == ["arm", "disarm"]
    assert supervised.state == State.DISARMED
    axis.arm()
    assert supervised.state == State.ARMED


def test_an_arming_that_is_interrupted_ends_disarmed(supervised, axis, monkeypatch):
    pulse = axis.pulse

    def interrupted(name: str) -> None:
        pulse(name)
        if name == "arm":
            raise KeyboardInterrupt

    monkeypatch.setattr(axis, "pulse", interrupted)
    with pytest.raises(KeyboardInterrupt):
        axis.arm()
    assert supervised.heard[-2:] == ["arm", "disarm"]


def test_the_heartbeat_does_not_go_on_before_a_lost_disarm_has_come(board, supervised, armed):
    supervised.deaf, board.lost = True, FOR_GOOD
    with pytest.raises(SilentError):
        armed.disarm()
    assert supervised.state == State.ARMED
    supervised.deaf, board.lost = False, 0
    supervised.heard.clear()
    armed.renew()
    assert supervised.heard[0] == "disarm"
    assert supervised.state == State.DISARMED
    armed.renew()
    assert supervised.heard == ["disarm"]


def test_a_disarm_that_is_lost_is_asked_again(supervised, armed):
    supervised.lost_at = "disarm"
    armed.disarm()
    assert supervised.heard == ["arm", "disarm", "disarm"]


def test_an_axis_that_drives_is_not_homed(supervised, armed):
    with pytest.raises(NotReadyError, match="is ARMED: disarm it before it is homed"):
        armed.home(seconds=0.1)
    assert supervised.heard == ["arm"]


def reset(board: TwinBoard) -> None:
    """Reset a board, which is ready again at once."""
    board.server.file.__init__(board.server.file.design)
    board.show(ready=1, live=1)


def test_a_reset_is_found_out_though_all_words_were_written_again(board, supervised, axis):
    axis.preload(5e-3)
    axis.disarm()
    reset(board)
    supervised.heard.clear()
    with pytest.raises(ChangedError, match="does not have this program's last beat: it was reset"):
        axis.set(wall_stiffness=2e3)
    with pytest.raises(ChangedError):
        axis.arm()
    assert "arm" not in supervised.heard
    assert beats(board) == 0


def test_a_reset_ends_the_heartbeat(board, axis):
    axis.renew()
    reset(board)
    with pytest.raises(ChangedError, match="does not have this program's last beat"):
        axis.sleep(PATIENCE_S)
    assert beats(board) == 0


def test_a_beat_whose_answer_was_lost_is_no_reset(board, axis):
    axis.renew()
    for _ in range(3):
        axis._heartbeat.rest()
        before = beats(board)
        lose_the_answer_of_a_beat(board)
        axis.renew()
        axis._heartbeat.rest()
        assert beats(board) >= before + 2


def test_a_reset_behind_a_beat_whose_answer_was_lost_is_found_out(board, axis):
    axis.renew()
    axis._heartbeat.rest()
    before = beats(board)

    def lose_it_and_reset(pulses: tuple[str, ...]) -> None:
        if beats(board) == before + 1:
            board.lost, board.react = 1, lambda pulses: None
            reset(board)

    board.react = lose_it_and_reset
    with pytest.raises(ChangedError, match="does not have this program's last beat"):
        axis.renew()
    assert beats(board) == 0


@pytest.mark.parametrize("fault", ["lost", "spoilt"])
def test_one_lost_answer_leaves_no_gap_that_would_trip(board, supervised, fault):
    """Of some runs, for the machine may be busy in one: this host is not patient."""
    gaps = []
    for _ in range(5):
        numbers, times = [], []

        def hear(pulses: tuple[str, ...], numbers: list[int] = numbers, times: list[float] = times) -> None:
            if beats(board) not in numbers[-1:]:
                numbers.append(beats(board))
                times.append(time.monotonic())
                if len(times) == 3:
                    setattr(board, fault, 1)

        with connect(board.name) as axis, suppress(HostError):
            watchdog_s = axis.supervisor.watchdog
            board.react = hear
            axis.sleep(3 * watchdog_s)
        board.react = lambda pulses: None
        if len(times) > 3:
            gaps.append(max(np.diff(times)))
    assert min(gaps) < 0.8 * watchdog_s


def lose_the_answer_of_a_beat(board: TwinBoard) -> None:
    """Let the answer of the next beat be lost, and no other."""
    before = beats(board)

    def react(pulses: tuple[str, ...]) -> None:
        if beats(board) == before + 1:
            board.lost, board.react = 1, lambda pulses: None

    board.react = react


def test_leaving_disarms_though_the_application_failed(supervised, board):
    def fail() -> None:
        with connect(board.name, **PATIENT) as axis:
            axis.arm()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert supervised.heard[-1] == "disarm"
    assert supervised.state == State.DISARMED


def test_a_trip_between_the_look_and_the_arming_is_named(board, supervised, axis):
    emergency = next(bit for bit, cause in enumerate(CAUSES) if cause.name == "emergency_stop")
    board.server.file.refusing = frozenset({"arm"})
    pulse = axis.pulse

    def late(name: str) -> None:
        board.show(state=State.TRIPPED, ready=0, latched=1 << emergency, first=1 << emergency)
        pulse(name)

    axis.pulse = late
    with pytest.raises(TrippedError, match="tripped before it was armed: emergency_stop"):
        axis.arm()


def test_a_loop_that_opens_as_the_axis_is_armed_is_named(board, supervised, axis):
    board.react = lambda pulses: None
    with pytest.raises(NotReadyError, match="disarmed at once: the loop of drive_enable opened"):
        axis.arm()


@pytest.mark.parametrize("act", ["close", "disarm"])
def test_one_who_closes_or_disarms_while_another_thread_arms_has_the_last_word(board, supervised, axis, act):
    begun, done = threading.Event(), threading.Event()
    pulse = axis.pulse

    def held_up(name: str) -> None:
        if name == "arm":
            begun.set()
            assert done.wait(PATIENCE_S)
        pulse(name)

    axis.pulse = held_up
    with ThreadPoolExecutor(1) as other:
        arming = other.submit(axis.arm)
        assert begun.wait(PATIENCE_S)
        axis._may_drive = False  # as it is at first
        getattr(axis, act)()
        done.set()
        with pytest.raises(HostError):
            arming.result()
    assert "arm" not in supervised.heard
    assert supervised.state == State.DISARMED


def test_an_axis_that_was_disarmed_can_be_armed_again(supervised, axis):
    axis.disarm()
    axis.arm()
    assert supervised.state == State.ARMED


def test_a_heartbeat_that_fails_says_why(axis, monkeypatch):
    axis.renew()

    def fails() -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr(axis._heartbeat, "_beat", fails)
    with pytest.raises(HostError, match=r"the heartbeat fails: ZeroDivisionError\('oops'\)"):
        axis.sleep(PATIENCE_S)


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1.0])
def test_a_time_that_is_none_is_refused(board, axis, seconds):
    before = len(board.requests)
    for wait in (
        lambda: axis.sleep(seconds),
        lambda: axis.watch(seconds),
        lambda: axis.watch(0.1, seconds),
        lambda: axis.home(seconds=seconds),
        lambda: axis.capture.until("DONE", seconds),
    ):
        with pytest.raises(FieldError, match=r"must be 0 to 1e\+09, not "):
            wait()
    with pytest.raises(TypeError, match="seconds must be a number, not '5'"):
        axis.sleep("5")
    assert len(board.requests) == before


def test_what_is_latched_is_acknowledged_exactly_as_it_is_read(board, supervised, axis):
    board.show(state=State.TRIPPED, latched=5, first=1)
    acknowledged = []

    def react(pulses: tuple[str, ...]) -> None:
        if "acknowledge" in pulses:
            acknowledged.append(board.server.file.active["acknowledged"])
            board.show(state=State.DISARMED, latched=0)

    board.react = react
    axis.acknowledge()
    assert acknowledged == [5]
    axis.acknowledge()
    assert acknowledged == [5]


def test_what_is_not_tripped_is_acknowledged_without_an_error(supervised, axis):
    axis.acknowledge(axis.trip)
    assert supervised.heard == []
