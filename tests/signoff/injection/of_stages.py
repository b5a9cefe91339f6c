"""Faults that meet a drive stage in the act: loops that open, and clocks that stop."""

import math

from hardwall.model.axis.supervisor import DISARMED
from hardwall.model.board import clock_monitor

from .fault import Expected, Fault, trips
from .of_pins import AT_ONCE, closed, opened, resets
from .rig import Rig
from .scene import CLOCK_HZ, CLOCK_NS, CLOCKS_PER_MS, LOOP, OSCILLATOR_HZ, PUMP_CLOCKS, SPEC
from .staged import Staged

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


def at(moment: str, inject):
    """Return a fault that begins at a moment of the stage."""

    async def then(rig: Rig) -> None:
        await rig.acting(moment)
        rig.begin()
        await inject(rig)

    return then


def stops(moment: str | None, *loops: str, comes_back: bool = False, alone: bool = False):
    """Return the fault that the clock stops.

    Args:
        moment: of the stage; None: while it does not act.
        loops: those that open `OPENED_MS` later.
        comes_back: the clock goes on after `STOPPED_MS`.
        alone: the oscillator has stopped before.
    """

    async def inject(rig: Rig) -> None:
        rig.host.beats = comes_back
        await rig.run(0.5)
        if alone:
            rig.stop_oscillator()
        if moment:
            await rig.acting(moment)
        else:
            await rig.until(lambda: not rig.acts, 1, f"it is {rig.stage.resting}", clocks=1)
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
    """Let the clock go on; no force may come of the drive that it left."""
    last = rig.see("last_asked")
    await rig.start_clocks()
    await rig.run(RETURNED_CLOCKS / CLOCKS_PER_MS)
    rig.claim(rig.see("last_asked") == last, "a force comes back with the clock")


async def goes_on_where_a_pulse_is_next(rig: Rig) -> None:
    """Stop the clock where the oscillator has the least time to keep the pins safe once the clock goes on.

    The drive is at its limit. Pulses of a clock come at more than half of the clocks then, so that the one behind one
    that follows a gap comes three clocks later at the latest; another stage goes on with what it was at. The first edge
    of the clock changes the beat at once, and an edge of the oscillator sees that within half a clock.
    """
    rig.handle.held, rig.handle.pace = rig.handle.number + AT_LIMIT_COUNTS, AT_LIMIT_PACE
    most = SPEC.force_max_n - SPEC.force_resolution_n
    await rig.until(lambda: rig.driven_n < -most, 20, "the drive is at its limit")
    gap = False

    def reached() -> bool:
        nonlocal gap
        after_gap, gap = gap or not rig.stage.brief, not rig.acts
        return after_gap and not gap and rig.see("now") % BEAT_CLOCKS == BEAT_CLOCKS - 1

    await rig.until(reached, 1, "the beat changes next, and the stage acts", clocks=1)
    rig.begin()
    rig.stop_clock()
    await rig.run(STOPPED_MS)
    claim_outputs_low(rig)
    await rig.until(lambda: rig.see("oscillator") == 1, 1, "the oscillator has risen", clocks=1)
    await goes_on(rig)


def faults(stage: Staged) -> tuple[Fault, ...]:
    """Return these faults of a drive stage."""
    return (*(fault for moment in stage.moments for fault in _in_the_act(moment)), *_clocks(stage))


def _in_the_act(moment: str) -> tuple[Fault, ...]:
    """Return the faults of pins that come at a moment of the stage."""
    return (
        Fault(
            f"the loop of external_fault opens {moment}",
            at(moment, opened("external_fault")),
            trips("external_fault", within=LOOP),
            closed("external_fault"),
        ),
        Fault(
            f"the loop of emergency_stop opens {moment}",
            at(moment, opened("emergency_stop")),
            trips("emergency_stop", within=LOOP, pins_within=AT_ONCE),
            closed("emergency_stop"),
        ),
        Fault(
            f"the loop of drive_enable opens {moment}",
            at(moment, opened("drive_enable")),
            Expected(state=DISARMED, within=LOOP, pins_within=AT_ONCE),
            closed("drive_enable"),
        ),
        Fault(
            f"the reset pin is high {moment}",
            at(moment, resets),
            Expected(state=DISARMED, within=LOOP, pins_within=LOOP),
        ),
    )


def _clocks(stage: Staged) -> tuple[Fault, ...]:
    """Return the faults of clocks."""
    held_n = stage.stuck_n()
    return (
        Fault(
            f"the clock stops {stage.resting}",
            stops(None),
            Expected(stopped=True, within=FOUND),
            observed_ms=0.5,
        ),
        Fault(
            f"the clock stops {stage.acting}",
            stops(stage.acting),
            Expected(stopped=True, within=FOUND, largest_n=held_n),
            observed_ms=0.5,
        ),
        *(
            Fault(
                f"the clock stops {stage.acting}, and {loop} opens after 1 us",
                stops(stage.acting, loop),
                Expected(stopped=True, within=OPENED, largest_n=held_n),
                observed_ms=0.5,
            )
            for loop in ("drive_enable", "emergency_stop")
        ),
        Fault(
            f"the clock stops {stage.acting}, and comes back after {STOPPED_MS} ms",
            stops(stage.acting, comes_back=True),
            Expected(state=DISARMED, within=BACK, largest_n=held_n),
        ),
        Fault(
            "the clock stops with the drive at its limit, and comes back to an oscillator of 10 MHz",
            goes_on_where_a_pulse_is_next,
            Expected(state=DISARMED, within=BACK, largest_n=stage.stuck_n(SPEC.force_max_n)),
            oscillator_ns=FASTEST_NS,
        ),
        Fault(
            f"the oscillator stops, and then the clock {stage.acting}",
            stops(stage.acting, alone=True),
            Expected(stopped=True, within=PUMP_CLOCKS, largest_n=held_n),
            observed_ms=0.5,
        ),
    )
