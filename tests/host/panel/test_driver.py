"""The driver of a board for tabs: who may do what, the lease that follows the tab that armed, and what is shown."""

import time
from collections.abc import Callable
from contextlib import closing

import pytest

from hardwall.host.connect import connect, share
from hardwall.host.errors import HostError
from hardwall.host.heartbeat import LEASE_S
from hardwall.host.panel.driver import Driver
from hardwall.host.panel.recorder import Wish
from hardwall.host.panel.view import View
from hardwall.host.panel.wishes import STALE_S
from hardwall.host.status import State
from hardwall.model.axis.supervisor import TRIPPED
from support.processes import wait_until

TAB, OTHER = "tab", "other"
STOP = 1 << 13
"""The cause emergency_stop."""
DISARM, COMMIT, HEARTBEAT = b"\0\x7a", b"\0\x7f", b"\0\xc0"
"""Addresses, as requests have them."""


def seen(driver: Driver, so: Callable[[View], object], tab: str = TAB) -> View:
    """Wait until the view is as expected, while a tab lives."""

    def happens() -> object:
        driver.ping(tab)
        return so(driver.view)

    wait_until(happens)
    return driver.view


def armed(driver: Driver, tab: str = TAB) -> None:
    driver.ping(tab)
    driver.arm(tab)
    seen(driver, lambda view: view.holder == tab and view.status.state is State.ARMED, tab)


def test_it_shows_what_the_board_does(driver, board):
    board.show(count=3, driven=-5)
    view = seen(driver, lambda view: view.status.force_n < 0)
    assert view.status.force_n == pytest.approx(-5e-3)
    assert view.connected
    assert not view.lost
    number, samples = driver.samples_since(0)
    assert number == len(samples) > 0
    wait_until(lambda: driver.samples_since(number)[1])
    assert driver.samples_since(number)[1][0].position_m == pytest.approx(3 * board_count_m(driver))
    assert samples[-1].acceleration_m_per_s2 is None
    assert driver.samples_since(driver.samples_since(0)[0] + 5)[1] == []


def test_it_keeps_the_acceleration_of_a_board_that_has_one(accelerated_board, accelerated):
    accelerated_board.show(acceleration=-5)
    with closing(Driver(lambda: connect(accelerated_board.name, answer_s=2.0))) as driver:
        wait_until(lambda: driver.samples_since(0)[1])
        assert driver.samples_since(0)[1][-1].acceleration_m_per_s2 == -5 * accelerated["acceleration"].lsb


def board_count_m(driver: Driver) -> float:
    return driver.view.device.registers["count"].lsb


def test_the_tab_that_armed_keeps_it_armed_and_its_silence_disarms(driver, board):
    armed(driver)
    for _ in range(2):
        before, until = beats(board), time.monotonic() + 1.2 * LEASE_S
        seen(driver, lambda _, until=until: time.monotonic() > until)
        assert beats(board) > before
    assert driver.view.holder == TAB
    assert driver.view.status.state is State.ARMED
    # Others that live do not keep it.
    seen(driver, lambda view: view.status.state is State.DISARMED, OTHER)
    assert driver.view.holder is None
    assert "silent for 0.5 s" in driver.view.said
    # And no beat follows.
    time.sleep(LEASE_S)
    before = beats(board)
    later = time.monotonic() + LEASE_S
    seen(driver, lambda _: time.monotonic() > later)
    assert beats(board) == before


def beats(board) -> int:
    return sum(each[1] == 16 and each[2:4] == HEARTBEAT for each in list(board.requests))


def test_a_tab_that_goes_disarms_what_it_armed_and_nothing_else(driver):
    armed(driver)
    driver.leave(OTHER)
    driver.ping(TAB)
    time.sleep(0.1)
    assert driver.view.holder == TAB
    driver.leave(TAB)
    wait_until(lambda: driver.view.status.state is State.DISARMED)
    # It is no silence.
    assert not driver.view.said


def test_a_tab_that_is_not_heard_cannot_arm(driver, board):
    driver.arm(TAB)
    wait_until(lambda: driver.view.said)
    assert driver.view.said == "the tab that asks to arm does not answer"
    assert driver.view.status.state is State.DISARMED


