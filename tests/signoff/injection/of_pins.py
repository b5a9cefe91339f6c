"""Faults of the loops, of the reset pin, of the clock, and of words and signals inside."""

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axis.supervisor import DISARMED

from .fault import UNCHANGED, Expected, Fault, trips
from .rig import Rig
from .scene import CLOCKS_PER_MS, LOOP

AT_ONCE = 0
"""Clock edges that can still see a force at the pins where a gate without a clock ends it."""
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


async def stops_the_oscillator(rig: Rig) -> None:
    rig.stop_oscillator()


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
    Fault("the oscillator stops", stops_the_oscillator, UNCHANGED),
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
