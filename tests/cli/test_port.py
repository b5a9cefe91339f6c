"""The commands that speak to a board, as they are called, with a board in simulation."""

import errno
import json
import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from hardwall.host.connect import connect
from hardwall.host.errors import HostError
from hardwall.host.status import State
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.runtime.termination import CODES
from hardwall.sim.scene.load import load
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import HARDWALL, ended, started, wait_until
from support.reports import check_text
from support.virtual_boards import ACCELERATED, PACE, SCENE, VirtualBoard, running

AT = "--pace", PACE
"""What every command is told of the board."""
REGISTERS = RegisterMap(load("seed-2011", SCENE).spec)


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(SCENE, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


@pytest.fixture(scope="module")
def accelerated() -> Iterator[VirtualBoard]:
    """Another board, for the last tests alone: it takes a part of a core while it lives."""
    with running(ACCELERATED, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


class Called(NamedTuple):
    """What came of a command that was called in this process."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def called(monkeypatch, capsys) -> Callable[..., Called]:
    """Return what calls a command in this process: a process of its own would take a second to begin."""
    return lambda *words: Called(*call(monkeypatch, capsys, *words, *AT))


@pytest.fixture
def hangup_is_heard() -> Iterator[None]:
    """Let programs that are started hear SIGHUP, though the tests run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


def state_of(board: VirtualBoard) -> State | None:
    """Return the state of a board; None while another host has it."""
    try:
        with connect(board.path, pace=PACE) as axis:
            return axis.status.state
    except HostError:
        return None


def test_connect_says_what_a_board_is(virtual, called):
    done = called("connect", virtual.path, "--registers", "--json")
    assert done.returncode == 0, done.stderr
    check_text("connect", done.stdout)
    report = json.loads(done.stdout)
    assert report["identity"] == REGISTERS.identity
    assert report["clock_hz"] == 1_000_000
    assert report["link"]["requests"] > 0
    values = {row["name"]: row["value"] for row in report["rows"]}
    assert values["supervisor_watchdog"] == pytest.approx(0.2)
    assert report["acceleration_m_per_s2"] is None
    assert "acceleration" not in values
    assert "commit" not in values
    shown = called("connect", virtual.tcp)
    assert re.search(rf"^identity +{REGISTERS.identity}", shown.stdout, re.MULTILINE)
    assert "0x00c8" in called("connect", virtual.tcp, "--registers").stdout


def test_set_writes_and_says_what_is_used(virtual, called):
    done = called("set", virtual.path, "wall_position=-2e-3", "wall_stiffness=1000", "--json")
    assert done.returncode == 0, done.stderr
    check_text("set", done.stdout)
    used = json.loads(done.stdout)
    assert used["wall_position"] == pytest.approx(-2e-3, abs=1e-5)
    assert used["wall_stiffness"] == pytest.approx(1000, abs=REGISTERS["wall_stiffness"].lsb)


# Other tests interrupt it, too.
@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGHUP"] if LONG else ["SIGTERM", "SIGHUP"])
def test_arm_lasts_as_long_as_its_command(virtual, called, hangup_is_heard, number):
    with started(HARDWALL, "arm", virtual.path, "--acknowledge", *AT) as process:
        assert process.stdout.readline().startswith("ARMED ")
        # Another host cannot have the port meanwhile.
        busy = called("disarm", virtual.path)
        assert busy.returncode == 1
        assert "another program uses it; `hardwall share` shares a board" in busy.stderr
        process.send_signal(signal.Signals[number])
        code, _, err = ended(process)
    assert code == CODES[signal.Signals[number]][0], err
    assert state_of(virtual) is State.DISARMED


def test_a_host_that_is_killed_leaves_a_board_that_trips(virtual, called):
    with started(HARDWALL, "arm", virtual.path, "--acknowledge", *AT) as process:
        assert process.stdout.readline().startswith("ARMED ")
        process.kill()
        process.wait()
    wait_until(lambda: state_of(virtual) is State.TRIPPED)
    done = called("connect", virtual.path, "--json")
    assert json.loads(done.stdout)["first_causes"] == ["link_timeout"]
    done = called("arm", virtual.path, "--seconds", "0.1")
    assert done.returncode == 1
    assert "acknowledge it first: link_timeout: the host's heartbeat has stopped" in done.stderr
    assert called("arm", virtual.path, "--seconds", "0.1", "--acknowledge").returncode == 0


def test_a_trip_can_be_acknowledged_without_arming(virtual, called):
    virtual.order("open emergency_stop")
    wait_until(lambda: state_of(virtual) is State.TRIPPED)
    done = called("disarm", virtual.path, "--acknowledge")
    assert done.returncode == 1
    assert "still tripped: emergency_stop: " in done.stderr
    virtual.order("close emergency_stop")
    done = called("disarm", virtual.path, "--acknowledge", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["state"] == "DISARMED"


def test_a_trip_ends_arm(virtual):
    with started(HARDWALL, "arm", virtual.path, "supervisor_force_limit=5", "--acknowledge", *AT) as process:
        assert process.stdout.readline().startswith("ARMED ")
        virtual.order("open emergency_stop")
        code, _, err = ended(process)
    virtual.order("close emergency_stop")
    assert code == 1
    assert err.splitlines()[-1].startswith("hardwall: error: the axis is TRIPPED: emergency_stop: ")


def test_watch_shows_a_line_and_home_finds_the_index(virtual, called):
    with started(HARDWALL, "watch", virtual.path, "--seconds", "0.2", *AT) as process:
        code, out, err = ended(process)
    assert code == 0, err
    assert " mm/s " in out
    assert "m/s^2" not in out
    done = called("home", virtual.path, "--seconds", "0.2")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "hardwall: error: in 0.2 s the axis did not see the index: move the handle over it"
    )
    with started(HARDWALL, "home", virtual.path, "--at", "0.1", "--json", *AT) as process:
        assert process.stderr.readline() == "move the handle over its index\n"
        virtual.order("hold 7")
        code, out, err = ended(process)
    assert code == 0, err
    check_text("home", out)
    assert json.loads(out)["position_m"] == pytest.approx(0.1, abs=9e-3)
    done = called("disarm", virtual.path, "--json")
    check_text("disarm", done.stdout)
    virtual.order("hold -1")
    time.sleep(0.1)


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["set", "PORT", "wall_stiffness=1e9"], 2, "wall_stiffness must be 0 to 204797 N/m, not "),
        (["set", "PORT", "wall_stiffness=nan"], 2, "wall_stiffness must be 0 to 204797 N/m, not "),
        (["set", "PORT", "speed=1"], 2, "word must be one of the board's, not 'speed'; they are preload_count, "),
        (["set", "PORT", "wall_left"], 2, "a word must be NAME=NUMBER, each once, not 'wall_left'"),
        (["set", "PORT", "wall_left=1", "wall_left=0"], 2, "a word must be NAME=NUMBER, each once, not 'wall_left=0'"),
        (["set", "PORT", "wall_left=one"], 2, "'wall_left' must be a decimal number such as 0.5 or 5e-4, not 'one'"),
        (["home", "PORT", "--at", "1e9"], 2, "--at must be -0.65536 to 0.65535 m, not 1000000000.0"),
        (["home", "PORT", "--seconds", "-1"], 2, "--seconds must be 0 to 1e+06 s, not -1.0"),
        (["arm", "PORT", "--seconds", "nan"], 2, "--seconds must be 0 to 1e+06 s, not nan"),
        (["connect", "PORT", "--pace", "0"], 2, "--pace must be 0.001 to 1 s/s, not 0.0"),
        (["watch", "PORT", "--seconds", "inf"], 2, "--seconds must be 0 to 1e+06 s, not inf"),
        (["capture", "PORT", "--trigger", "contact,noise"], 2, "--trigger must be of contact, trip, rise, fall, hand,"),
        (["capture", "PORT", "--before", "3000"], 2, "before must be 0 to 2047, not 3000"),
        (["capture", "PORT", "--last", "--arm"], 2, "--last reads a finished capture: no word, --arm, "),
        (["capture", "PORT", "--last", "--trigger", "trip"], 2, "--last reads a finished capture: no word, "),
        (["capture", "PORT", "--last", "--acceleration"], 2, "--last reads a finished capture: no word, --arm, "),
        (["capture", "PORT", "--acceleration"], 1, "the board has no acceleration: its estimator estimates only the "),
        (["capture", "PORT", "-o", "hit.csv"], 2, "--out must end in .npz, not 'hit.csv'"),
        (["connect", "PORT", "--identity", "no"], 1, "it has another bitstream"),
        (["connect", "/dev/hardwall-absent"], 1, "cannot be opened: there is no such port"),
    ],
)
def test_what_cannot_be_is_one_line(virtual, monkeypatch, capsys, words, code, message):
    given = [virtual.path if word == "PORT" else word for word in words]
    ended_with, out, err = call(monkeypatch, capsys, *given, *([] if "--pace" in words else AT))
    assert (ended_with, out) == (code, "")
    assert err.startswith("hardwall: error: ")
    assert len(err.splitlines()) == 1
    assert message in err