def test_another_tab_sets_nothing_while_one_holds_but_it_disarms(driver):
    armed(driver)
    driver.set(OTHER, "wall_stiffness", 500.0)
    seen(driver, lambda view: "another tab armed the board" in view.said)
    assert driver.view.values["wall_stiffness"] == 0
    driver.set(TAB, "wall_stiffness", 500.0)
    seen(driver, lambda view: view.values["wall_stiffness"] > 0)
    driver.disarm()
    wait_until(lambda: driver.view.status.state is State.DISARMED)
    driver.set(OTHER, "wall_stiffness", 900.0)
    wait_until(lambda: driver.view.values["wall_stiffness"] == pytest.approx(900, abs=4))


def test_what_the_board_does_not_take_is_said_and_shown_as_it_is(driver):
    before = driver.view
    driver.set(TAB, "wall_stiffness", 1e9)
    wait_until(lambda: driver.view.said)
    assert driver.view.said.startswith("wall_stiffness must be 0 to ")
    assert driver.view.values["wall_stiffness"] == before.values["wall_stiffness"]
    assert driver.view.revision > before.revision
    driver.set(TAB, "wall_stiffness", 800.0)
    wait_until(lambda: driver.view.values["wall_stiffness"] == pytest.approx(800, abs=4))
    assert not driver.view.said


def test_what_is_said_is_said_for_a_while(driver, monkeypatch):
    driver.arm(TAB)
    wait_until(lambda: driver.view.said)
    time.sleep(0.1)
    assert driver.view.said
    monkeypatch.setattr("hardwall.host.panel.driver.SAID_S", 0.0)
    wait_until(lambda: not driver.view.said)


def test_only_the_causes_that_a_tab_shows_are_acknowledged(driver, board):
    board.show(state=TRIPPED, latched=STOP | 1, first=STOP)
    wait_until(lambda: driver.view.status.trip)
    driver.acknowledge(STOP)
    wait_until(lambda: "the causes have changed since" in driver.view.said)
    assert driver.view.status.state is State.TRIPPED
    driver.acknowledge(STOP | 1)
    wait_until(lambda: driver.view.status.state is State.DISARMED)
    assert not driver.view.said
    driver.acknowledge(STOP)
    assert driver.view.status.state is State.DISARMED


def test_a_trip_ends_the_hold_of_the_tab(driver, board):
    armed(driver)
    board.show(state=TRIPPED, latched=STOP, first=STOP)
    view = seen(driver, lambda view: view.status.trip)
    assert view.holder is None


def test_what_was_asked_of_a_silent_board_is_not_done_late_but_a_disarm_is(driver, board):
    board.late_s = STALE_S + 0.4
    time.sleep(0.1)
    driver.arm(TAB)
    seen(driver, lambda view: "nothing was done" in view.said)
    assert driver.view.status.state is State.DISARMED
    armed(driver)
    board.late_s = STALE_S + 0.4
    time.sleep(0.1)
    driver.disarm()
    seen(driver, lambda view: view.status.state is State.DISARMED)


def test_a_word_of_a_board_that_is_gone_is_not_written_to_the_next_one(driver, board):
    before = driver.view.values["wall_stiffness"]
    board.hang_up()
    wait_until(lambda: not driver.view.connected)
    revision = driver.view.revision
    driver.set(TAB, "wall_stiffness", 150e3)
    wait_until(lambda: driver.view.said)
    assert driver.view.said == "no board answers: nothing was done"
    # The page shows anew what the board uses.
    assert driver.view.revision > revision
    driver.connect()
    wait_until(lambda: driver.view.connected)
    looks = driver.samples_since(0)[0]
    wait_until(lambda: driver.samples_since(0)[0] > looks + 3)
    assert driver.view.values["wall_stiffness"] == before
    assert commits(board) == 0


def commits(board) -> int:
    """Return how many requests have written words and their commit."""
    return sum(each[1] == 16 and each[2:4] == COMMIT for each in list(board.requests))


@pytest.mark.parametrize("ask", ["set", "arm", "home", "record"])
def test_what_was_asked_of_a_board_that_was_silent_while_armed_is_not_done_late(driver, board, ask):
    armed(driver)
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    before = len(board.requests)
    said = "no board answers: nothing was done"
    {
        "set": lambda: driver.set(TAB, "wall_stiffness", 150e3),
        "arm": lambda: (driver.ping(TAB), driver.arm(TAB)),
        "home": lambda: driver.home(TAB, 0.0),
        "record": lambda: driver.record(TAB, Wish()),
    }[ask]()
    wait_until(lambda: driver.view.said == said)
    board.lost = 0
    seen(driver, lambda view: view.status)
    seen(driver, lambda view: view.status.state is State.DISARMED, OTHER)
    # Nothing was written but beats and a disarm.
    written = {each[2:4] for each in board.requests[before:] if each[1] == 16}
    assert written <= {HEARTBEAT, DISARM}


