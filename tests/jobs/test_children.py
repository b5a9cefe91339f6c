"""Children that end with their parent, whatever ends it."""

import os
import signal
import sys

import pytest

from hardwall.sim.jobs import children
from support.processes import ended_by, line, session, started, wait_until

# The tool has a child of its own, as a build of make and compilers has.
# Where this runs under nohup, the programs that it starts would not hear SIGHUP.
PROGRAM = """
import signal, sys, threading
from hardwall.model.runtime import termination
from hardwall.sim.jobs import children
signal.signal(signal.SIGHUP, signal.SIG_DFL)
termination.hear_signals()
tool = ["sh", "-c", "sleep 600 & echo begun; sleep 600"]
if {in_a_thread}:
    threading.Thread(target=children.run, args=[tool]).start()
    threading.Event().wait()
children.run(tool)
"""


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGKILL", "SIGHUP"])
@pytest.mark.parametrize("in_a_thread", [False, True])
def test_no_child_is_left(number, in_a_thread):
    with started(sys.executable, "-c", PROGRAM.format(in_a_thread=in_a_thread)) as process:
        assert line(process) == "begun"
        assert len(session(process)) >= 4
        process.send_signal(signal.Signals[number])
        wait_until(lambda: session(process) == [])
        assert ended_by(number, process) == ("", "", "")


def test_a_command_runs_to_its_end():
    done = children.run(["sh", "-c", "cat; echo out; echo err >&2; exit 3"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (3, "out\n", "err\n")


def test_a_command_takes_its_children_with_it():
    done = children.run(["sh", "-c", "sleep 600 >/dev/null 2>&1 & echo $!"], capture_output=True, text=True)
    wait_until(lambda: gone(int(done.stdout)))


def test_a_command_is_in_a_group_of_its_own():
    with children.Group() as group:
        assert os.getpgid(group.number) == group.number != os.getpgid(0)
    assert gone(group.number)


def gone(number: int) -> bool:
    """Return whether a process has ended."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return True
    with open(f"/proc/{number}/stat", encoding="utf-8") as stat:
        return stat.read().rpartition(")")[2].split()[0] == "Z"
