"""Jobs on threads, and the end of what they wait for; `test_store` has what is kept of them."""

import signal
import sys
import threading
import time
from pathlib import Path

import pytest

from hardwall.sim.jobs import children, parallel
from hardwall.sim.jobs.store import Store
from support import jobs
from support.processes import ended_by, session, started, wait_until


@pytest.mark.parametrize("number", ["SIGINT", "SIGTERM", "SIGKILL"])
def test_no_tool_of_a_job_is_left(tmp_path, monkeypatch, number):
    monkeypatch.chdir(tmp_path)
    with started(sys.executable, "-m", "support.jobs", HARDWALL_BUILD=str(tmp_path)) as process:
        wait_until(lambda: all(Path(f"begun-{job}").exists() for job in (1, 2)))
        wait_until(lambda: len(session(process)) >= 9)
        process.send_signal(signal.Signals[number])
        wait_until(lambda: session(process) == [])
        kept = "; 1 new result is kept, and the same command goes on from there"
        assert ended_by(number, process) == ("", "", "" if number == "SIGKILL" else kept)


def test_a_job_that_fails_ends_the_others(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=r"^this job fails$"):
        parallel.run(jobs.fail_beside_a_long_job, [{"number": 0}, {"number": 1}], Store("failures"), 2)
    assert Path("begun-1").exists()


def test_a_tool_that_begins_behind_the_failure_ends_too():
    """The other job is in Python of its own when the first fails."""
    failed = threading.Event()

    def job(number: int) -> None:
        if number:
            failed.wait()
            time.sleep(0.3)
            children.run(["sleep", "600"])
        failed.set()
        raise ValueError("this job fails")

    with pytest.raises(ValueError, match=r"^this job fails$"):
        parallel.run(job, [{"number": 1}, {"number": 0}], Store("failures"), 2)
