"""The line to a board: requests and answers that belong together, whatever is lost, late or spoilt."""

import os
import pty
import select
import socket
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, nullcontext, suppress

import pytest

from hardwall.host.errors import ForeignError, PortError, RefusedError, SilentError
from hardwall.host.port import BAUD, BRIDGE_S, DEVICE_BITS, MACHINE_S, Port
from hardwall.host.requests import Sending
from hardwall.model.checks import FieldError
from hardwall.model.link.board_pace import Teller
from hardwall.model.link.server import WRITE_MAX
from host.twin_board import PATIENT


@pytest.fixture
def port(board):
    line = Port(board.name, **PATIENT)
    yield line
    line.close()


def test_a_long_read_is_several_requests_and_a_write_is_one(board, port, registers):
    words = board.server.file.design.map_cells
    assert list(port.read(0x4000, 300)) == words[:300]
    stiffness = registers["wall_stiffness"]
    port.write(stiffness.address, (0, 77))
    assert port.read(stiffness.address, 2) == (0, 77)
    assert port.identify() == {0: b"hardwall", 1: b"axis", 2: registers.identity.encode()}


@pytest.mark.parametrize("count", [0, WRITE_MAX + 1])
def test_a_write_that_is_no_request_is_refused_here(port, count):
    with pytest.raises(ValueError, match=f"registers must be 1 to {WRITE_MAX}, not {count}"):
        port.write(0x80, (0,) * count)


@pytest.mark.parametrize(
    ("ask", "code", "message"),
    [
        (lambda port: port.read(0x3000, 2), 2, "read 2 registers from 0x3000 on: it has no such register"),
        (lambda port: port.write(0xC8, (0, 1)), 3, "write 2 registers from 0x00c8 on: a value is out of its range"),
        (lambda port: port.write(0x7B, (1,)), 4, "0x007b on: it does not do that in its present state"),
    ],
)
def test_a_refusal_says_what_was_refused_and_why(board, port, ask, code, message):
    board.server.file.refusing = frozenset({"arm"})
    with pytest.raises(RefusedError, match=message) as raised:
        ask(port)
    assert raised.value.code == code


def test_an_answer_that_is_late_is_not_taken_for_the_next(board, port, registers):
    port.read(0, 2)
    late_s = board.late_s = 2.0 * PATIENT["answer_s"] / PATIENT["pace"]
    with pytest.raises(SilentError, match=r"any more at tcp.* to read 2 registers from 0x4000 on, which may have been"):
        port.read(0x4000, 2)
    # It may ask again until the board is in step.
    with suppress(SilentError):
        port.read(0, 2)
    time.sleep(late_s)
    for _ in range(20):
        assert port.read(0, 2) == (0, registers["layout"].reset)


STIFFNESS = 0x8C
FAULTS = pytest.mark.parametrize("fault", ["lost", "spoilt"])


@FAULTS
def test_what_may_be_asked_twice_is_asked_again_when_its_answer_is_lost_or_spoilt(board, port, fault):
    port.read(0, 2)
    setattr(board, fault, 1)
    assert port.read(2, 2) == tuple(board.server.file.live[2:4])
    setattr(board, fault, 1)
    port.write(STIFFNESS, (0, 77))
    assert board.server.file.live[STIFFNESS : STIFFNESS + 2] == [0, 77]


@FAULTS
def test_what_may_not_is_an_error_once(board, port, fault):
    port.read(0, 2)
    setattr(board, fault, 1)
    before = len(board.requests)
    with pytest.raises(SilentError, match="which may have been carried out"):
        port.write(STIFFNESS, (0, 78), Sending(once=True))
    assert len(board.requests) == before + 1
    assert port.read(STIFFNESS, 2) == (0, 78)


def test_an_answer_is_waited_for_no_longer_than_it_can_take(board):
    port = Port(board.name, answer_s=60.0)
    for count, bits in ((2, 30 * 10), (100, 213 * 10)):
        port.read(0, 2)
        board.lost, began = 1, time.monotonic()
        assert len(port.read(0, count)) == count
        least_s = (bits + DEVICE_BITS) / BAUD + BRIDGE_S + MACHINE_S
        # Twice that would be a beat's whole share of the watchdog, and is a busy machine's.
        assert 0.8 * least_s < time.monotonic() - began < 10.0
    port.close()


