"""The closed loop with the RTL under cocotb, with which the compiled loop must agree and is compared in speed.

The plant is the same compiled code, called sample by sample. The RTL is clocked by cocotb's own clock in C++. Timers
wait for it, one for every change of a pin and two for every sample: the least Python with which cocotb works. The
module runs inside the simulator; `sim.studies.bench` starts it.
"""

import hashlib
import json
import os
import time
from pathlib import Path

import cocotb
import numpy as np
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, ReadOnly, Timer

from ...model.axis.design import change_of, overlap_of, strobe_of
from ...model.stamped import room_for
from ..loop.controllers import taken_off
from ..loop.pins import shown
from ..loop.values import EDGE_CAPACITY
from ..scene.build import start_of, world_of
from ..scene.case import Case
from ..world.advance import Interval, advance
from ..world.converter import converted
from ..world.encoder import level
from ..world.lines import waiting

PERIOD_NS = 10
"""The period of the simulated clock; only the number of cycles matters."""


@cocotb.test()
async def closed_loop(dut):
    """Close the loop for some samples; write the digest of the force words and the wall time."""
    order = json.loads(os.environ["HARDWALL_LOOP"])
    case = order["case"]
    scene = Case("", case["scene"], case["text"], case["changes"]).scene
    world, edges = world_of(scene), room_for(EDGE_CAPACITY)
    timing, overlap = world.timing, overlap_of(world.timing)
    _, moment, force_n, _ = start_of(scene, world)
    start_level = int(level(moment.cell.number))
    kept = waiting(world.encoder.lines, start_level, edges)
    await _open(dut, scene, start_level)
    # `_open` has run clock 0. Half a period later, pins change between two rising edges: in clock n, before edge n.
    await Timer(PERIOD_NS // 2, "ns")

    now = 1
    late = [0] * scene.delay_samples
    words: list[int] = []
    began = time.perf_counter()
    for k in range(order["samples"]):
        strobe, until = strobe_of(timing, k + overlap), change_of(timing, k)
        interval = Interval(world.after, strobe, until - strobe)
        moment = _advanced(world, kept, edges, moment, force_n, interval)
        taken = 0
        while taken < moment.n_edges and edges.clocks[taken] < until:
            if edges.clocks[taken] > now:
                await Timer(int(edges.clocks[taken] - now) * PERIOD_NS, "ns")
                now = int(edges.clocks[taken])
            dut.encoder_a.value = int(edges.levels[taken]) & 1
            dut.encoder_b.value = int(edges.levels[taken]) >> 1
            taken += 1
        moment = moment._replace(n_edges=taken_off(edges, moment.n_edges, taken))
        if until > now:
            await Timer((until - now) * PERIOD_NS, "ns")
            now = until
        drive = dut.drive.value.to_signed()
        words.append(drive)
        late.append(drive)
        force_n = converted(world.converter, world.push_n + world.force_lsb_n * late.pop(0))
        remaining = strobe_of(timing, k + 1 + overlap) - until
        if remaining:
            interval = Interval(world.before, until, remaining)
            moment = _advanced(world, kept, edges, moment, force_n, interval)
    seconds = time.perf_counter() - began
    actuations = np.array(words[:: scene.spec.samples_per_actuation], "<i4")
    report = {"seconds": seconds, "force_sha256": hashlib.sha256(actuations.tobytes()).hexdigest()}
    Path(order["report"]).write_text(json.dumps(report))


def _advanced(world, kept, edges, moment, force_n, interval):
    """Return the `Moment` after an interval, with the edges that the pins show."""
    encoder, before = world.encoder, moment.n_edges
    moment = advance(world.plant, encoder, moment, force_n, interval, edges)
    return shown(kept, encoder.lines, encoder.clock_hz, before, moment, interval)


async def _open(dut, scene, start_level: int) -> None:
    """Reset the axis with the pins at `start_level`, commit the scene's words, and run clock 0."""
    dut.rst.value = 1
    strobes = "clear_flags", "preload", "origin_shift", "preload_count", "slip", "index_arm", "commit"
    for name in ("encoder_z", *strobes):
        getattr(dut, name).value = 0
    dut.encoder_a.value, dut.encoder_b.value = start_level & 1, start_level >> 1
    dut.drive_enable.value = 1
    for word in scene.spec.design.words:
        getattr(dut, word.name).value = scene.words[word.name] & ((1 << word.format.width) - 1)
    Clock(dut.clk, PERIOD_NS, "ns").start()
    await ClockCycles(dut.clk, 2)
    await ReadOnly()
    await Timer(PERIOD_NS // 2, "ns")
    dut.rst.value = 0
    dut.commit.value = 1
    await ClockCycles(dut.clk, 1)
    dut.commit.value = 0
