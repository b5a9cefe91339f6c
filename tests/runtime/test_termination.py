"""Ends by a signal: the exit code, one line, and what is undone before."""

import signal
import sys
import time

import pytest

from hardwall.model.runtime import termination
from support.processes import ended, ended_by, line, session, started, wait_until

PROGRAM = """
import signal, sys, time
from pathlib import Path
from hardwall.model.runtime.whole_file import whole_file
from hardwall.model.runtime import termination
# As in a shell, or under nohup, whatever the tests run under.
signal.signal(signal.SIGHUP, {hangup})
termination.hear_signals()
termination.go_on_by("--resume goes on from there")
for _ in range({kept}):
    termination.count_kept()
with termination.undone(Path("outer").touch), termination.undone(lambda: Path("inner").touch(Path("outer").exists())):
    with whole_file("file.txt") as part:
        part.touch()
        print("finished", end="")  # stays in the buffer
        Path("ready").touch()
        time.sleep(600)
"""


@pytest.mark.parametrize("kept", [0, 1, 2])
@pytest.mark.parametrize(
    ("number", "code", "word"),
    [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated"), ("SIGHUP", 129, "the terminal was closed")],
)
def test_a_signal_ends_the_program_in_a_line(tmp_path, monkeypatch, kept, number, code, word):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-c", PROGRAM.format(kept=kept, hangup="signal.SIG_DFL")) as process:
        wait_until((tmp_path / "ready").exists)
        process.send_signal(signal.Signals[number])
        assert ended(process) == (code, "finished", f"hardwall: error: {word}{REMARKS[kept]}\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["inner", "outer", "ready"]


def test_under_nohup_a_terminal_that_is_closed_ends_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-c", PROGRAM.format(kept=0, hangup="signal.SIG_IGN")) as process:
        wait_until((tmp_path / "ready").exists)
        process.send_signal(signal.SIGHUP)
        process.send_signal(signal.SIGTERM)
        assert ended(process)[0] == 143


REMARKS = {
    0: "",
    1: "; 1 new result is kept, and --resume goes on from there",
    2: "; 2 new results are kept, and --resume goes on from there",
}


def test_a_run_says_what_there_is_of_it_unless_results_are_kept():
    termination.begin()
    termination.said_by(lambda: "7 samples")
    assert termination.remark() == "; 7 samples"
    termination.count_kept()
    assert termination.remark().startswith("; 1 new result is kept")
    termination.begin()
    assert termination.remark() == ""


# What is undone may not print: the signal may come while this program does.
SLOWLY = """
import os, time
from hardwall.model.runtime import termination
termination.hear_signals()
with termination.undone(lambda: (os.write(1, b"undoing\\n"), time.sleep(1))):
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_more_signals_do_not_hold_up_the_end(number):
    with started(sys.executable, "-c", SLOWLY) as process:
        assert line(process) == "ready"
        process.send_signal(signal.SIGINT)
        assert line(process) == "undoing"
        for _ in range(5):
            process.send_signal(signal.Signals[number])
            time.sleep(0.05)
        assert ended_by("SIGINT", process) == ("", "", "")


# The thread that is interrupted has a lock that another thread's undoing waits for; the next part is undone no more.
HELD = """
import threading, time
from hardwall.model.runtime import termination
termination.UNDO_S = 0.2
lock = threading.Lock()
termination.hear_signals()
with termination.undone(lock.acquire), lock:
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_what_cannot_be_undone_does_not_hold_up_the_end(number):
    with started(sys.executable, "-c", HELD) as process:
        assert line(process) == "ready"
        process.send_signal(signal.Signals[number])
        assert ended_by(number, process) == ("", "", "")


# What starts a thread takes the lock of the list of threads, which the thread that is interrupted has.
STARTING = """
import threading, time
from pathlib import Path
from hardwall.model.runtime import termination
termination.hear_signals()
with termination.undone(Path("undone").touch), threading._active_limbo_lock:
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_thread_that_is_being_started_does_not_hold_up_the_end(tmp_path, monkeypatch, number):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-c", STARTING) as process:
        assert line(process) == "ready"
        process.send_signal(signal.Signals[number])
        assert ended_by(number, process) == ("", "", "")
    assert (tmp_path / "undone").exists()


# Nobody reads what a program says, and its pipe is full.
UNHEARD = """
import os, time
from pathlib import Path
from hardwall.model.runtime import termination
termination.GRACE_S = 0.2
termination.hear_signals()
os.set_blocking(2, False)
try:
    while True:
        os.write(2, bytes(4096))
except BlockingIOError:
    os.set_blocking(2, True)
with termination.undone(Path("undone").touch):
    print("ready", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_a_reader_that_has_stopped_does_not_hold_up_the_end(tmp_path, monkeypatch, number):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-c", UNHEARD) as process:
        assert line(process) == "ready"
        process.send_signal(signal.Signals[number])
        wait_until(lambda: session(process) == [])
        assert process.wait() == termination.CODES[signal.Signals[number]][0]
    assert (tmp_path / "undone").exists()


# What is printed has no reader any more.
UNREAD = """
import os, time
from hardwall.model.runtime import termination
termination.hear_signals()
print("unread")
os.write(1, b"ready\\n")
time.sleep(600)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM"])
def test_stdout_that_was_closed_is_no_more_than_the_line_of_the_end(number):
    with started(sys.executable, "-c", UNREAD) as process:
        assert line(process) == "ready"
        process.stdout.close()
        process.send_signal(signal.Signals[number])
        assert ended_by(number, process)[1:] == ("", "")


def test_what_ends_without_a_signal_is_undone_once():
    calls = []
    with termination.undone(lambda: calls.append("undone")):
        assert calls == []
    assert calls == ["undone"]


def test_a_run_begins_with_nothing_kept():
    termination.count_kept()
    assert "kept" in termination.remark()
    termination.begin()
    assert termination.remark() == ""


def test_a_program_that_says_no_more_is_a_failure_of_its_test():
    with started(sys.executable, "-c", "") as process, pytest.raises(AssertionError):
        line(process)
