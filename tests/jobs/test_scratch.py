"""Temporary folders of builds, and what killed processes leave of them."""

import signal
import sys
import threading

from hardwall.sim.jobs.scratch import scratch
from support.processes import line, started

PROGRAM = """
import sys, time
from pathlib import Path
from hardwall.sim.jobs.scratch import scratch
with scratch(Path(sys.argv[1])) as folder:
    (folder / "part").touch()
    print(folder.name, flush=True)
    time.sleep(600)
"""


def names(folder) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_folder_lasts_as_long_as_its_context(tmp_path):
    with scratch(tmp_path / "builds") as folder:
        assert folder.parent == tmp_path / "builds"
        (folder / "part").touch()
    assert names(tmp_path / "builds") == set()


def test_what_a_killed_process_left_is_removed_and_what_is_in_use_stays(tmp_path):
    with started(sys.executable, "-c", PROGRAM, tmp_path) as process:
        theirs = line(process)
        with scratch(tmp_path) as ours:
            assert names(tmp_path) == {theirs, ours.name}
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert names(tmp_path) == {theirs}
        with scratch(tmp_path) as ours:
            assert names(tmp_path) == {ours.name}


def test_a_folder_without_a_lock_is_left_over(tmp_path):
    (tmp_path / "building-old").mkdir()
    (tmp_path / "building-old" / "part").touch()
    (tmp_path / "finished").mkdir()
    with scratch(tmp_path) as ours:
        assert names(tmp_path) == {"finished", ours.name}


def test_many_at_once_never_take_each_other_s_folder(tmp_path):
    failures = []

    def often():
        for _ in range(30):
            with scratch(tmp_path) as folder:
                (folder / "part").write_text("whole", encoding="ascii")
                if (folder / "part").read_text(encoding="ascii") != "whole":
                    failures.append(folder)

    threads = [threading.Thread(target=often) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []
    assert names(tmp_path) == set()
