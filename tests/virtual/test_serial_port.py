"""The virtual board's line: a serial port for a host, a port of the loopback for one at a time, and lost bytes."""

import os
import pty
import socket
from contextlib import suppress

import pytest

from hardwall.sim.virtual.serial_port import Line, PortError

ROOM = 4096
"""Bytes that a board has room for."""


@pytest.fixture
def line():
    with Line(0) as opened:
        yield opened


def guest(line: Line) -> socket.socket:
    return socket.create_connection(("127.0.0.1", line.tcp_port), timeout=10)


def say(line: Line, who: socket.socket, word: bytes) -> None:
    """Let a guest say something, and wait until the line has it."""
    who.sendall(word)
    heard = b""
    while heard != word:
        heard += line.take(1.0, ROOM)


def test_every_byte_passes_a_terminal_as_it_is(line):
    port = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
    data = bytes(range(256))
    os.write(port, data)
    assert line.take(1.0, ROOM) == data
    line.give(data)
    assert os.read(port, 300) == data
    os.close(port)
    # A host may come back.
    port = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
    os.write(port, b"again")
    assert line.take(1.0, ROOM) == b"again"
    os.close(port)


def test_one_guest_at_a_time_and_answers_go_to_who_spoke_last(line):
    with guest(line) as first, guest(line) as second:
        say(line, first, b"hello")
        line.give(b"answer")
        assert first.recv(10) == b"answer"
        assert second.recv(10) == b"", "the second guest is sent away"
    while line.take(0.1, ROOM) or line._guest:
        pass
    with guest(line) as third:
        say(line, third, b"x")
        line.give(b"y")
        assert third.recv(10) == b"y"


def test_a_guest_that_has_gone_is_no_end(line):
    with guest(line) as first:
        say(line, first, b"x")
    for _ in range(3):
        line.give(b"nobody hears this")
        assert line.take(0.05, ROOM) == b""
    with guest(line) as second:
        assert line.take(1.0, ROOM) == b""
        line.give(b"nor this")
        say(line, second, b"x")
        line.give(b"y")
        assert second.recv(10) == b"y"


def test_bytes_are_lost_as_ordered(line):
    port = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
    line.drops = 3
    os.write(port, b"abcdef")
    assert line.take(1.0, ROOM) == b"def"
    assert line.drops == 0
    os.close(port)


def test_without_a_reader_bytes_are_lost_and_nothing_waits(line):
    for _ in range(100):
        line.give(b"z" * 4096)


def test_a_guest_that_floods_is_sent_away_and_the_next_is_heard(line):
    with guest(line) as flooding:
        flooding.settimeout(10)
        heard = 0
        with suppress(OSError):
            for _ in range(1000):
                flooding.send(b"z" * ROOM)
                heard += len(line.take(0.1, max(ROOM - heard, 0)))
        assert line.sent_away == 1
    assert 0 < heard <= ROOM
    assert line.take(0.05, ROOM) == b""
    with guest(line) as good:
        say(line, good, b"x")
        line.give(b"y")
        assert good.recv(10) == b"y"


def test_what_floods_the_terminal_is_lost(line):
    port = os.open(line.path, os.O_RDWR | os.O_NOCTTY)
    os.write(port, b"abcdef")
    assert line.take(1.0, 4) == b"abcd"
    os.write(port, b"gh")
    assert line.take(1.0, 0) == b""
    os.write(port, b"ij")
    assert line.take(1.0, 4) == b"ij"
    os.close(port)


def test_a_port_that_is_taken_is_an_error(line):
    with pytest.raises(
        PortError, match=rf"^port {line.tcp_port} of 127\.0\.0\.1 cannot be opened: Address already in use$"
    ):
        Line(line.tcp_port)


def test_without_a_terminal_it_is_an_error_that_says_so(monkeypatch):
    def none() -> tuple[int, int]:
        raise OSError("out of pty devices")

    monkeypatch.setattr(pty, "openpty", none)
    with pytest.raises(PortError, match=r"^no pseudo-terminal can be opened: out of pty devices$"):
        Line()


def test_a_guest_that_reads_slowly_loses_bytes_and_stays(line):
    with guest(line) as slow:
        say(line, slow, b"x")
        for _ in range(2000):
            line.give(b"z" * 4096)
        assert slow.recv(4096) == b"z" * 4096
        say(line, slow, b"y")
