"""The side of the faults that runs in the simulator: one after the other, each from a reset."""

import dataclasses
import json
from pathlib import Path

import cocotb

from hardwall.testing import parameters
from injection.every import FAULTS
from injection.judged import judged
from injection.rig import Rig
from injection.staged import STAGED


@cocotb.test()
async def every_fault(dut):
    order = parameters()
    chosen = {fault.name: fault for fault in FAULTS[order["stage"]]}
    clocks = None
    with Path(order["report"]).open("w", encoding="utf-8") as report:
        for name in order["names"]:
            rig = Rig(dut, STAGED[order["stage"]])
            clocks = await rig.start(clocks, chosen[name].oscillator_ns)
            outcome = await judged(rig, chosen[name])
            await rig.start_clocks()
            rig.close()
            print(json.dumps(dataclasses.asdict(outcome)), file=report, flush=True)
