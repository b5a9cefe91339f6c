"""A board that several programs share: all of them read, one writes, and each may disarm."""

import errno
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest

from hardwall.host import leases
from hardwall.host import relay as relays
from hardwall.host.axis import Axis
from hardwall.host.config import Config
from hardwall.host.connect import connect, share
from hardwall.host.errors import ChangedError, HeldError, PortError, SilentError
from hardwall.host.port import Port
from hardwall.host.relay import BURST, GUESTS_MAX, Relay
from hardwall.host.samples import Samples
from hardwall.host.status import State
from hardwall.model.link.line import framed
from host.twin_board import PATIENT, TwinBoard
from stimuli import frames
from support.processes import PATIENCE_S, wait_until

FOR_GOOD = 1 << 30


@pytest.fixture
def relay(board) -> Iterator[Relay]:
    board.show(ready=1, live=1, state=State.DISARMED)

    def react(pulses: tuple[str, ...]) -> None:
        for pulse in pulses:
            if pulse in ("arm", "disarm"):
                board.show(state=State.ARMED if pulse == "arm" else State.DISARMED)

    board.react = react
    with share(board.name, **PATIENT) as found:
        yield found


@pytest.fixture
def come(relay) -> Iterator[Callable[[], Axis]]:
    """Return what lets one more program come, as an axis."""
    found: list[Axis] = []

    def come() -> Axis:
        found.append(connect(relay.name, **PATIENT))
        return found[-1]

    yield come
    for axis in found:
        axis.close()


def state(board) -> int:
    return board.server.file.status["state"]


def test_all_of_them_read_and_one_writes(board, relay, come):
    reader, writer = come(), come()
    assert reader.lease == writer.lease == relay.holder == ""
    writer.set(wall_stiffness=1000.0)
    assert relay.holder
    assert reader.lease == writer.lease == relay.holder
    assert reader.get("wall_stiffness") == writer.get("wall_stiffness") != 0
    assert next(Samples(reader)).status.state is State.DISARMED
    before = dict(board.server.file.active)
    for act in (lambda: reader.set(wall_stiffness=5.0), lambda: reader.pulse("arm")):
        with pytest.raises(HeldError, match=re.escape(f"is held by {relay.holder}: it alone writes")):
            act()
    for act in (reader.renew, reader.arm):
        with pytest.raises((HeldError, ChangedError)):
            act()
    after = {name: word for name, word in board.server.file.active.items() if name != "heartbeat"}
    assert after == {name: word for name, word in before.items() if name != "heartbeat"}


def test_a_board_alone_has_no_lease(axis):
    assert axis.lease is None


def test_who_leaves_lets_the_next_one_write(relay, come):
    first = come()
    first.set(wall_stiffness=1000.0)
    before = come()
    first.set(wall_damping=5.0)
    first.close()
    wait_until(lambda: relay.holder == "")
    # What it read has changed since.
    with pytest.raises(
        ChangedError, match=r"another program has written to the board at .* since this program connected"
    ):
        before.set(wall_stiffness=2000.0)
    after = come()
    after.set(wall_stiffness=2000.0)
    assert after.get("wall_damping") == pytest.approx(5.0, abs=0.01)


def test_who_is_silent_for_too_long_loses_the_lease(relay, come, monkeypatch):
    monkeypatch.setattr(leases, "HOLD_S", 0.05 * PATIENT["pace"])
    first = come()
    first.set(wall_stiffness=1000.0)
    first._heartbeat.rest()
    wait_until(lambda: relay.holder == "")
    come().set(wall_stiffness=2000.0)
    with pytest.raises((HeldError, ChangedError)):
        first.set(wall_stiffness=3000.0)


def test_any_program_may_disarm(board, relay, come):
    reader, writer = come(), come()
    writer.arm()
    assert state(board) == State.ARMED
    reader.disarm()
    assert state(board) == State.DISARMED
    # That takes no lease.
    assert relay.holder
    writer.arm()
    assert state(board) == State.ARMED


def test_a_program_that_comes_later_does_not_disarm_what_another_one_has_armed(board, come):
    come().arm()
    second = come()
    for act in (lambda: second.set(wall_stiffness=1.0), second.renew, second.arm, second.capture.start):
        with pytest.raises(HeldError):
            act()
        assert state(board) == State.ARMED
    second.close()
    assert state(board) == State.ARMED


