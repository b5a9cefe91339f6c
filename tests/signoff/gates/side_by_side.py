"""Cocotb's side: the stimulus of a pair from power-up on, and what its counters say at the end.

Every change comes at the fall of the clock. No reset is given at the start; the first comes when everything moves.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cocotb
import numpy as np
from amaranth.lib.wiring import In
from cocotb.clock import Clock
from cocotb.triggers import Timer

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.testing import parameters, rng
from signoff.gates import host
from signoff.gates.pair import START, Pair
from signoff.gates.tops import SMALL, TOPS, WIDTH, Top
from stimuli import handle
from stimuli.axes import random_words
from stimuli.places import place

PERIOD_NS = 10
RESETS = 16
SETTLING = 8
"""Clocks from the end of a reset to the beginning of a sample, at most."""


class Driven:
    """A pair that is clocked, and whose inputs are set.

    Attributes:
        dut: cocotb's handle.
        pair: the pair.
        component: the component in it.
        random: the source of everything random.
        ended: whether everything that drives is to end.
    """

    def __init__(self, dut: Any, top: Top):
        self.dut, self.component, self.random = dut, top.component(), rng()
        self.pair = Pair(self.component)
        self.ended = False
        for name, member in self.pair.signature.members.items():
            if member.flow == In:
                getattr(dut, name).value = 0

    def drive(self, **values: int) -> None:
        """Set inputs; a value is taken modulo the width."""
        for name, value in values.items():
            handle = getattr(self.dut, name)
            handle.value = int(value) & ((1 << len(handle)) - 1)

    async def clocks(self, number: int) -> None:
        """Wait for a number of clocks."""
        await Timer(number * PERIOD_NS, "ns")

    async def pulse(self, name: str, clocks: int = 1) -> None:
        """Raise an input for some clocks."""
        self.drive(**{name: 1})
        await self.clocks(clocks)
        self.drive(**{name: 0})


async def moves(driven: Driven, habits: handle.Habits) -> None:
    """Move the encoder until the end."""
    for pins, clocks in handle.edges(driven.random, habits):
        if driven.ended:
            return
        complements = {f"{name}_n": 1 - pins[name] for name in ("encoder_a", "encoder_b")}
        ports = driven.component.signature.members
        driven.drive(**pins, **{name: level for name, level in complements.items() if name in ports})
        await driven.clocks(clocks)


async def axis(driven: Driven) -> None:
    """Move the encoder, and act on every other input about once in a few samples."""
    random, design = driven.random, driven.component.spec.design
    cocotb.start_soon(moves(driven, handle.Habits(too_fast=0.1, index=0.1)))
    driven.drive(drive_enable=1)
    while not driven.ended:
        await driven.clocks(int(random.integers(1, 20 * driven.component.spec.clocks_per_sample)))
        act = random.random()
        if act < 0.4:
            driven.drive(**random_words(design, random))
            await driven.pulse("commit")
        elif act < 0.6:
            driven.drive(preload_count=place(random, driven.component.spec.count_width))
            await driven.pulse("preload" if act < 0.5 else "origin_shift")
        elif act < 0.7:
            await driven.pulse("clear_flags")
        elif act < 0.8:
            await driven.pulse("index_arm" if act < 0.78 else "slip")
        else:
            driven.drive(drive_enable=int(random.random() < 0.8))


async def board(driven: Driven) -> None:
    """Move the encoder, seldom illegally, open and close the loops, and let a host act on the line."""
    random = driven.random
    # With an encoder that fails as often as that of the axis, the board would seldom be armed.
    cocotb.start_soon(moves(driven, handle.Habits(too_fast=0.001, illegal=2e-5)))
    driven.drive(uart_rx=1, encoder_a_n=1, encoder_b_n=1, **dict.fromkeys(LOOPS, 1))
    # Its edges, too, come at falls of the clock.
    Clock(driven.dut.oscillator, 2 * PERIOD_NS, "ns").start()
    cocotb.start_soon(open_loops(driven))
    talking = host.Host(driven.dut, driven.component, PERIOD_NS, random)
    while not driven.ended:
        await talking.act()


async def open_loops(driven: Driven) -> None:
    """Open a loop now and then, for a moment."""
    while not driven.ended:
        await driven.clocks(int(driven.random.exponential(30_000)))
        loop = str(driven.random.choice(LOOPS))
        driven.drive(**{loop: 0})
        await driven.clocks(int(driven.random.integers(1, 2000)))
        driven.drive(**{loop: 1})


async def cells(driven: Driven) -> None:
    """Give every input any value at every clock; half of the reads are of the word that is written."""
    random = driven.random
    edges = (0, 1, (1 << WIDTH - 1) - 1, 1 << WIDTH - 1, (1 << WIDTH) - 1)
    while not driven.ended:
        a, b = (int(random.choice((random.choice(edges), random.integers(0, 1 << WIDTH)))) for _ in "ab")
        write, read = (int(each) for each in random.integers(0, 1024, 2))
        read = write if random.random() < 0.5 else read
        driven.drive(a=a, b=b, write=int(random.integers(0, 2)), write_address=write, read_address=read)
        await driven.clocks(1)


async def passes(driven: Driven, samples: int) -> int:
    """Let samples pass, with resets in between; return the clocks since power-up."""
    length = getattr(getattr(driven.component, "spec", None), "clocks_per_sample", 1)
    stretches = np.diff([0, *sorted(driven.random.integers(0, samples, RESETS).tolist()), samples])
    clocks = 0
    for number, stretch in enumerate(stretches.tolist()):
        if number:
            reset = int(driven.random.integers(1, 5))
            await driven.pulse("rst", reset)
            # The reset of a pin ends a few clocks later inside, and the first sample begins then.
            await driven.clocks(SETTLING)
            clocks += reset + SETTLING
        await driven.clocks(stretch * length)
        clocks += stretch * length
    return clocks


@cocotb.test()
async def outputs_are_compared(dut):
    given = parameters()
    top = next(top for top in (*TOPS, SMALL) if top.name == given["top"])
    driven = Driven(dut, top)
    await driven.clocks(1)
    driven.drive(start=START)
    Clock(dut.clk, PERIOD_NS, "ns").start(start_high=False)
    stimulus: Callable = globals()[top.stimulus]
    cocotb.start_soon(stimulus(driven))
    clocks = await passes(driven, given["samples"])
    driven.ended = True
    outputs = driven.pair.outputs

    def values(name: str) -> dict[str, int]:
        return outputs.unpack(int(getattr(dut, name).value))

    low, high = values("seen_low"), values("seen_high")
    found = {name: int(getattr(dut, name).value) for name in ("clocks", "different", "first")}
    assert found["clocks"] == clocks, f"{found['clocks']} clocks were compared, not {clocks}"
    found |= {"rtl": values("first_rtl"), "gates": values("first_gates")}
    found["still"] = [port for port in outputs.shapes if not low[port] & high[port]]
    Path(given["report"]).write_text(json.dumps(found), encoding="ascii")
