"""A capture as tabs ask for it: begun, watched, and read between the looks at a board; and what ends it."""

import dataclasses
from contextlib import closing

import numpy as np
import pytest
from host.twin_board import TwinBoard

from hardwall.host.connect import connect
from hardwall.host.panel.driver import Driver
from hardwall.host.panel.recorder import IDLE, NOW, READING, Wish
from hardwall.model.axis.capture import DONE, RECORD_REGISTERS, STATES, WAITING
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.checks import FieldError
from support.processes import wait_until

TAB, OTHER = "tab", "other"


@pytest.fixture
def started(board) -> list[dict[str, int]]:
    """The words of every capture that was started; each is FILLING."""
    found, react = [], board.react

    def follow(pulses: tuple[str, ...]) -> None:
        react(pulses)
        if "capture_start" in pulses:
            found.append(dict(board.server.file.active))
            board.show(capture_state=STATES.index("FILLING"))
        if "capture_trigger" in pulses:
            found.append({"by_hand": 1})

    board.react = follow
    return found


def done(board, registers, clocks: int) -> np.ndarray:
    """Let a capture be done, of records so many clocks apart; return their counts."""
    count = registers.capture.records
    cells = np.zeros((count, RECORD_REGISTERS), np.int64)
    cells[:, 1], cells[:, 7] = np.arange(count) % 1000, np.arange(count) * clocks & 0xFFFF
    board.server.file.capture = cells.ravel().tolist()
    board.show(capture_state=DONE, capture_place=7)
    return cells[:, 1]


def test_a_trigger_of_a_person_is_not_given_late(driver, board, started):
    driver.record(TAB, Wish(NOW))
    wait_until(lambda: driver.view.recording.state == "FILLING")
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    assert driver.view.recording.state == IDLE
    board.show(capture_state=WAITING)
    board.lost = 0
    wait_until(lambda: driver.view.status)
    looks = driver.samples_since(0)[0]
    wait_until(lambda: driver.samples_since(0)[0] > looks + 5)
    assert {"by_hand": 1} not in started


def test_a_capture_of_an_event_outlasts_a_silence(driver, board, started):
    driver.record(TAB, Wish("contact"))
    wait_until(lambda: driver.view.recording.state == "FILLING")
    board.lost = 1 << 30
    wait_until(lambda: driver.view.status is None)
    board.show(capture_state=WAITING)
    board.lost = 0
    wait_until(lambda: driver.view.recording.state == "WAITING")


def test_a_capture_is_begun_and_read_in_parts_between_looks(driver, board, registers, started):
    least_s, most_s = driver.view.span_s
    assert least_s == pytest.approx(registers.capture.records / registers.spec.sample_hz)
    assert most_s == 4095 * least_s
    driver.record(TAB, Wish("rise", 2.5 * least_s, 0.5, 3e-3))
    wait_until(lambda: driver.view.recording.state == "FILLING")
    (words,) = started
    assert words["capture_sources"] == 0b100
    assert (words["capture_decimation"], words["capture_before"]) == (3, registers.capture.records // 2)
    assert words["capture_level"] == 3000
    board.show(capture_state=WAITING)
    wait_until(lambda: driver.view.recording.state == "WAITING")
    counts = done(board, registers, 3 * registers.spec.clocks_per_sample)
    wait_until(lambda: driver.view.recording.state == READING)
    number, _ = driver.samples_since(0)
    wait_until(lambda: driver.view.recording.number == 1)
    # The board was looked at meanwhile.
    assert driver.samples_since(0)[0] > number + 20
    recording = driver.view.recording
    assert (recording.state, recording.captured.place) == (IDLE, 7)
    np.testing.assert_array_equal(recording.captured.position_m, counts * registers["count"].lsb)


def test_a_capture_has_the_acceleration_if_it_is_wanted(accelerated_board):
    board, started = accelerated_board, []
    board.react = lambda pulses: started.append(dict(board.server.file.active)) if "capture_start" in pulses else None
    with closing(Driver(lambda: connect(board.name, answer_s=2.0))) as driver:
        for wanted in (True, False):
            driver.record(TAB, Wish(acceleration=wanted))
            wait_until(lambda wanted=wanted: started and started[-1]["capture_acceleration"] == wanted)


def test_a_capture_now_is_triggered_as_soon_as_it_waits(driver, board, started):
    driver.record(TAB, Wish("now"))
    wait_until(lambda: driver.view.recording.state == "FILLING")
    assert len(started) == 1
    assert started[0]["capture_sources"] == 0
    board.show(capture_state=WAITING)
    wait_until(lambda: {"by_hand": 1} in started)


def test_a_capture_that_fails_is_said_and_the_next_one_is_taken(driver, board, registers, started):
    driver.record(TAB, Wish())
    wait_until(lambda: started)
    done(board, registers, registers.spec.clocks_per_sample)
    wait_until(lambda: driver.view.recording.state == READING)
    board.server.file.capture = None
    wait_until(lambda: "was started again" in driver.view.said)
    assert driver.view.recording.state == IDLE
    # A board that was reset has forgotten it.
    driver.record(TAB, Wish())
    wait_until(lambda: driver.view.recording.state == "FILLING")
    board.show(capture_state=0)
    wait_until(lambda: driver.view.recording.state == IDLE)
    driver.record(TAB, Wish(span_s=1e9))
    wait_until(lambda: driver.view.said.startswith("span_s must be 0 to "))
    board.hang_up()
    wait_until(lambda: not driver.view.connected)
    assert driver.view.recording.state == IDLE


def test_another_tab_begins_nothing_while_one_holds_the_board(driver, board, started):
    driver.ping(TAB)
    driver.arm(TAB)
    wait_until(lambda: driver.ping(TAB) or driver.view.holder == TAB)
    for ask in (lambda: driver.record(OTHER, Wish()), lambda: driver.home(OTHER, 0.0)):
        ask()
        wait_until(lambda: driver.ping(TAB) or "another tab armed" in driver.view.said)
        driver.set(TAB, "wall_damping", 1.0)
        wait_until(lambda: driver.ping(TAB) or not driver.view.said)
    assert started == []
    driver.record(TAB, Wish())
    wait_until(lambda: driver.ping(TAB) or started)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trigger": "noise"}, "trigger must be one of contact, trip, rise, fall, now, not 'noise'"),
        ({"before": 1.5}, "before must be 0 to 1, not 1.5"),
        ({"before": float("nan")}, "before must be 0 to 1, not nan"),
    ],
)
def test_a_wish_that_cannot_be_is_refused(changes, message):
    with pytest.raises(FieldError, match=message):
        dataclasses.replace(Wish(), **changes)


def test_a_board_without_a_memory_spans_nothing(registers):
    with TwinBoard(RegisterMap(registers.spec, 0)) as bare:
        driver = Driver(lambda: connect(bare.name))
        assert driver.view.span_s == (0.0, 0.0)
        driver.close()