def test_a_contact_is_captured_into_a_file_and_a_picture(virtual, tmp_path):
    words = "wall_position=1e-3", "wall_stiffness=2000", "wall_damping=5", "supervisor_force_limit=20"
    files = "-o", tmp_path / "hit.npz", "--plot", tmp_path / "hit.png"
    with connect(virtual.path, pace=PACE) as axis:
        axis.acknowledge()
        axis.preload(0.0)
    with started(
        HARDWALL, "capture", virtual.path, *words, "--arm", "--before", "100", *files, "--json", *AT
    ) as process:
        assert process.stderr.readline().endswith("records waits for its trigger\n")
        virtual.order("hold 3")
        code, out, err = ended(process)
    virtual.order("hold -1")
    assert code == 0, err
    check_text("capture", out)
    report = json.loads(out)
    assert report["before"] == 100
    assert {"armed", "contact", "live"} <= set(report["flags"])
    assert report["position_most_m"] > 1e-3 > report["position_least_m"]
    with np.load(tmp_path / "hit.npz") as saved:
        assert len(saved["time_s"]) == report["records"] == 2048
        inside = saved["position_m"] > 1e-3
        assert not inside[:100].any()
        # The first record at the trigger is the first in the wall, but for a count at its edge.
        assert 99 < np.argmax(inside) < 200
        contact = saved["flags"] >> 2 & 1
        assert not contact[:100].any()
        assert contact[100]
    assert (tmp_path / "hit.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert state_of(virtual) is State.DISARMED


def test_a_capture_by_hand_and_one_that_does_not_come(virtual, called):
    done = called("capture", virtual.path, "--trigger", "hand", "--before", "10", "--decimation", "2", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["before"] == 10
    done = called("capture", virtual.path, "--trigger", "trip", "--before", "0", "--seconds", "2")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "hardwall: error: the capture is not DONE in 2 s: it is WAITING"


def test_a_capture_whose_file_cannot_be_written_is_read_again(virtual, called, monkeypatch, tmp_path):
    def full(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as context:
        context.setattr(Path, "write_bytes", full)
        lost = called("capture", virtual.path, "--trigger", "hand", "--before", "7", "--json", "-o", tmp_path / "a.npz")
    assert lost.returncode == 1
    said = f"; the board keeps the capture: `hardwall capture {virtual.path} --last` reads it again\n"
    assert lost.stderr.endswith(f"a.npz: cannot be written (No space left on device){said}")
    again = called("capture", virtual.path, "--last", "--json", "-o", tmp_path / "b.npz")
    assert (again.returncode, again.stdout) == (0, lost.stdout)
    with np.load(tmp_path / "b.npz") as saved:
        assert saved["place"] == json.loads(lost.stdout)["before"] == 7


def test_there_may_be_no_last_capture(virtual, called):
    with connect(virtual.path, pace=PACE) as axis:
        axis.capture.start(["trip"])
    done = called("capture", virtual.path, "--last")
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch("hardwall: error: the capture is (FILLING|WAITING): wait until it is DONE\n", done.stderr)


def test_an_acceleration_is_reported_and_shown_where_a_board_has_one(accelerated, called):
    done = called("connect", accelerated.path, "--json")
    assert done.returncode == 0, done.stderr
    check_text("connect", done.stdout)
    assert isinstance(json.loads(done.stdout)["acceleration_m_per_s2"], float)
    done = called("watch", accelerated.path, "--seconds", "0.2")
    assert re.search(r" mm/s +-?[\d.]+ m/s\^2 +-?[\d.]+ N", done.stdout)
    done = called("watch", accelerated.path, "--seconds", "0.2", "--json")
    check_text("watch", done.stdout)
    assert isinstance(json.loads(done.stdout.splitlines()[0])["acceleration_m_per_s2"], float)


def test_the_acceleration_is_captured_into_a_file_and_a_picture(accelerated, called, tmp_path):
    files = "-o", tmp_path / "hit.npz", "--plot", tmp_path / "hit.png"
    done = called("capture", accelerated.path, "--trigger", "hand", "--acceleration", *files, "--json")
    assert done.returncode == 0, done.stderr
    check_text("capture", done.stdout)
    report = json.loads(done.stdout)
    assert "speed_most_m_per_s" not in report
    with np.load(tmp_path / "hit.npz") as saved:
        assert "velocity_m_per_s" not in saved
        assert abs(saved["acceleration_m_per_s2"]).max() == report["acceleration_most_m_per_s2"]
    assert (tmp_path / "hit.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    # What is read again is what was recorded.
    again = called("capture", accelerated.path, "--last", "--json")
    assert json.loads(again.stdout) == report
