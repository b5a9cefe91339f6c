"""Several programs at one board in simulation: they run beside each other, and each is killed in turn."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hardwall.host.connect import connect
from hardwall.host.status import State, Status
from hardwall.model.axis.supervisor import WATCHDOG_RESET_MS
from stimuli.lengths import LONG
from support.command_line import call
from support.processes import HARDWALL, ended, line, started, wait_until
from support.virtual_boards import PACE, SCENE, VirtualBoard, running

AT = "--pace", PACE
READER = """
import sys
from hardwall import host
with host.connect(sys.argv[1], pace=float(sys.argv[2])) as axis:
    for sample in host.Samples(axis, 20.0):
        print(sample.status.state.name if sample.status else "SILENT", flush=True)
"""
"""A script beside the commands."""


@pytest.fixture(scope="module")
def virtual() -> Iterator[VirtualBoard]:
    with running(SCENE, "--tcp", "0", "--speed", str(2 * PACE)) as board:
        yield board


@contextmanager
def shared(virtual: VirtualBoard) -> Iterator[tuple[subprocess.Popen, str]]:
    """Share the board by a process of its own; yield that, and the port that it prints."""
    with started(HARDWALL, "share", virtual.path, *AT) as process:
        name = line(process).removeprefix("shared port: ")
        assert line(process) == "lease: free"
        yield process, name


def seen(name: str) -> Status:
    with connect(name, pace=PACE) as axis:
        return axis.status


@contextmanager
def armed(name: str) -> Iterator[subprocess.Popen]:
    """Start a command that arms; yield it when the board is ARMED."""
    with started(HARDWALL, "arm", name, "--acknowledge", *AT) as arm:
        assert line(arm).startswith("ARMED ")
        yield arm


@contextmanager
def beside_each_other(name: str) -> Iterator[dict[str, subprocess.Popen]]:
    """Start a command that arms, one that watches, and a script, all at one port; yield them when all have begun."""
    with (
        started(HARDWALL, "arm", name, "--acknowledge", *AT) as arm,
        started(HARDWALL, "watch", name, "--json", "--rate", "20", *AT) as watch,
        started(sys.executable, "-c", READER, name, PACE) as script,
    ):
        assert line(arm).startswith("ARMED ")
        assert json.loads(line(watch))["missed"] == 0
        assert line(script) in State.__members__
        yield {"arm": arm, "watch": watch, "script": script}


@pytest.mark.parametrize("first", ["watch", "script"] if LONG else ["watch"])
def test_a_reader_that_is_killed_changes_nothing(virtual, first):
    other = "script" if first == "watch" else "watch"
    with shared(virtual) as (_, name), beside_each_other(name) as programs:
        programs[first].kill()
        programs[first].wait()
        # Longer than the watchdog: it goes on, ARMED, and the other one reads.
        for _ in range(20):
            assert "ARMED" in line(programs[other])
        programs[other].kill()
        programs[other].wait()
        time.sleep(2 * WATCHDOG_RESET_MS / 1000 / PACE)
        assert seen(name).state is State.ARMED
        assert programs["arm"].poll() is None
        programs["arm"].send_signal(signal.SIGINT)
        assert ended(programs["arm"])[0] == 130
        assert seen(name).state is State.DISARMED


def test_the_program_that_armed_is_killed_and_the_board_trips(virtual):
    with shared(virtual) as (share, name):
        with beside_each_other(name) as programs:
            assert re.fullmatch(r"lease: hardwall arm, process \d+", line(share))
            programs["arm"].kill()
            programs["arm"].wait()
            # The readers stay, and see it.
            wait_until(lambda: "TRIPPED" in line(programs["watch"]))
            wait_until(lambda: "TRIPPED" in line(programs["script"]))
            assert seen(name).trip.first == ("link_timeout",)
            assert line(share) == "lease: free"
        # Another program may now arm it.
        with started(HARDWALL, "arm", name, "--acknowledge", "--seconds", "0.5", *AT) as process:
            assert ended(process)[0] == 0


def test_the_owner_of_the_port_is_killed_and_the_board_trips(virtual):
    with shared(virtual) as (share, name), beside_each_other(name) as programs:
        share.kill()
        share.wait()
        for program in ("arm", "watch"):
            code, out, err = ended(programs[program])
            assert code == 1
            assert "is gone: is the cable in, and the board powered?" in err
        # A log that ends so says what it has, too.
        assert json.loads(out.splitlines()[-1])["samples"] > 0
        assert re.search(r"; \d+ samples at 20 Hz, \d+ missed", err)
        wait_until(lambda: seen(virtual.path).state is State.TRIPPED)
        assert seen(virtual.path).trip.first == ("link_timeout",)


def test_an_end_by_a_signal_leaves_the_port_free_and_the_board_to_its_watchdog(virtual):
    with shared(virtual) as (share, name), armed(name):
        share.send_signal(signal.SIGTERM)
        assert ended(share)[0] == 143
        wait_until(lambda: seen(virtual.path).state is State.TRIPPED)


def test_who_holds_the_lease_is_shown_and_another_one_is_refused(virtual, monkeypatch, capsys):
    with shared(virtual) as (_, name), armed(name) as arm:
        code, out, _ = call(monkeypatch, capsys, "connect", name, "--json", *AT)
        holder = f"hardwall arm, process {arm.pid}"
        assert (code, json.loads(out)["lease"]) == (0, holder)
        said = f"the lease of the board at {name} is held by {holder}: it alone writes, others may read and disarm"
        code, out, err = call(monkeypatch, capsys, "set", name, "wall_stiffness=1", *AT)
        assert (code, out, err) == (1, "", f"hardwall: error: {said}\n")
        assert seen(name).state is State.ARMED
        # The port itself is taken.
        code, _, err = call(monkeypatch, capsys, "connect", virtual.path, *AT)
        assert code == 1
        assert "another program uses it; `hardwall share` shares a board" in err
        # Any of them may disarm, and the program that armed ends.
        assert call(monkeypatch, capsys, "disarm", name, *AT)[0] == 0
        code, _, err = ended(arm)
        assert code == 1
        assert "the axis is DISARMED: the loop of drive_enable opened, or another program disarmed it" in err
    code, out, _ = call(monkeypatch, capsys, "connect", virtual.path, "--json", *AT)
    assert (code, json.loads(out)["lease"]) == (0, None)


def test_what_cannot_be_is_one_line(virtual, monkeypatch, capsys):
    with shared(virtual) as (_, name):
        number = name.rpartition(":")[2]
        for words, code, said in (
            (["/dev/hardwall-absent"], 1, "cannot be opened: there is no such port"),
            ([name, "--tcp", number], 1, f"port {number} of 127.0.0.1 cannot be opened: Address already in use"),
            ([name, "--seconds", "nan"], 2, "--seconds must be 0 to 1e+06 s, not nan"),
            ([name, "--tcp", "65536"], 2, "--tcp must be "),
            ([name, "--identity", "no"], 1, "it has another bitstream"),
        ):
            found, out, err = call(monkeypatch, capsys, "share", *words, *AT)
            assert (found, out, err.count("\n")) == (code, "", 1)
            assert said in err