@pytest.mark.parametrize(("pace", "waits"), [(1.0, False), (0.05, True)])
def test_a_board_that_is_slower_is_waited_for_longer(board, pace, waits):
    port = Port(board.name, pace=pace)
    port.read(0, 2)
    board.late_s = 0.25
    with nullcontext() if waits else pytest.raises(SilentError):
        port.write(STIFFNESS, (0, 5), Sending(once=True))
    port.close()


@pytest.mark.parametrize(("told", "waits"), [(None, False), (1.0, False), (0.15, True)])
def test_a_board_that_becomes_slower_is_waited_for_longer(board, told, waits):
    with ExitStack() as ended, ThreadPoolExecutor(1) as other:
        if told is None:
            port = Port(board.name)
        else:
            teller = ended.enter_context(Teller([board.name]))
            coming = other.submit(Port, board.name)
            while not coming.done():
                teller.tell(1.0)
            port = coming.result()
        port.read(0, 2)
        board.late_s = 0.25
        if told is not None:
            teller.tell(told)
        with nullcontext() if waits else pytest.raises(SilentError):
            port.write(STIFFNESS, (0, 5), Sending(once=True))
        port.close()


def test_what_is_called_off_in_its_turn_is_not_written(board, port):
    def call_off() -> None:
        raise ZeroDivisionError

    before = len(board.requests)
    with pytest.raises(ZeroDivisionError):
        port.write(STIFFNESS, (0, 5), Sending(check=call_off))
    assert not any(request[1] == 16 for request in board.requests[before:])


def test_a_host_begins_behind_what_the_last_one_was_told(board, registers):
    # The last host went away in the middle of a request, whose answer the next one finds on the line.
    ours, theirs = pty.openpty()
    tty.setraw(ours)
    tty.setraw(theirs)
    os.write(ours, b"\1\3\4\0\0\0\7\x7a\x31")
    with socket.create_connection(("127.0.0.1", int(board.name.rpartition(":")[2]))) as line:
        done = threading.Event()

        def carry() -> None:
            os.set_blocking(ours, False)
            line.settimeout(0.002)
            while not done.is_set():
                for take, give in ((lambda: os.read(ours, 500), line.sendall), (lambda: line.recv(500), _to(ours))):
                    with suppress(BlockingIOError, TimeoutError):
                        give(take())

        thread = threading.Thread(target=carry)
        thread.start()
        port = Port(os.ttyname(theirs), answer_s=0.5)
        assert port.read(0, 2) == (0, registers["layout"].reset)
        with pytest.raises(PortError, match="another program uses it; `hardwall share` shares a board"):
            Port(os.ttyname(theirs))
        port.close()
        done.set()
        thread.join()
    os.close(ours)
    os.close(theirs)


def _to(file: int):
    return lambda data: os.write(file, data)


def test_a_request_that_was_cut_short_does_not_swallow_the_next(board, registers):
    with socket.create_connection(("127.0.0.1", int(board.name.rpartition(":")[2]))) as last:
        last.sendall(b"\1\3\0")
        assert not select.select([last], [], [], 0.01)[0]
        last.shutdown(socket.SHUT_WR)
    port = Port(board.name, answer_s=5.0)
    began = time.monotonic()
    assert port.read(0, 2) == (0, registers["layout"].reset)
    assert time.monotonic() - began < 5.0
    port.close()


def test_requests_of_several_threads_come_one_after_the_other(board, port):
    def wrong(address: int) -> int:
        expected = tuple(board.server.file.live[address : address + 2])
        return sum(port.read(address, 2) != expected for _ in range(50))

    port.read(0, 2)
    board.lost = 1
    with ThreadPoolExecutor(4) as threads:
        assert sum(threads.map(wrong, (0, 2, 4, 6))) == 0
    assert board.lost == 0


def test_a_board_that_goes_away_is_gone_for_good(board, port):
    port.read(0, 2)
    board.hang_up()
    with pytest.raises(PortError, match="is gone: is the cable in, and the board powered"):
        port.read(0, 2)
    with pytest.raises(PortError, match="is closed or gone: connect again"):
        port.read(0, 2)


