"""The pace of a virtual board: what its hosts are told of it, beside the line."""

import os
import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from hardwall.model.link import board_pace
from hardwall.model.link.board_pace import CHANGE, FIRST_S, HOSTS, MARGIN, PACE_LEAST, Teller, Told, place_of

PORT = f"tcp://127.0.0.1:{os.getpid()}"
"""A name that no other process has."""
SAID = 5e-3
"""What is told has three digits, and so is rounded by at most half of the last in 100."""


def heard(teller: Teller, pace: float, port: str = PORT) -> Told:
    """Return the end of a host that comes while a pace is told."""
    with ThreadPoolExecutor(1) as other:
        coming = other.submit(Told, port)
        while not coming.done():
            teller.tell(pace)
        return coming.result()


@pytest.fixture
def teller():
    with Teller([PORT]) as end:
        yield end


def test_of_a_port_that_nobody_tells_of_it_is_1_at_once():
    for name in (PORT, "/dev/ttyS0", "tcp://[::1]:4", "", "a\0b", "x" * 300):
        began = time.monotonic()
        told = Told(name)
        assert told.pace == 1.0
        assert time.monotonic() - began < FIRST_S / 2
        told.close()


def test_a_host_hears_it_when_it_comes_and_when_it_changes(teller):
    first = heard(teller, 0.3)
    assert first.pace == pytest.approx(0.3 / MARGIN, rel=SAID)
    teller.tell(0.3 * (1 - CHANGE / 2))
    assert first.pace == pytest.approx(0.3 / MARGIN, rel=SAID)
    teller.tell(0.2)
    second = heard(teller, 0.2)
    for told in (first, second):
        assert told.pace == pytest.approx(0.2 / MARGIN, rel=SAID)
    first.close()
    teller.tell(0.1)
    teller.tell(0.05)
    assert second.pace == pytest.approx(0.05 / MARGIN, rel=SAID)
    second.close()


@pytest.mark.parametrize(("pace", "told"), [(3.0, 1 / MARGIN), (1e-9, PACE_LEAST)])
def test_it_has_limits(teller, pace, told):
    host = heard(teller, pace)
    assert host.pace == pytest.approx(told, rel=SAID)
    host.close()


def test_a_host_keeps_to_what_it_was_told_last():
    with Teller([PORT]) as teller:
        host = heard(teller, 0.6)
    assert host.pace == pytest.approx(0.6 / MARGIN, rel=SAID)
    host.close()
    assert host.pace == pytest.approx(0.6 / MARGIN, rel=SAID)
    new = Told(PORT)
    assert new.pace == 1.0
    new.close()


def test_a_host_that_does_not_listen_holds_nothing_up_and_hears_the_last_pace_when_it_does(teller):
    host = heard(teller, 1.0)
    for number in range(10_000):
        teller.tell(0.9 if number % 2 else 0.3)
    # For this one there was no room.
    teller.tell(0.6)
    assert host.pace in (0.3, 0.1)
    teller.tell(0.6)
    assert host.pace == pytest.approx(0.6 / MARGIN, rel=SAID)
    host.close()


def test_a_port_has_many_names_and_one_board(teller, tmp_path):
    link = tmp_path / "board"
    link.symlink_to("/dev/null")
    assert place_of(str(link)) == place_of("/dev/null")
    host = heard(teller, 0.3, PORT.replace("127.0.0.1", "localhost"))
    assert host.pace < 1.0
    host.close()
    with pytest.raises(RuntimeError, match=f"the pace of {PORT} cannot be told: Address already in use"):
        Teller(["/dev/null", PORT])
    # What was begun is ended again.
    Teller(["/dev/null"]).close()


def test_several_hosts_may_come_at_once(teller):
    with ThreadPoolExecutor(HOSTS) as others:
        coming = [others.submit(Told, PORT) for _ in range(HOSTS)]
        while not all(each.done() for each in coming):
            teller.tell(0.5)
    for each in coming:
        assert each.result().pace == pytest.approx(0.5 / MARGIN, rel=SAID)
        each.result().close()


def test_hosts_that_have_gone_leave_no_end(teller):
    heard(teller, 0.5).close()
    teller.tell(0.5)
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        heard(teller, 0.5).close()
    teller.tell(0.5)
    assert len(os.listdir("/proc/self/fd")) == before


@pytest.mark.parametrize("word", [b"abc", b"0", b"nan", b"-1", b"2"])
def test_a_word_that_is_no_pace_is_not_taken(word):
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as end:
        end.bind(place_of(PORT))
        end.listen(1)
        with ThreadPoolExecutor(1) as other:
            coming = other.submit(Told, PORT)
            line, _ = end.accept()
            line.send(b"0.5")
            host = coming.result()
        line.send(word)
        assert host.pace == 0.5
        host.close()
        line.close()


def test_what_another_user_tells_is_not_heard(teller, monkeypatch):
    monkeypatch.setattr(board_pace, "_owner", lambda line: os.getuid() + 1)
    host = heard(teller, 0.3)
    teller.tell(0.1)
    assert host.pace == 1.0
    host.close()
