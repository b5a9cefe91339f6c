"""Who may write to a shared board: one program at a time, and none whose image of the words is old."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest

from hardwall.host.leases import HELD, HOLD_S, STALE, Lease, name_of


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    """A clock that stands, and a test moves."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_who_writes_holds_it_until_it_leaves(clock):
    lease = Lease(lambda: 1.0)
    first, second = lease.welcome("first"), lease.welcome("second")
    assert lease.holder is None
    assert lease.refusal(first) is None
    lease.wrote(first)
    assert (lease.holder, lease.refusal(first), lease.refusal(second)) == (first, None, HELD)
    lease.leave(second)
    assert lease.holder is first
    lease.leave(first)
    assert lease.holder is None


def test_who_came_before_a_write_of_another_is_stale(clock):
    lease = Lease(lambda: 1.0)
    first, second = lease.welcome("first"), lease.welcome("second")
    lease.wrote(first)
    between = lease.welcome("between")
    lease.wrote(first)
    lease.leave(first)
    after = lease.welcome("after")
    assert [lease.refusal(each) for each in (second, between, after)] == [STALE, STALE, None]


@pytest.mark.parametrize("pace", [1.0, 0.1])
def test_who_is_silent_loses_it_behind_the_longest_watchdog(clock, pace):
    lease = Lease(lambda: pace)
    first = lease.welcome("first")
    lease.wrote(first)
    second = lease.welcome("second")
    clock[0] += HOLD_S / pace
    assert lease.refusal(second) == HELD
    clock[0] += 0.01
    assert lease.refusal(second) is None
    # Who comes back finds that another one has written.
    lease.wrote(second)
    assert lease.refusal(first) == HELD
    lease.leave(second)
    assert lease.refusal(first) == STALE


def test_no_watchdog_lasts_longer_than_the_lease(registers):
    watchdog = registers["supervisor_watchdog"]
    assert watchdog.high * watchdog.lsb <= HOLD_S


PROGRAM = (
    "import socket, sys; host, port, own, number = sys.argv[1:]; "
    "line = socket.create_connection((host, int(port)), source_address=(own, int(number))); sys.stdin.read()"
)


@contextmanager
def program_at(listener: socket.socket, own: str = "127.0.0.1", number: int = 0) -> Iterator[Callable[[], bool]]:
    """Let a process connect from an address; yield what returns whether its name has its number."""
    host, port = listener.getsockname()
    words = [sys.executable, "-c", PROGRAM, host, str(port), own, str(number)]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as process:
        line, peer = listener.accept()
        with line:
            yield lambda: name_of(peer, line.getsockname()).endswith(f", process {process.pid}")
        process.stdin.close()


def test_a_program_has_the_name_of_its_process():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        with program_at(listener) as is_named:
            assert is_named()
        with socket.create_connection(listener.getsockname()):
            line, peer = listener.accept()
            with line:
                assert name_of(peer, line.getsockname()).endswith(f", process {os.getpid()}")


def test_a_program_is_not_taken_for_one_with_the_same_port():
    with ExitStack() as stack:
        listeners = [stack.enter_context(socket.create_server((host, 0))) for host in ("127.0.0.1", "127.0.0.2")]
        number = free_port()
        # The same number of a port at two addresses, and at one address with two others.
        places = [(listeners[0], "127.0.0.1"), (listeners[0], "127.0.0.2"), (listeners[1], "127.0.0.3")]
        programs = [stack.enter_context(program_at(listener, own, number)) for listener, own in places]
        assert [is_named() for is_named in programs] == [True, True, True]


def free_port() -> int:
    with socket.create_server(("0.0.0.0", 0)) as listener:
        return listener.getsockname()[1]


def test_a_program_that_is_not_found_has_its_address():
    assert name_of(("127.0.0.1", 1), ("127.0.0.1", 2)) == "a program at 127.0.0.1:1"