def test_what_a_program_that_died_left_armed_is_disarmed_before_the_next_one_writes(board, relay, come):
    first = come()
    first.arm()
    # As if it had been killed.
    first._heartbeat.close()
    first._port.close()
    wait_until(lambda: relay.holder == "")
    assert state(board) == State.ARMED
    come().set(wall_stiffness=1.0)
    assert state(board) == State.DISARMED


def test_nothing_beats_for_a_program_that_is_gone(board, relay, come):
    first, reader = come(), come()
    first.arm()
    first._heartbeat.close()
    first._port.close()
    wait_until(lambda: relay.holder == "")
    beats = board.server.file.active["heartbeat"]
    list(Samples(reader, 100.0, 0.5))
    assert board.server.file.active["heartbeat"] == beats


def test_a_configuration_is_not_loaded_beside_another_program(board, come, tmp_path):
    writer, other = come(), come()
    Config.of(writer).write(tmp_path / "words.toml", writer.device)
    writer.set(wall_stiffness=1000.0)
    late = come()
    config, before = Config.read(tmp_path / "words.toml"), dict(board.server.file.active)
    for axis in (other, late):
        with pytest.raises((HeldError, ChangedError), match=r"the lease of the board|another host writes to it"):
            config.load(axis, config.differences(axis))
    assert board.server.file.active | {"heartbeat": 0} == before | {"heartbeat": 0}


def test_a_silent_board_is_silent_to_all_and_comes_back(board, come):
    reader = come()
    board.lost = FOR_GOOD
    with pytest.raises(SilentError, match="the board behind tcp://"):
        _ = reader.status
    board.lost = 0
    assert reader.status.state is State.DISARMED


def test_one_lost_answer_is_asked_again(board, come):
    writer = come()
    writer.set(wall_stiffness=1000.0)
    for fault in ("lost", "spoilt"):
        setattr(board, fault, 1)
        writer.set(wall_stiffness=2000.0)
        assert writer.get("wall_stiffness") == pytest.approx(2000.0, abs=4)


def test_a_cable_that_is_pulled_ends_it(board, relay, come):
    reader = come()
    board.hang_up()
    with pytest.raises(SilentError):
        _ = reader.status
    assert isinstance(relay.failure, PortError)


def test_an_end_leaves_every_program(relay, come):
    reader = come()
    relay.close()
    with pytest.raises(PortError, match="is gone"):
        list(Samples(reader, 100.0, 5.0))


@contextmanager
def line_to(relay: Relay) -> Iterator[socket.socket]:
    host, _, number = relay.name.removeprefix("tcp://").rpartition(":")
    with socket.create_connection((host, int(number)), timeout=10.0) as line:
        yield line


READ_LAYOUT = framed(bytes([1, 3, 0, 0, 0, 2]))


def answered(line: socket.socket, request: bytes, size: int) -> bytes:
    line.sendall(request)
    found = b""
    while len(found) < size:
        found += line.recv(size - len(found))
    return found


def test_whatever_is_sent_to_it_the_next_request_is_answered(board, relay):
    expected = framed(bytes([1, 3, 4, 0, 0, 0, 1]))
    with line_to(relay) as line:
        assert answered(line, READ_LAYOUT, 9) == expected
        # In two parts.
        line.sendall(READ_LAYOUT[:3])
        assert answered(line, READ_LAYOUT[3:], 9) == expected
        # Two at once.
        assert answered(line, READ_LAYOUT * 2, 18) == expected * 2
        # Spoilt, to another unit, and to all.
        for other in (
            READ_LAYOUT[:-1] + b"\0",
            framed(bytes([2, 3, 0, 0, 0, 2])),
            framed(bytes([0, 6, 0, 0x7A, 0, 1])),
        ):
            line.sendall(other)
            assert answered(line, READ_LAYOUT, 9) == expected
        # A function that the board does not know is the board's to refuse.
        assert answered(line, framed(bytes([1, 0x55, 0, 0])), 5) == framed(bytes([1, 0xD5, 1]))
        assert answered(line, framed(bytes([1, 0x2B, 14, 4, 0x81])), 5) == framed(bytes([1, 0xAB, 2]))
        # Functions that this library does not use.
        assert answered(line, framed(bytes([1, 8, 0, 11, 0, 0])), 8)[:4] == bytes([1, 8, 0, 11])
        # A beginning without an end is dropped in time.
        line.sendall(bytes([1, 16, 0]))
        line.settimeout(1.2)
        with pytest.raises(TimeoutError):
            line.recv(1)
        line.settimeout(10.0)
        assert answered(line, READ_LAYOUT, 9) == expected


