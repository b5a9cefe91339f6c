"""The command `virtual`: a process with a serial port and a port of the loopback, orders on stdin, and its ends."""

import os
import random
import re
import signal
import socket
import subprocess
import time
from contextlib import suppress

import pytest
from pymodbus import FramerType
from pymodbus.client import ModbusTcpClient

from hardwall.host.connect import connect
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervisor import TRIPPED, names
from hardwall.model.link.line import framed
from hardwall.sim.scene.load import load
from stimuli import frames
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import ended, line, started, wait_until
from support.virtual_boards import SCENE, command, running

REGISTERS = RegisterMap(load("seed-2011", SCENE).spec)


def test_a_client_that_others_wrote_reads_and_writes_and_sees_a_loop_open():
    with running(SCENE, "--tcp", "0", "--speed", "0") as board:
        client = ModbusTcpClient("127.0.0.1", port=int(board.tcp.rpartition(":")[2]), framer=FramerType.RTU, timeout=60)
        assert client.connect()

        def read(name: str) -> int:
            register = REGISTERS[name]
            answer = client.read_holding_registers(register.address, count=register.size, device_id=1)
            return register.from_registers(tuple(answer.registers))

        identity = f"{read('identity_high') & 0xFFFFFFFF:08x}{read('identity_low') & 0xFFFFFFFF:08x}"
        assert identity == REGISTERS.identity
        stiffness = REGISTERS["wall_stiffness"]
        assert not client.write_registers(stiffness.address, list(stiffness.to_registers(77)), device_id=1).isError()
        assert read("wall_stiffness") == 77
        assert read("latched") == 0
        board.order("leap", "open emergency_stop")
        wait_until(lambda: read("state") == TRIPPED)
        assert names(read("latched")) == ["emergency_stop"]
        client.close()
        board.process.send_signal(signal.SIGINT)
        out, err = board.process.communicate(timeout=60)
        assert board.process.returncode == 130
        assert out == ""
        assert "the order must be one of hold, push, " in err
        assert err.splitlines()[-1] == "hardwall: error: interrupted"


def test_the_serial_port_is_one_for_any_program_and_a_flood_of_random_bytes_silences_none():
    """720 kB, which the line would take half a minute of the board's time for, and none of which is a request.

    The host's five tries of a second are of the board's time, too: it would give up long before the line is through.
    """
    with running(SCENE, "--tcp", "0", "--speed", "0") as board:
        junk, port = random.Random(1).randbytes(720_000), os.open(board.path, os.O_RDWR | os.O_NOCTTY)
        os.write(port, framed(b"\1" + frames.read(0, 2)))
        answer = b""
        while len(answer) < 9:
            answer += os.read(port, 100)
        assert answer == framed(b"\1\3\4" + frames.words(0, REGISTERS["layout"].reset))

        def by_tcp() -> None:
            with socket.create_connection(("127.0.0.1", int(board.tcp.rpartition(":")[2])), timeout=60) as guest:
                with suppress(ConnectionError):
                    guest.sendall(junk)
                with suppress(ConnectionError):
                    assert guest.recv(1) == b""

        def by_terminal() -> None:
            view = memoryview(junk)
            while view:
                view = view[os.write(port, view) :]

        for flood in (by_tcp, by_terminal):
            flood()
            with connect(board.path, answer_s=1.0) as axis:
                assert axis.device.identity == REGISTERS.identity
            connect(board.tcp, answer_s=1.0).close()
        os.close(port)


def test_it_prints_the_count_of_every_sample_and_ends_after_the_time_that_was_asked_for():
    words = command(SCENE, "--seconds", "0.043", "--counts")
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith("counts:")]
    # The last line has what is left.
    assert [len(line) - 1 for line in lines] == [200, 200, 30]
    # The hand holds the handle where it is, at an edge.
    assert {count for line in lines for count in line[1:]} <= {"-1", "0", "1"}
    assert re.search(r"\n0\.043 s in [\d.]+ s: [\d.]+ of real time\n$", done.stdout)


def test_an_interrupt_loses_no_counts():
    """At a run in 0.2 s a line of counts would take 4 s."""
    with started(*command(SCENE, "--counts", "--speed", "0.005")) as process:
        while not line(process).startswith("orders:"):
            pass
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        code, out, err = ended(process)
    assert (code, err.splitlines()[-1]) == (130, "hardwall: error: interrupted")
    (counts,) = out.splitlines()
    assert counts.startswith("counts: ")
    assert len(counts.split()) > 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--speed", "-1"], "--speed must be 0 to 1000 s/s, not -1.0"),
        (["--netlist", "spartan"], "--netlist must be one of ecp5, ice40, gw1nr, not 'spartan'"),
        (["--seconds", "nan"], r"--seconds must be 0 to 1e\+06 s, not nan"),
        (["--set", "output.dac_bits=12", "--set", "output.full_scale_n=20.0"], "seed-2011: output must be absent, .*"),
    ],
)
def test_what_cannot_be_is_one_line(monkeypatch, capsys, arguments, message):
    code, out, err = call(monkeypatch, capsys, *command(SCENE, *arguments)[1:])
    assert (code, out) == (2, "")
    assert re.fullmatch(f"hardwall: error: {message}\n", err)


def test_a_port_that_is_taken_is_one_line(monkeypatch, capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, _, err = call(monkeypatch, capsys, *command(SCENE, "--tcp", str(port))[1:])
    assert (code, err) == (1, f"hardwall: error: port {port} of 127.0.0.1 cannot be opened: Address already in use\n")


@pytest.mark.parametrize("name", ["virtual", "verilog", "synth"])
def test_an_axis_that_can_have_no_board_is_one_line(name, monkeypatch, capsys, tmp_path):
    slow = ["--set", "controller.clock_hz=400000", "--set", "encoder.count_m=20e-6"]
    monkeypatch.chdir(tmp_path)
    code, _, err = call(monkeypatch, capsys, name, "seed-2011", *slow)
    assert code == 2
    assert err == "hardwall: error: the scene's clock_hz must be 460800 or more for a UART, not 400000\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("flood", ["/dev/zero", "nonsense"] if LONG else ["nonsense"])
def test_a_flood_of_orders_does_not_hold_it_up(flood, tmp_path):
    if flood == "nonsense":
        flood = tmp_path / flood
        flood.write_text("y\n" * 100_000)
    with open(flood, "rb") as orders:
        words = command(SCENE, "--seconds", "0.02")
        done = subprocess.run(words, stdin=orders, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "the order must be one of hold, " in done.stderr


def test_it_is_no_faster_than_asked_for_however_much_a_host_says():
    with running(SCENE, "--tcp", "0", "--speed", "0.2", "--seconds", "0.3") as board:
        with socket.create_connection(("127.0.0.1", int(board.tcp.rpartition(":")[2])), timeout=60) as host:
            host.setblocking(False)
            while board.process.poll() is None:
                with suppress(OSError):
                    host.send(b"x")
                time.sleep(0.0003)
        out, err = board.process.communicate(timeout=60)
    assert board.process.returncode == 0, err
    simulated_s, real_s = map(float, re.match(r"([\d.]+) s in ([\d.]+) s", out).groups())
    assert simulated_s <= 0.2 * real_s + 0.002
