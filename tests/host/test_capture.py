"""Captures: what is asked of the board, and what its records become in SI units."""

from collections.abc import Iterator

import numpy as np
import pytest

from hardwall.host.capture import PART_RECORDS
from hardwall.host.connect import connect
from hardwall.host.errors import ForeignError, NotReadyError
from hardwall.model.axis.axis import Axis
from hardwall.model.axis.capture import DONE, STATE_FLAGS, WAITING
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.checks import FieldError
from hardwall.sim.scene.load import load
from host.twin_board import TwinBoard
from stimuli.captures import records, window
from support.virtual_boards import ACCELERATED, PACE, VirtualBoard, running

PLACE = 100


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(ACCELERATED, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


def hold(board: TwinBoard, words: dict[str, np.ndarray]) -> None:
    """Let a board hold records, and show that they are done."""
    board.server.file.capture = window(words)
    board.show(capture_state=DONE, capture_place=PLACE)


def test_records_become_arrays_in_si_units(board, axis, registers):
    decimation, told = 7, []
    words = records(registers, decimation)
    hold(board, words)
    axis.set(capture_decimation=decimation)
    found = axis.capture.read(told.append)
    assert axis.capture.records == len(found.time_s) == registers.capture.records > 2 * PART_RECORDS
    assert told[-1] == axis.capture.records
    for name, array in (("count", found.position_m), ("velocity", found.velocity_m_per_s), ("driven", found.force_n)):
        np.testing.assert_array_equal(array, words[name] * registers[name].lsb)
    np.testing.assert_array_equal(found.flags, words["flags"])
    period_s = decimation / registers.spec.sample_hz
    np.testing.assert_allclose(found.time_s, (np.arange(len(found.time_s)) - PLACE) * period_s, rtol=1e-12)
    assert found.acceleration_m_per_s2 is None
    assert found.flag_names[: len(STATE_FLAGS)] == STATE_FLAGS
    assert len(found.flag_names) == len(registers.capture.flags)
    np.testing.assert_array_equal(found.flag("tripped"), words["flags"] >> 1 & 1)
    with pytest.raises(FieldError, match=r"flag must be one of armed, tripped, contact, live, .*'x'"):
        found.flag("x")
    assert (found.place, found.identity) == (PLACE, registers.identity)


def test_who_reads_a_capture_lives(board, axis, registers, monkeypatch):
    hold(board, records(registers, 1))
    renewed = []
    monkeypatch.setattr(axis, "renew", lambda: renewed.append(len(board.requests)))
    axis.capture.read()
    # Behind every request for records; a slow line takes longer for all of them than a lease lasts.
    assert len(set(renewed)) == -(-registers.capture.records // PART_RECORDS)


def test_who_has_no_lease_may_read_a_capture(board, axis, registers):
    hold(board, records(registers, 1))
    before = dict(board.server.file.active)
    assert len(axis.capture.read(lives=False).time_s) == registers.capture.records
    assert board.server.file.active == before


def test_a_capture_can_be_saved(board, axis, registers, tmp_path):
    hold(board, records(registers, 1))
    found = axis.capture.read()
    found.save(tmp_path / "capture.npz")
    with np.load(tmp_path / "capture.npz") as saved:
        assert set(saved) == set(vars(found)) - {"acceleration_m_per_s2"}
        np.testing.assert_array_equal(saved["velocity_m_per_s"], found.velocity_m_per_s)
        assert saved["identity"] == registers.identity


def test_records_may_have_the_acceleration(accelerated_board, accelerated_axis, accelerated, tmp_path):
    board, axis, started = accelerated_board, accelerated_axis, []
    board.react = lambda pulses: started.append(dict(board.server.file.active)) if "capture_start" in pulses else None
    words = records(accelerated, 1, "acceleration")
    hold(board, words)
    axis.capture.start(acceleration=True)
    found = axis.capture.read()
    assert found.velocity_m_per_s is None
    np.testing.assert_array_equal(found.acceleration_m_per_s2, words["acceleration"] * accelerated["acceleration"].lsb)
    found.save(tmp_path / "capture.npz")
    with np.load(tmp_path / "capture.npz") as saved:
        assert set(saved) == set(vars(found)) - {"velocity_m_per_s"}
        np.testing.assert_array_equal(saved["acceleration_m_per_s2"], found.acceleration_m_per_s2)
    # Without a wish, the next one has the velocity again.
    axis.capture.start()
    assert [active["capture_acceleration"] for active in started] == [1, 0]
    found = axis.capture.read()
    assert found.acceleration_m_per_s2 is None
    np.testing.assert_array_equal(found.velocity_m_per_s, words["acceleration"] * accelerated["velocity"].lsb)


def test_a_board_without_an_acceleration_captures_none(board, axis):
    started = []
    board.react = started.extend
    with pytest.raises(NotReadyError, match="the board has no acceleration: its estimator estimates only the velocity"):
        axis.capture.start(acceleration=True)
    assert started == []


def test_the_acceleration_of_a_board_is_the_words_of_the_model(virtual):
    """From the power-up on: the handle rests before the capture, and moves in it."""
    spec, seen = load("seed-2011", ACCELERATED).spec, []
    with connect(virtual.tcp, pace=PACE) as axis:
        # The first count triggers.
        axis.capture.start("rise", before=100, level_m=spec.count_m, acceleration=True)
        axis.capture.until("WAITING", 60.0)
        virtual.order("hold 3")
        while axis.capture.state != "DONE":
            seen.append(axis.status)
        captured, trigger = axis.capture.read(), axis.read("capture_stamp")
        registers = axis.device.registers
    counts = np.round(captured.position_m / registers["count"].lsb).astype(np.int64)
    record = Axis(spec).run(counts)
    words = np.round(captured.acceleration_m_per_s2 / registers["acceleration"].lsb).astype(np.int64)
    np.testing.assert_array_equal(words, record.acceleration)
    np.testing.assert_allclose(captured.acceleration_m_per_s2, record.acceleration_m_per_s2, rtol=1e-12)
    assert np.count_nonzero(np.diff(words)) > 1000
    # The status is the acceleration of the record at its time, or of a neighbour.
    found = 0
    for status in seen:
        clock = round(status.stamp_s * spec.clock_hz) - trigger
        near = captured.place + clock // spec.clocks_per_sample
        if 0 < near < len(words) - 1:
            assert status.acceleration_m_per_s2 in captured.acceleration_m_per_s2[near - 1 : near + 2]
            found += 1
    assert found > 0


def test_records_that_do_not_follow_each_other_are_refused(board, axis, registers):
    words = records(registers, 1)
    words["stamp"][40:] += registers.spec.clocks_per_sample
    words["stamp"] &= 0xFFFF
    hold(board, words)
    with pytest.raises(ForeignError, match="must be 50 clocks apart, and record 40 of the capture is not: 100"):
        axis.capture.read()


def test_what_is_asked_for_is_written_before_the_start(board, axis, registers):
    started = []
    board.react = lambda pulses: started.append(dict(board.server.file.active)) if "capture_start" in pulses else None
    axis.capture.start(("trip", "rise"), before=3, decimation=5, level_m=-2e-3)
    (active,) = started
    assert active["capture_sources"] == 0b0110
    assert (active["capture_before"], active["capture_decimation"]) == (3, 5)
    assert active["capture_level"] == -2000
    axis.capture.start()
    assert started[1]["capture_sources"] == 1
    axis.capture.start("fall")
    assert started[2]["capture_sources"] == 0b1000
    assert started[1]["capture_before"] == registers.capture.records // 4


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"sources": ("contact", "noise")}, "sources must be of contact, trip, rise, fall, not 'noise'"),
        ({"before": -1}, "before must be 0 to 2047, not -1"),
        ({"before": 2048}, "before must be 0 to 2047, not 2048"),
        ({"decimation": 0}, "capture_decimation must be 1 to 4095, not 0"),
        ({"level_m": 7.0}, "capture_level must be -1.04858 to 1.04858 m, not 7.0"),
    ],
)
def test_what_cannot_be_asked_for_starts_nothing(board, axis, asked, message):
    started = []
    board.react = started.extend
    with pytest.raises(FieldError, match=message):
        axis.capture.start(**asked)
    assert started == []


def test_what_is_not_done_is_not_read(board, axis):
    board.show(capture_state=WAITING)
    assert axis.capture.state == "WAITING"
    with pytest.raises(NotReadyError, match="the capture is WAITING: wait until it is DONE"):
        axis.capture.read()
    with pytest.raises(TimeoutError, match=r"the capture is not DONE in 0.05 s: it is WAITING"):
        axis.capture.until("DONE", 0.05)
    axis.capture.until("FILLING", 0.0)


def test_a_capture_that_is_started_again_meanwhile_is_not_mixed(board, axis, registers):
    hold(board, records(registers, 1))
    with pytest.raises(NotReadyError, match="the capture was started again while it was read"):
        axis.capture.read(lambda done: setattr(board.server.file, "capture", None))


def test_a_board_without_a_memory_says_so(registers):
    with TwinBoard(RegisterMap(registers.spec, 0)) as bare, connect(bare.name) as axis:
        assert axis.capture.records == 0
        for act in (axis.capture.start, axis.capture.trigger, axis.capture.read, lambda: axis.capture.state):
            with pytest.raises(NotReadyError, match="the board has no capture memory"):
                act()