def test_a_program_that_sends_no_requests_is_not_heard_for_a_while(relay):
    """A flood of them takes no processor from the program that holds the lease."""
    spoilt = [READ_LAYOUT[:-1] + b"\0", framed(bytes([2, 3, 0, 0, 0, 2]))]
    with line_to(relay) as line:
        answered(line, READ_LAYOUT, 9)
        for other in spoilt:
            began_s = time.monotonic()
            answered(line, 2 * other + READ_LAYOUT, 9)
            assert time.monotonic() - began_s >= 2 * relays.DEAF_S


def test_a_program_that_sends_nothing_but_rubbish_is_left(relay, monkeypatch):
    monkeypatch.setattr(relays, "DEAF_S", 0.0)
    spoilt = READ_LAYOUT[:-1] + b"\0"
    with line_to(relay) as line:
        # Not in a row.
        for _ in range(2):
            answered(line, (relays.RUBBISH_MAX - 1) * spoilt + READ_LAYOUT, 9)
        line.sendall(relays.RUBBISH_MAX * spoilt)
        assert line.recv(1) == b""
    wait_until(lambda: not relay._programs)


@pytest.mark.parametrize(("request_", "size"), [(bytes([1, 8, 0, 0, 1, 2]), 8), (bytes([1, 0x2B, 14, 4, 0x80]), 12)])
def test_what_is_not_of_the_board_takes_a_while_whoever_asks(relay, request_, size):
    with line_to(relay) as line, line_to(relay) as other:
        for each in (line, other):
            answered(each, READ_LAYOUT, 9)
        began_s = time.monotonic()
        for _ in range(5):
            line.sendall(framed(request_))
            answered(other, framed(request_), size)
            answered(line, b"", size)
        assert time.monotonic() - began_s >= 10 * relays.OWN_S


def test_programs_come_again_when_there_are_files_again(relay, monkeypatch):
    monkeypatch.setattr(relays, "REST_S", 0.05)
    accept, refused = socket.socket.accept, threading.Event()

    def refuse_once(listener: socket.socket) -> tuple[socket.socket, tuple[str, int]]:
        if not refused.is_set():
            refused.set()
            raise OSError(errno.EMFILE, "Too many open files")
        return accept(listener)

    monkeypatch.setattr(socket.socket, "accept", refuse_once)
    # The first one ends the call that waits already.
    for _ in range(2):
        with line_to(relay) as line:
            assert answered(line, READ_LAYOUT, 9)[:2] == READ_LAYOUT[:2]
    assert refused.is_set()


@pytest.mark.parametrize("function", [6, 16, 23])
def test_every_function_that_writes_needs_the_lease(relay, come, registers, function):
    come().set(wall_stiffness=1000.0)
    place = registers["supervisor_watchdog"].address
    word = place.to_bytes(2, "big")
    arm = registers["arm"].address.to_bytes(2, "big")
    request = {
        6: bytes([1, 6]) + arm + b"\0\1",
        16: bytes([1, 16]) + word + bytes([0, 2, 4, 0, 0, 0, 100]),
        23: bytes([1, 23, 0, 0, 0, 2]) + word + bytes([0, 2, 4, 0, 0, 0, 100]),
    }[function]
    with line_to(relay) as line:
        assert answered(line, framed(request), 5) == framed(bytes([1, function | 0x80, leases.HELD]))


@pytest.mark.parametrize("one", [True, False])
def test_a_disarm_beside_something_else_needs_the_lease(relay, come, registers, one):
    come().arm()
    place = registers["disarm"].address
    with line_to(relay) as line:
        beside = framed(bytes([1, 16]) + place.to_bytes(2, "big") + bytes([0, 2, 4, 0, 1, 0, 1]))
        assert answered(line, beside, 5) == framed(bytes([1, 0x90, leases.HELD]))
        alone = bytes([1, 6]) + place.to_bytes(2, "big") + b"\0\1"
        many = bytes([1, 16]) + place.to_bytes(2, "big") + bytes([0, 1, 2, 0, 1])
        assert answered(line, framed(alone if one else many), 8)[1] == (6 if one else 16)


class Held(Port):
    """A port that keeps the requests in their order, and answers to none while a test holds it."""

    def __init__(self, port: Port):
        self._port, self.asked, self.free = port, list[bytes](), threading.Event()
        self.free.set()

    def relay(self, request: bytes) -> bytes:
        self.asked.append(request)
        assert self.free.wait(PATIENCE_S)
        return self._port.relay(request)

    @property
    def pace(self) -> float:
        return self._port.pace

    def close(self) -> None:
        self._port.close()


