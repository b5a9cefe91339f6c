"""Faults of the loops, of the reset pin, of the clock, and of words and signals inside."""

import math

from hardwall.hdl.supervised import LOOPS
from hardwall.model import clock_monitor
from hardwall.model.supervisor import DISARMED

from .fault import UNCHANGED, Expected, Fault, trips
from .rig import PUMP_CLOCKS, Rig
from .scene import CLOCK_HZ, CLOCKS_PER_MS, FULL_SCALE_N, LOOP, OSCILLATOR_HZ

AT_ONCE = 0
"""Clock edges that can still see a pulse where a gate without a clock ends it."""
INSIDE = 1
"""Clock edges from a cause that the axis itself shows to the drive at zero."""


def opened(*loops: str, clocks: int | None = None):
    """Return the fault that loops open, for good or for some clocks."""

    async def inject(rig: Rig) -> None:
        rig.pins(**dict.fromkeys(loops, 0))
        if clocks is not None:
            await rig.run(clocks / CLOCKS_PER_MS)
            rig.pins(**dict.fromkeys(loops, 1))

    return inject


def closed(*loops: str):
    """Return the repair that closes loops."""

    async def repair(rig: Rig) -> None:
        rig.pins(**dict.fromkeys(loops, 1))
        await rig.run(0.01)

    return repair


async def resets(rig: Rig) -> None:
    rig.pins(rst=1)
    await rig.run(1)
    rig.pins(rst=0)


def upset(name: str, mask: int, clocks: int | None = None):
    """Return the fault that bits of a port inside are wrong, for good or for some clocks."""

    async def inject(rig: Rig) -> None:
        rig.pins(**{f"upset_{name}": mask})
        if clocks is not None:
            await rig.run(clocks / CLOCKS_PER_MS)
            rig.pins(**{f"upset_{name}": 0})

    return inject


def right(name: str):
    """Return the repair of an upset port."""

    async def repair(rig: Rig) -> None:
        rig.pins(**{f"upset_{name}": 0})

    return repair


def stops(level: int, *loops: str, comes_back: bool = False, alone: bool = False):
    """Return the fault that the clock stops while the pin of the drive is at a level.

    Args:
        level: the pin's.
        loops: those that open `OPENED_MS` later.
        comes_back: the clock goes on after `STOPPED_MS`.
        alone: the oscillator has stopped before.
    """

    async def inject(rig: Rig) -> None:
        rig.host.beats = comes_back
        await rig.run(0.5)
        if alone:
            rig.stop_oscillator()
        await rig.until(lambda: rig.see("drive_pdm") == level, 1, f"the drive's pin is {level}")
        rig.begin()
        rig.stop_clock()
        await rig.run(OPENED_MS if loops else STOPPED_MS)
        rig.pins(**dict.fromkeys(loops, 0))
        if comes_back:
            await rig.start_clocks()

    return inject


async def stops_the_oscillator(rig: Rig) -> None:
    rig.stop_oscillator()


STOPPED_MS, OPENED_MS = 1, 0.001
FOUND = math.ceil(clock_monitor.Design(CLOCK_HZ).stop_latency_s(OSCILLATOR_HZ) * CLOCK_HZ) + 1
"""The most clocks until the oscillator has found a clock that stands."""
OPENED = math.ceil(OPENED_MS * CLOCKS_PER_MS) + 1
"""The most clocks until a loop has ended it."""
BACK = STOPPED_MS * CLOCKS_PER_MS + CLOCKS_PER_MS // 1000 + 2 * LOOP
"""The most clocks from the stop to a drive at zero behind it: the drive moves only with the clock."""

FAULTS = (
    Fault(
        "the loop of external_fault opens",
        opened("external_fault"),
        trips("external_fault", within=LOOP),
        closed("external_fault"),
    ),
    Fault(
        "the loop of emergency_stop opens",
        opened("emergency_stop"),
        trips("emergency_stop", within=LOOP, pins_within=AT_ONCE),
        closed("emergency_stop"),
    ),
    Fault(
        "emergency_stop opens for two clocks",
        opened("emergency_stop", clocks=2),
        trips("emergency_stop", within=LOOP),
    ),
    Fault(
        "the loop of drive_enable opens",
        opened("drive_enable"),
        Expected(state=DISARMED, within=LOOP, pins_within=AT_ONCE),
        closed("drive_enable"),
    ),
    Fault(
        "drive_enable opens for two clocks",
        opened("drive_enable", clocks=2),
        Expected(state=DISARMED, within=LOOP),
    ),
    Fault(
        "the plug of all three loops is pulled",
        opened(*LOOPS),
        trips("external_fault", "emergency_stop", within=LOOP, pins_within=AT_ONCE),
        closed(*LOOPS),
    ),
    Fault(
        "the reset pin is high for 1 ms",
        resets,
        Expected(state=DISARMED, within=LOOP, pins_within=LOOP),
    ),
    Fault(
        "the clock stops while the drive's pin is low",
        stops(0),
        Expected(stopped=True, within=FOUND),
        observed_ms=0.5,
    ),
    Fault(
        "the clock stops while the drive's pin is high",
        stops(1),
        Expected(stopped=True, within=FOUND, largest_n=FULL_SCALE_N),
        observed_ms=0.5,
    ),
    *(
        Fault(
            f"the clock stops while the drive's pin is high, and {loop} opens after 1 us",
            stops(1, loop),
            Expected(stopped=True, within=OPENED, largest_n=FULL_SCALE_N),
            observed_ms=0.5,
        )
        for loop in ("drive_enable", "emergency_stop")
    ),
    Fault(
        f"the clock stops while the drive's pin is high, and comes back after {STOPPED_MS} ms",
        stops(1, comes_back=True),
        Expected(state=DISARMED, within=BACK, largest_n=FULL_SCALE_N),
    ),
    Fault("the oscillator stops", stops_the_oscillator, UNCHANGED),
    Fault(
        "the oscillator stops, and then the clock while the drive's pin is high",
        stops(1, alone=True),
        Expected(stopped=True, within=PUMP_CLOCKS, largest_n=FULL_SCALE_N),
        observed_ms=0.5,
    ),
    Fault(
        "a bit of supervisor_force_limit flips, to 56 N",
        upset("supervisor_force_limit", 1 << 14),
        trips("word_range", within=INSIDE),
        right("supervisor_force_limit"),
    ),
    Fault(
        "supervisor_watchdog becomes 0",
        upset("supervisor_watchdog", 200),
        trips("word_range", within=INSIDE),
        right("supervisor_watchdog"),
    ),
    Fault(
        "a bit of supervisor_watchdog flips, within its range: to 72 ms",
        upset("supervisor_watchdog", 1 << 7),
        UNCHANGED,
    ),
    Fault(
        "a sample begins too early (no specification allows it: forced inside)",
        upset("strobe_busy", 1, clocks=1),
        trips("strobe_busy", within=INSIDE),
    ),
)
