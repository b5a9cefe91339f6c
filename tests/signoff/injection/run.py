"""Faults injected into the board under the simulator, with a seeded bug or without; what was safe is kept."""

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

from amaranth.lib import wiring

from hardwall.hdl.export import to_verilog
from hardwall.model.runtime.build_folder import build_dir
from hardwall.sim.rtl import cocotb_build, cocotb_runner
from hardwall.sim.rtl.board_library import AMPLIFIERS
from hardwall.testing import SEED
from signoff.covering.sources import code_of_all, means
from signoff.kept import Findings, digest_of
from signoff.proofs.bugs import Bug

from .damaged import Damaged
from .damaged_axes import DamagedAxes
from .fault import Fault, Outcome
from .staged import DEVICES, StagedAxes

IN_SIMULATOR = Path(__file__).with_name("faults_in_simulator.py")
TOGETHER = 16
"""The faults of a stage that one simulation has, one after the other."""


def _damaged(stage: str) -> wiring.Component:
    device = DEVICES[stage]
    return DamagedAxes(device) if isinstance(device, StagedAxes) else Damaged(device)


def _outcome(row: dict[str, Any]) -> Outcome:
    return Outcome(**{**row, "wrong": tuple(row["wrong"])})


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
    with bug.seeded() if bug else nullcontext():
        cocotb_runner.simulate(_damaged(stage), "damaged", job)
    rows = [json.loads(line) for line in report.read_text(encoding="utf-8").splitlines()]
    if [row["name"] for row in rows] != names:
        raise RuntimeError(f"{len(rows)} of {len(faults)} faults have an outcome: see {log}")
    return [_outcome(row) for row in rows]


def origin_digest(stage: str) -> str:
    """Return a digest of all that the outcomes of a stage come from: the board, its amplifier and the faults."""
    injected_by = means(__file__, cocotb_build.__file__, cocotb_runner.__file__, AMPLIFIERS)
    return digest_of(stage, to_verilog(_damaged(stage), "damaged"), code_of_all(IN_SIMULATOR), injected_by, SEED)


def run_all(
    faults: dict[str, Sequence[Fault]], done: Callable[[str, int], None], findings: Findings
) -> dict[str, list[Outcome]]:
    """Return what comes of faults, by their stages, in their order; what was safe before is not injected again.

    Args:
        faults: the faults by the names of their stages.
        done: told a stage, and how many more of its faults are through.
        findings: what was found before; what is found is added.

    Raises:
        RuntimeError: if a simulation fails, or a fault has no outcome.
    """
    # The hardware is made by this thread alone.
    digests = {stage: origin_digest(stage) for stage in faults}
    came: dict[str, dict[str, Outcome]] = {stage: {} for stage in faults}
    waiting: list[tuple[str, list[Fault]]] = []
    for stage, some in faults.items():
        kept = {fault.name: findings.of(f"{stage}: {fault.name}", digests[stage]) for fault in some}
        came[stage] = {name: _outcome(row) for name, row in kept.items() if row}
        left = [fault for fault in some if fault.name not in came[stage]]
        waiting += [(stage, left[n : n + TOGETHER]) for n in range(0, len(left), TOGETHER)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        futures = {pool.submit(run, stage, some): stage for stage, some in waiting}
        for future in as_completed(futures):
            stage, outcomes = futures[future], future.result()
            came[stage] |= {outcome.name: outcome for outcome in outcomes}
            for outcome in outcomes:
                if outcome.safe:
                    findings.keep(f"{stage}: {outcome.name}", digests[stage], asdict(outcome))
            done(stage, len(outcomes))
    return {stage: [came[stage][fault.name] for fault in some] for stage, some in faults.items()}
