"""Faults injected into the board under the simulator, with a seeded bug or without."""

import hashlib
import json
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from hardwall.model.build_folder import build_dir
from hardwall.sim.rtl import cocotb_runner
from hardwall.sim.rtl.board_library import AMPLIFIERS
from hardwall.testing import SEED
from proofs.bugs import Bug

from .damaged import Damaged
from .damaged_axes import DamagedAxes
from .fault import Fault, Outcome
from .staged import DEVICES, StagedAxes

IN_SIMULATOR = Path(__file__).with_name("faults_in_simulator.py")


def run(stage: str, faults: Sequence[Fault], bug: Bug | None = None) -> list[Outcome]:
    """Return what comes of faults of `FAULTS[stage]`, one after the other.

    Raises:
        RuntimeError: if the simulation fails, or a fault has no outcome.
    """
    names = [fault.name for fault in faults]
    digest = hashlib.sha256(repr((stage, names, str(bug))).encode()).hexdigest()[:16]
    folder = build_dir() / "faults" / digest
    folder.mkdir(parents=True, exist_ok=True)
    report, log = folder / "report", folder / "log"
    environ = {"HARDWALL_PARAMETERS": json.dumps({"stage": stage, "names": names, "report": str(report)})}
    amplifiers = AMPLIFIERS.read_text(encoding="utf-8")
    job = cocotb_runner.Job(IN_SIMULATOR.stem, IN_SIMULATOR.parent, environ, SEED, log=log, more=amplifiers)
    device = DEVICES[stage]
    with bug.seeded() if bug else nullcontext():
        damaged = DamagedAxes(device) if isinstance(device, StagedAxes) else Damaged(device)
        cocotb_runner.simulate(damaged, "damaged", job)
    rows = [json.loads(line) for line in report.read_text(encoding="utf-8").splitlines()]
    if [row["name"] for row in rows] != names:
        raise RuntimeError(f"{len(rows)} of {len(faults)} faults have an outcome: see {log}")
    return [Outcome(**{**row, "wrong": tuple(row["wrong"])}) for row in rows]
