"""Commands that store results, ended at any time: no process is left, nothing is lost, and the next run goes on.

`HARDWALL_KILLS` is the number of runs that are ended, of all commands together; `make fuzz` ends 200. Every run is
ended by the next of three signals at a random part of the time that a whole run takes, with the suite's seed.
"""

import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from hardwall.model.runtime import termination
from hardwall.model.runtime.build_folder import build_dir
from hardwall.testing import rng
from support.processes import HARDWALL, ended, session, started, stored, wait_until

KILLS = int(os.environ.get("HARDWALL_KILLS", "0"))
"""The number of runs that are ended; 0 for one run of every quick command."""
CODES = {signal.SIGKILL: -9} | {number: code for number, (code, _) in termination.CODES.items()}
SHORT = {
    "protocol.start_m": -0.001, "protocol.settle_s": 0.3, "protocol.mean_s": 0.05, "protocol.measure_s": 0.1,
    "zwidth.stiffness_step_n_per_m": 5e3, "zwidth.stiffness_to_n_per_m": 60e3,
    "zwidth.damping_from_n_s_per_m": 20.0, "zwidth.damping_to_n_s_per_m": 140.0, "zwidth.damping_step_n_s_per_m": 40.0,
}  # fmt: skip
FEW_WALLS = {"zwidth.stiffness_step_n_per_m": 30e3, "zwidth.damping_step_n_s_per_m": 120.0}
STABLE_WALLS = FEW_WALLS | {"zwidth.stiffness_step_n_per_m": 10e3}
"""A trade needs a wall that is stable."""
SET, FEW, STABLE = (
    [f"--set={key}={value}" for key, value in keys.items()] for keys in (SHORT, SHORT | FEW_WALLS, SHORT | STABLE_WALLS)
)
WALLS = SET if KILLS else FEW
RUNS: dict[str, tuple[str, ...]] = {
    "zwidth": ("zwidth", "seed-2011", "--estimators", "adjusted,fdm-500", "--workers", "2", "--resume", *WALLS),
    "accuracy": ("accuracy", "--estimators", "levant,fdm,kalman", "--rates", "1e3,2e3,5e3", "--workers", "2"),
    "zwidth alone": ("zwidth", "seed-2011", "--estimators", "adjusted", "--workers", "1", "--resume", *SET),
    "cutoff": ("cutoff", "seed-2011", "--workers", "2", "--resume", *FEW),
    "rates": ("rates", "seed-2011", "--estimators", "fdm", "--rates", "1e3,1e4", "--workers", "2", "--resume", *FEW),
    "gains": ("gains", "seed-2011", "--workers", "2", "--resume", *FEW),
    "drop": ("drop", "seed-2011", "--workers", "2", "--resume", *FEW),
    "trade": ("trade", "seed-2011", "--workers", "2", "--resume", *STABLE),
}
NAMES = list(RUNS) if KILLS else ["zwidth"]
TIMES = {"seconds", "samples_per_s", "hit_s", "map_s", "best_for"}
"""Keys of reports that depend on times."""


def timeless(value: Any) -> Any:
    """Return a report without what depends on times."""
    if isinstance(value, dict):
        return {key: timeless(member) for key, member in value.items() if key not in TIMES}
    return [timeless(member) for member in value] if isinstance(value, list) else value


def environment(folder: Path) -> dict[str, str]:
    """Return an environment with results of its own, and with the compiled files that are there already."""
    build = folder / "build"
    build.mkdir()
    for name in ("numba", "rtl"):
        (build_dir() / name).mkdir(parents=True, exist_ok=True)
        (build / name).symlink_to(build_dir() / name)
    return {"HARDWALL_BUILD": str(build)}


def hears(process: subprocess.Popen) -> bool:
    """Return whether a process handles SIGTERM, and so every signal of `termination`."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = int(re.search(r"^SigCgt:\s*(\w+)", status, re.MULTILINE)[1], 16)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def report_of(command: tuple[str, ...], environ: dict[str, str]) -> dict[str, Any]:
    """Run a command to its end; return its report without times."""
    with started(HARDWALL, *command, "--json", **environ) as process:
        code, out, err = ended(process)
    assert code == 0, err
    return timeless(json.loads(out))


@pytest.fixture(scope="module")
def whole(request, tmp_path_factory) -> tuple[float, dict]:
    """Return the time and the report of a whole run; of two runs, which many kills have, the first also compiles."""
    for _ in range(2 if KILLS else 1):
        began, folder = time.monotonic(), tmp_path_factory.mktemp("whole")
        report = report_of(RUNS[request.param], environment(folder))
    return time.monotonic() - began, report


@pytest.mark.parametrize(("name", "whole"), [(name, name) for name in NAMES], ids=NAMES, indirect=["whole"])
def test_what_is_ended_goes_on(whole, tmp_path_factory, name):
    seconds, report = whole
    chance = rng()
    for number in range(max(KILLS // len(RUNS), 1)):
        folder = tmp_path_factory.mktemp("killed")
        environ, (way, code) = environment(folder), list(CODES.items())[(number + NAMES.index(name)) % len(CODES)]
        with started(HARDWALL, *RUNS[name], "--json", **environ) as process:
            # Before that, Python itself answers an interrupt, with a traceback.
            wait_until(lambda process=process: hears(process))
            time.sleep(seconds * chance.random())
            process.send_signal(way)
            found, out, err = ended(process)
            wait_until(lambda process=process: not session(process))
        assert "Traceback" not in err
        if found == 0 or found == -way != code:
            # The signal came too late: all is done, or Python itself ends, and handles no signal any more.
            assert timeless(json.loads(out)) == report
        else:
            assert found == code, err
            assert err.count("error") <= 1
        kept = stored(folder / "build")
        assert report_of(RUNS[name], environ) == report
        assert set(kept) <= set(stored(folder / "build")), "nothing is lost"
        assert len(set(stored(folder / "build"))) == len(stored(folder / "build")), "nothing is computed again"
