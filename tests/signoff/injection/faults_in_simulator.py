"""The side of the faults that runs in the simulator: one after the other, each from a reset."""

import dataclasses
import json
from pathlib import Path

import cocotb

from hardwall.testing import parameters
from signoff.injection.all_faults import FAULTS
from signoff.injection.damaged_axes import DamagedAxes, OfAxis
from signoff.injection.fault import Fault
from signoff.injection.rig import Rig
from signoff.injection.scene import WRONG
from signoff.injection.staged import DEVICES, StagedAxes
from signoff.injection.verdict import judged


def rigs_of(dut, stage: str) -> list[Rig]:
    """Return the loop of every axis."""
    staged = DEVICES[stage]
    if not isinstance(staged, StagedAxes):
        return [Rig(dut, staged)]
    own = DamagedAxes(staged).own
    rigs = [Rig(OfAxis(dut, axis, own), staged, axis) for axis in range(staged.axes)]
    for rig in rigs:
        rig.beside = tuple(each for each in rigs if each is not rig)
    return rigs


def faulty_of(rigs: list[Rig], fault: Fault) -> Rig:
    """Return the axis with the fault; what is common begins with the first, whose host has the line."""
    return rigs[0 if fault.common else WRONG % len(rigs)]


@cocotb.test()
async def every_fault(dut):
    order = parameters()
    chosen = {fault.name: fault for fault in FAULTS[order["stage"]]}
    clocks = None
    with Path(order["report"]).open("w", encoding="utf-8") as report:
        for name in order["names"]:
            fault, rigs = chosen[name], rigs_of(dut, order["stage"])
            clocks = await rigs[0].start(clocks, fault.oscillator_ns)
            rig = faulty_of(rigs, fault)
            outcome = await judged(rig, fault)
            await rig.start_clocks()
            for each in rigs:
                each.close()
            print(json.dumps(dataclasses.asdict(outcome)), file=report, flush=True)