@contextmanager
def waiting(relay: Relay, others: int) -> Iterator[tuple[Held, list[socket.socket]]]:
    """Let a program's read be under way, and those of some others wait; yield the port, held, and their lines."""
    relay._port = held = Held(relay._port)
    with ExitStack() as stack:
        lines = [stack.enter_context(line_to(relay)) for _ in range(1 + others)]
        for line in lines:
            answered(line, READ_LAYOUT, 9)
        held.asked.clear()
        held.free.clear()
        lines[0].sendall(READ_LAYOUT)
        wait_until(lambda: held.asked)
        for line in lines[1:]:
            line.sendall(READ_LAYOUT)
        wait_until(lambda: relay._waiting[False] == others)
        yield held, lines


def test_a_beat_waits_for_one_request_and_others_are_not_kept_out(relay, registers, monkeypatch):
    # Longer than a busy machine takes for the next request.
    monkeypatch.setattr(relays, "GRACE_S", 2.0)
    beat = registers["heartbeat"].address
    read = framed(bytes([1, 3]) + beat.to_bytes(2, "big") + b"\0\2")
    write = framed(bytes([1, 16]) + beat.to_bytes(2, "big") + bytes([0, 2, 4, 0, 0, 0, 1]))
    with line_to(relay) as holder:
        answered(holder, write, 8)
        assert relay.holder
        # So many that the holder's request is hardly the first by chance.
        with waiting(relay, 12) as (held, lines):
            holder.sendall(read)
            wait_until(lambda: relay._waiting[True] == 1)
            held.free.set()
            assert answered(holder, b"", 9)[1] == 3
            # What follows at once is kept the line for; no more than a burst.
            for _ in range(2 * BURST):
                answered(holder, write, 8)
            for line in lines:
                answered(line, b"", 9)
    order = "".join("r" if request[2:4] == b"\0\0" else "H" for request in held.asked)
    # The read that was under way; a burst of the holder's; and the others in their turns.
    assert order.startswith("r" + BURST * "H" + "r"), order
    assert order.count("r") == 13


def test_without_a_holder_all_wait_alike(relay):
    with waiting(relay, 3) as (held, lines):
        held.free.set()
        for line in lines:
            assert answered(line, b"", 9)[1] == 3
    assert len(held.asked) == 4


def test_one_program_more_takes_the_place_of_the_one_that_is_silent_for_longest(board, relay, come, monkeypatch):
    monkeypatch.setattr(relays, "IDLE_S", 0.0)
    monkeypatch.setattr(leases, "HOLD_S", FOR_GOOD)
    write = frames.write(board.server.file.design.registers["wall_damping"].address, [0, 1])
    with ExitStack() as stack:
        holder, *lines = (stack.enter_context(line_to(relay)) for _ in range(GUESTS_MAX))
        answered(holder, framed(bytes([1]) + write), 8)
        for line in lines[::-1]:
            answered(line, READ_LAYOUT, 9)
        # Whoever holds the lease keeps its place, however long it has been silent; the others go in their order.
        come().disarm()
        assert lines.pop().recv(1) == b""
        for line in (holder, *lines):
            assert answered(line, READ_LAYOUT, 9)[:2] == READ_LAYOUT[:2]
        assert relay.holder


def test_more_programs_than_it_takes_are_sent_away_if_all_are_busy(relay, monkeypatch):
    monkeypatch.setattr(relays, "IDLE_S", FOR_GOOD)
    with ExitStack() as stack:
        lines = [stack.enter_context(line_to(relay)) for _ in range(GUESTS_MAX)]
        wait_until(lambda: len(relay._programs) == GUESTS_MAX)
        with line_to(relay) as line:
            assert line.recv(1) == b""
        lines.pop().close()
        wait_until(lambda: len(relay._programs) < GUESTS_MAX)
        with line_to(relay) as line:
            assert answered(line, READ_LAYOUT, 9)[:2] == READ_LAYOUT[:2]


def test_a_port_of_the_loopback_that_is_taken_is_one_line(board, relay):
    with TwinBoard(board.server.file.design.registers) as other:
        number = int(relay.name.rpartition(":")[2])
        with pytest.raises(PortError, match=f"port {number} of 127.0.0.1 cannot be opened: Address already in use"):
            share(other.name, **PATIENT, number=number)
        # The board is free again.
        connect(other.name, **PATIENT).close()