def test_who_is_sent_away_is_told_so():
    said = "ended the connection at once: it is no board, or has as many programs as it takes"

    def send_away(server: socket.socket) -> None:
        server.accept()[0].close()

    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as thread:
        thread.submit(send_away, server)
        with pytest.raises(PortError, match=said):
            Port(f"tcp://127.0.0.1:{server.getsockname()[1]}").read(0, 2)


def test_what_does_not_repeat_is_no_axis():
    with socket.create_server(("127.0.0.1", 0)) as server:

        def answer() -> None:
            guest, _ = server.accept()
            with guest:
                while guest.recv(100):
                    # The answer to a request of two registers.
                    guest.sendall(b"\1\3\4\0\0\0\7\xbb\xf1")

        thread = threading.Thread(target=answer)
        thread.start()
        port = Port(f"tcp://127.0.0.1:{server.getsockname()[1]}", answer_s=0.1)
        with pytest.raises(ForeignError, match="does not echo a test request"):
            port.read(0, 2)
        port.close()
        thread.join()


def test_silence_ends():
    with socket.create_server(("127.0.0.1", 0)) as server:
        name = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        port = Port(name, answer_s=1.0)
        began = time.monotonic()
        # A port of the network has no baud rate.
        with pytest.raises(SilentError, match=f"^nothing answers at {name}: is behind it a board that is powered"):
            port.read(0, 2)
        assert 0.9 < time.monotonic() - began < 2.5
        port.close()


def test_a_serial_port_that_is_silent_is_said_with_its_rate():
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    port = Port(os.ttyname(theirs), answer_s=0.5)
    with pytest.raises(SilentError, match="at 921600 baud: is the board powered and configured"):
        port.read(0, 2)
    port.close()
    for each in (ours, theirs):
        os.close(each)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"baud": 0}, "baud must be 1 to 4000000, not 0"),
        ({"baud": 5_000_000}, "baud must be 1 to 4000000, not 5000000"),
        ({"answer_s": float("nan")}, "answer_s must be .*, not nan"),
        ({"answer_s": -1.0}, "answer_s must be .*, not -1.0"),
        ({"pace": 0.0}, "pace must be 0.001 to 1, not 0.0"),
        ({"pace": 2.0}, "pace must be 0.001 to 1, not 2.0"),
        ({"pace": float("nan")}, "pace must be 0.001 to 1, not nan"),
    ],
)
def test_a_number_out_of_range_is_an_error(numbers, message):
    with pytest.raises(FieldError, match=message):
        Port("/dev/hardwall-absent", **numbers)


def test_a_request_behind_the_close_is_an_error_of_the_port(port):
    # As if another thread had closed it behind the first look.
    port.close()
    port._gone = False
    with pytest.raises(PortError, match="is closed: connect again"):
        port.read(0, 2)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("/dev/hardwall-absent", "there is no such port; `ls /dev/serial/by-id` lists the boards"),
        ("/dev/null", "it is no serial port"),
        ("/tmp", "/tmp cannot be opened: it is no serial port"),
        ("a" * 300, "cannot be opened: File name too long"),
        ("", "cannot be opened"),
        ("a\0b", "cannot be opened"),
        ("tcp://127.0.0.1:1", "nothing listens there"),
        ("tcp://127.0.0.1", "a port of the network must be tcp://HOST:PORT, with a PORT of 1 to 65535"),
        ("tcp://127.0.0.1:" + "9" * 4301, "a port of the network must be tcp://HOST:PORT"),
        ("tcp://127.0.0.1:\u0663", "a port of the network must be tcp://HOST:PORT"),
        ("tcp://:5", "a port of the network must be tcp://HOST:PORT"),
        ("tcp://127.0.0.1:65536", "a port of the network must be tcp://HOST:PORT"),
        ("tcp://no.such.host.invalid:5", r"cannot be opened: [^[]*$"),
        (f"tcp://{'a' * 300}:5", "cannot be opened: no machine has such a name$"),
        ("tcp://[::1]:1", r"tcp://\[::1\]:1 cannot be opened: nothing listens there$"),
    ],
)
def test_a_port_that_cannot_be_had_says_why(name, message):
    with pytest.raises(PortError, match=message):
        Port(name)


def test_a_folder_and_a_pipe_are_no_serial_ports(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for name in (tmp_path, tmp_path / "pipe"):
        with pytest.raises(PortError, match="cannot be opened"):
            Port(str(name))
