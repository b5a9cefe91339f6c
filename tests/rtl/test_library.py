"""Builds of the Verilated axis that are ended in the middle."""

import signal
from pathlib import Path

import pytest

from hardwall.model.compiled import build_dir
from stimuli.processes import HARDWALL, ended, session, started, wait_until


def building(build: Path) -> list[Path]:
    """Return the folders of unfinished builds in which Verilator has begun."""
    return [path.parent for path in build.glob("rtl/building-*/obj")]


@pytest.mark.parametrize("number", ["SIGINT", "SIGKILL"])
def test_a_build_that_is_ended_leaves_no_process_behind(tmp_path, number):
    (tmp_path / "numba").symlink_to(build_dir() / "numba")
    with started(HARDWALL, "hit", "--backend", "rtl", "--json", HARDWALL_BUILD=str(tmp_path)) as process:
        wait_until(lambda: building(tmp_path))
        process.send_signal(signal.Signals[number])
        wait_until(lambda: session(process) == [])
        code, out, err = ended(process)
    if number == "SIGINT":
        assert (code, out, err.splitlines()[-1]) == (130, "", "hardwall: error: interrupted")
        assert building(tmp_path) == []
    else:
        assert (code, out) == (-signal.SIGKILL, "")