def test_a_wish_that_came_late_is_dropped(driver, board):
    driver.set(TAB, "wall_stiffness", 900.0, time.monotonic() - 1.05 * STALE_S)
    wait_until(lambda: driver.view.said == "the board did not answer in time: nothing was done")
    assert driver.view.values["wall_stiffness"] == 0
    driver.set(TAB, "wall_stiffness", 900.0, time.monotonic() + 1e9)
    wait_until(lambda: driver.view.values["wall_stiffness"] == pytest.approx(900, abs=4))


def test_a_request_that_waits_for_its_board_does_not_go_out_late(driver, board, monkeypatch):
    """A board that falls silent just before a word is asked again, but not for as long as for a look."""
    monkeypatch.setattr("hardwall.host.panel.driver.DONE_S", 0.0)
    driver.set(TAB, "wall_stiffness", 900.0, time.monotonic())
    wait_until(lambda: "the rest was not sent" in driver.view.said)
    assert commits(board) == 0


def test_a_homing_is_left_when_the_board_falls_silent(driver, board):
    driver.home(TAB, 0.0)
    board.show(index_armed=1)
    wait_until(lambda: driver.view.homing)
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    assert not driver.view.homing
    assert driver.view.said == "the board did not answer: it is not homed any more"
    board.lost = 0
    wait_until(lambda: driver.view.status)
    assert not driver.view.homing


def test_a_board_that_is_gone_is_said_and_had_again(driver, board):
    armed(driver)
    board.hang_up()
    wait_until(lambda: not driver.view.connected)
    assert driver.view.status is None
    assert driver.view.holder is None
    assert "is gone" in driver.view.lost
    driver.connect()
    wait_until(lambda: driver.view.connected)
    assert driver.view.status
    assert not driver.view.lost
    driver.disarm()


def test_a_silent_board_is_asked_again(driver, board):
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    assert driver.view.connected
    assert "nothing answers" in driver.view.lost
    board.lost = 0
    wait_until(lambda: driver.view.status)
    assert not driver.view.lost


def test_registers_of_a_board_that_falls_silent_are_not_shown_as_if_they_were_of_now(driver, board):
    driver.registers.ask()
    wait_until(lambda: driver.registers.ask() or driver.registers.reading)
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    assert driver.registers.reading is None
    board.lost = 0
    wait_until(lambda: driver.registers.ask() or driver.registers.reading)


def test_a_fault_of_its_own_is_no_old_state(driver, monkeypatch):
    def fails(*_: object) -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr(driver, "_look", fails)
    wait_until(lambda: driver.view.status is None)
    assert driver.view.lost == "the panel failed: ZeroDivisionError('oops')"


def test_its_end_disarms(driver, board):
    armed(driver)
    driver.close()
    assert board.server.file.status["state"] == State.DISARMED


def test_a_board_that_is_not_there_is_an_error_at_the_beginning():
    def fails():
        raise HostError("no")

    with pytest.raises(HostError, match="no"):
        Driver(fails)


def test_beside_another_program_it_shows_whose_the_lease_is_and_may_disarm(board):
    with share(board.name, answer_s=2.0) as relay, closing(Driver(lambda: connect(relay.name, answer_s=2.0))) as driver:
        seen(driver, lambda view: view.lease == "")
        with connect(relay.name, answer_s=2.0) as other:
            other.set(wall_stiffness=500.0)
            other.arm()
            seen(driver, lambda view: view.lease == relay.holder != "" and view.status.state is State.ARMED)
            # What the other one has written is shown, and what a tab wants is refused and not shown.
            assert driver.view.values["wall_stiffness"] == other.get("wall_stiffness")
            driver.set(TAB, "wall_stiffness", 900.0)
            seen(driver, lambda view: "is held by" in view.said)
            assert driver.view.values["wall_stiffness"] == other.get("wall_stiffness") < 600.0
            driver.disarm()
            seen(driver, lambda view: view.status.state is State.DISARMED)
        seen(driver, lambda view: view.lease == "")
        # What the tab's program read is older than what the other one wrote: it comes again.
        driver.set(TAB, "wall_stiffness", 900.0)
        seen(driver, lambda view: not view.connected)
        assert "another program has written to the board" in driver.view.lost
        driver.connect()
        seen(driver, lambda view: view.connected)
        driver.set(TAB, "wall_stiffness", 900.0)
        seen(driver, lambda view: view.values["wall_stiffness"] > 800.0)
