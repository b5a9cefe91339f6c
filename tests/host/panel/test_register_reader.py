"""Reading all registers for a page: only while it is asked for, at a rate of the line, and without a write."""

import time

import pytest

from hardwall.host.connect import connect
from hardwall.host.panel.register_reader import ASKED_S, LEAST_S, SHARE, RegisterReader, period_s
from hardwall.host.panel.wishes import STALE_S
from hardwall.model.register import Kind
from support.processes import wait_until

READS = 3
"""The function of a request that reads."""


@pytest.fixture
def axis(board):
    with connect(board.name, answer_s=2.0) as found:
        yield found


def whole(reader: RegisterReader, axis) -> None:
    """Ask, and step until all registers are read anew."""
    before = reader.reading
    reader.ask()
    wait_until(lambda: reader.step(axis) or (reader.reading is not None and reader.reading is not before))


def test_every_register_but_pulses_is_read_with_its_word(axis, board, registers):
    board.show(count=-7)
    reader = RegisterReader()
    whole(reader, axis)
    words = reader.reading.words
    assert set(words) == {each.name for each in registers.registers if each.kind is not Kind.PULSE}
    assert words["count"] == -7
    assert words["active_wall_stiffness"] == 0
    assert words["clock_hz"] == registers.spec.clock_hz
    assert f"{words['identity_high']:08x}{words['identity_low']:08x}" == registers.identity


def test_nothing_is_written_and_a_step_is_one_request_no_longer_than_a_look(axis, board):
    board.requests.clear()
    axis.read_registers(0x20, 0x40)
    reader = RegisterReader()
    reader.ask()
    for _ in range(4):
        before = len(board.requests)
        reader.step(axis)
        assert len(board.requests) == before + 1
    whole(reader, axis)
    assert {request[1] for request in board.requests} == {READS}
    assert max(int.from_bytes(request[4:6], "big") for request in board.requests) <= 0x40


def test_without_anybody_who_looks_nothing_is_read(axis, board, monkeypatch):
    reader = RegisterReader()
    board.requests.clear()
    reader.step(axis)
    reader.ask(time.monotonic() - 1.1 * STALE_S)
    reader.step(axis)
    assert board.requests == []
    whole(reader, axis)
    monkeypatch.setattr("hardwall.host.panel.register_reader.ASKED_S", 0.0)
    before = len(board.requests)
    reader.step(axis)
    assert reader.reading is None
    assert len(board.requests) == before


def test_a_tab_that_asks_twice_a_second_is_heard_and_one_that_hangs_is_not_for_long():
    assert 2 * 0.5 < ASKED_S < 5


def test_the_next_reading_waits_for_its_time(axis, board):
    reader = RegisterReader()
    whole(reader, axis)
    first, before = reader.reading, len(board.requests)
    for _ in range(5):
        reader.ask()
        reader.step(axis)
    assert len(board.requests) == before
    assert reader.reading is first
    began = time.monotonic()
    whole(reader, axis)
    assert time.monotonic() - began > LEAST_S / 2
    assert reader.reading.number == 1


@pytest.mark.parametrize(("baud", "slower"), [(921_600, False), (115_200, True), (9_600, True)])
def test_the_rate_is_that_of_the_line(board, baud, slower):
    with connect(board.name, baud, answer_s=2.0) as axis:
        reader = RegisterReader()
        whole(reader, axis)
        apart_s = reader.reading.period_s
        # Seven requests of 8 bytes, answers of 5, and 2 a register; 10 bits a byte, and 1500 bits to think each.
        sizes = [14, 28, 28, 8, 24, 24, 40]
        line_s = sum(10 * (13 + 2 * size) + 1500 for size in sizes) / baud
    if slower:
        assert apart_s > 0.999 * line_s / SHARE > LEAST_S
    else:
        assert apart_s >= LEAST_S > line_s / SHARE


def test_reading_takes_at_most_a_share_of_the_line():
    assert period_s(0.001, 0.002) == LEAST_S
    assert period_s(0.2, 0.1) == period_s(0.1, 0.2) == pytest.approx(0.2 / SHARE)


def test_a_board_that_is_gone_leaves_nothing_that_is_old(axis):
    reader = RegisterReader()
    whole(reader, axis)
    reader.leave()
    assert reader.reading is None
