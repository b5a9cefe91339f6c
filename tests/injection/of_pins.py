"""Faults of the loops, of the reset pin, of the clock, and of words and signals inside."""

import math

from hardwall.hdl.supervised import LOOPS
from hardwall.model import clock_monitor
from hardwall.model.supervisor import DISARMED

from .fault import UNCHANGED, Expected, Fault, trips
from .rig import PUMP_CLOCKS, Rig
from .scene import CLOCK_HZ, CLOCK_NS, CLOCKS_PER_MS, FULL_SCALE_N, LOOP, OSCILLATOR_HZ, SPEC

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
        if comes_back:
            # Of what moves while the clock stands, the axis would see the last levels alone.
            rig.handle.held = rig.handle.number
        rig.begin()
        rig.stop_clock()
        if loops:
            await rig.run(OPENED_MS)
            rig.pins(**dict.fromkeys(loops, 0))
        await rig.run(STOPPED_MS)
        if not alone:
            claim_outputs_low(rig)
        if comes_back:
            await goes_on(rig)

    return inject


def claim_outputs_low(rig: Rig) -> None:
    """Claim that nothing enables an amplifier whose clock stands."""
    for name in ("outputs_enable", "alive"):
        rig.claim(rig.see(name) == 0, f"{name} is high while the clock stands")


async def goes_on(rig: Rig) -> None:
    """Let the clock go on; no pulse may come of the drive that it left."""
    pulses = rig.see("pulses")
    await rig.start_clocks()
    await rig.run(RETURNED_CLOCKS / CLOCKS_PER_MS)
    rig.claim(rig.see("pulses") == pulses, "a pulse comes back with the clock")


async def goes_on_where_a_pulse_is_next(rig: Rig) -> None:
    """Stop the clock where the oscillator has the least time to keep the pin low once the clock goes on.

    The drive is at its limit, of more than half of the clocks, so that the pulse behind one that follows a gap comes
    three clocks later at the latest. The first edge of the clock changes the beat at once, and an edge of the
    oscillator sees that within half a clock.
    """
    rig.handle.held, rig.handle.pace = rig.handle.number + AT_LIMIT_COUNTS, AT_LIMIT_PACE
    most = SPEC.force_max_n - SPEC.force_resolution_n
    await rig.until(lambda: rig.driven_n < -most, 20, "the drive is at its limit")
    gap = False

    def reached() -> bool:
        nonlocal gap
        after_gap, gap = gap, not rig.see("drive_pdm")
        return after_gap and not gap and rig.see("now") % BEAT_CLOCKS == BEAT_CLOCKS - 1

    await rig.until(reached, 1, "the beat changes next, and the pin has risen", clocks=1)
    rig.begin()
    rig.stop_clock()
    await rig.run(STOPPED_MS)
    claim_outputs_low(rig)
    await rig.until(lambda: rig.see("oscillator") == 1, 1, "the oscillator has risen", clocks=1)
    await goes_on(rig)


async def stops_the_oscillator(rig: Rig) -> None:
    rig.stop_oscillator()


STOPPED_MS, OPENED_MS = 1, 0.001
RETURNED_CLOCKS = 100
"""For so long no pulse may come of a clock that goes on."""
BEAT_CLOCKS = clock_monitor.Design(CLOCK_HZ).beat_clocks
FASTEST_NS = round(CLOCK_HZ * CLOCK_NS / clock_monitor.OSCILLATOR_HZ[1])
AT_LIMIT_COUNTS, AT_LIMIT_PACE = 8000, 10
"""Counts into the wall at which its spring asks for more than the limit, and counts in a step on the way there."""
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
    Fault(
        "the clock stops with the drive at its limit, and comes back to an oscillator of 10 MHz",
        goes_on_where_a_pulse_is_next,
        Expected(state=DISARMED, within=BACK, largest_n=FULL_SCALE_N),
        oscillator_ns=FASTEST_NS,
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
