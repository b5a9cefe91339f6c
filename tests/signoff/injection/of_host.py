"""Faults of the host, and what it must be able to do while the axis is ARMED."""

import math

from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.model.axis.register_file import Design
from hardwall.model.axis.supervisor import DISARMED, TRIPPED, WATCHDOG_MS
from hardwall.model.link.server import FAILURE, VALUE
from stimuli import frames

from .fault import UNCHANGED, Expected, Fault, trips
from .of_pins import opened
from .rig import Rig
from .scene import CLOCKS_PER_MS, DEPTH, LOOP, REGISTERS, REST, SPEC, START, words
from .serial_host import REFUSED

SILENT = WATCHDOG_MS[0] * CLOCKS_PER_MS + 3
QUICK = {"supervisor_watchdog": WATCHDOG_MS[0]}
TAKEN = 200
"""The most clock edges from the last bit of a frame to what it does."""
LOWERED_N = 5.0


def heard(inject):
    """Return a fault that begins with the last bit of the host's next frame."""

    async def after(rig: Rig) -> None:
        def begins() -> None:
            rig.begin()
            rig.host.sent = lambda: None

        rig.host.sent = begins
        await inject(rig)

    return after


async def beats(rig: Rig) -> None:
    """Beat once."""
    await rig.host.heartbeat()


async def killed(rig: Rig) -> None:
    """Beat for the last time."""
    rig.host.beats = False
    await heard(beats)(rig)
    await rig.run(WATCHDOG_MS[0])


async def repeats(rig: Rig) -> None:
    """Beat for the last time, and go on to say the same."""
    await heard(beats)(rig)
    rig.host.repeats = True
    await rig.run(WATCHDOG_MS[0])


async def recovered(rig: Rig) -> None:
    """Let the host come back."""
    rig.host.repeats, rig.host.beats = False, True


async def line_breaks(rig: Rig) -> None:
    """Pull the line low for good, after the last beat."""
    await heard(beats)(rig)
    rig.host.beats = False
    rig.pins(uart_rx=0)
    await rig.run(WATCHDOG_MS[0])


async def line_mended(rig: Rig) -> None:
    """Let the line rest for as long as a spoilt frame needs to end."""
    rig.pins(uart_rx=1)
    await rig.run(21)


def writes(refusal: int | None = None, **values: int):
    """Return the act that the host writes registers; it is taken, or answered by an exception."""

    async def inject(rig: Rig) -> None:
        answer = await rig.host.write(**values)
        found = answer[1] if answer[0] & REFUSED else None
        rig.claim(found == refusal, f"the answer is exception {found}, not {refusal}")

    return heard(inject)


async def tripped(rig: Rig) -> int:
    """Trip the axis by a short opening of the emergency stop; return what is latched."""
    await opened("emergency_stop", clocks=2)(rig)
    await rig.run(0.1)
    return rig.see("latched")


async def acknowledges_others(rig: Rig) -> None:
    latched = await tripped(rig)
    for causes in (0, latched ^ 2, 1, latched << 1 & (1 << 14) - 1):
        await rig.host.acknowledge(causes)
        rig.claim(rig.sees(TRIPPED), f"{causes:#x} acknowledges {latched:#x}")


async def does_not_acknowledge(rig: Rig) -> None:
    await tripped(rig)
    for _ in range(5):
        rig.claim(not await rig.host.arm(), "an arm is taken")


async def looks_too_early(rig: Rig) -> None:
    """Acknowledge what was latched before another cause came."""
    latched = await tripped(rig)
    await opened("external_fault", clocks=2)(rig)
    await rig.host.acknowledge(latched)
    rig.claim(rig.sees(TRIPPED), "a cause is lost that came after the host's look")


async def raises_beyond(rig: Rig) -> None:
    """Write a force limit that the axis does not have."""
    register = REGISTERS["supervisor_force_limit"]
    beyond = round(60.0 / SPEC.force_resolution_n)
    answer = await rig.host.request(frames.write(register.address, [0, beyond]))
    rig.claim(answer == bytes([16 | REFUSED, VALUE]), f"the answer is {answer.hex(' ')}")


async def moves_the_wall(rig: Rig) -> None:
    """Move the wall to and fro every millisecond, by 50 counts of its 2340."""
    for turn in range(20):
        place = REST - START - DEPTH + round(50 * math.sin(turn))
        await rig.host.commit(wall_position=place)
        await rig.run(1 - 0.15)


async def arms_and_moves(rig: Rig) -> None:
    """Disarm, and ask for an arm and a move of the count in one frame."""
    await writes(disarm=1)(rig)
    for moves in ("preload", "origin_shift"):
        answer = await rig.host.write(**{"arm": 1, moves: 1})
        found = answer[1] if answer[0] & REFUSED else None
        rig.claim(found == FAILURE, f"the answer to arm and {moves} is exception {found}")


FAULTS = (
    Fault(
        "the host is killed (supervisor_watchdog 50 ms)",
        killed,
        trips("link_timeout", within=SILENT),
        recovered,
        live=QUICK,
    ),
    Fault(
        "the host repeats one heartbeat (supervisor_watchdog 50 ms)",
        repeats,
        trips("link_timeout", within=SILENT),
        recovered,
        live=QUICK,
    ),
    Fault(
        "the serial line is low for good (supervisor_watchdog 50 ms)",
        line_breaks,
        trips("link_timeout", within=SILENT),
        line_mended,
        live=QUICK,
    ),
    Fault("the host acknowledges other causes", acknowledges_others, trips("emergency_stop", within=LOOP)),
    Fault("the host arms without an acknowledgement", does_not_acknowledge, trips("emergency_stop", within=LOOP)),
    Fault(
        "another cause comes between the host's look and its acknowledgement",
        looks_too_early,
        trips("emergency_stop", within=LOOP),
    ),
    Fault("the host disarms", writes(disarm=1), Expected(state=DISARMED, within=TAKEN)),
    Fault(
        "the host lowers supervisor_force_limit to 5 N",
        writes(**words(supervisor_force_limit=LOWERED_N)),
        Expected(within=TAKEN, down_n=LOWERED_N),
    ),
    Fault(
        "the host lowers supervisor_force_limit to 0",
        writes(supervisor_force_limit=0),
        Expected(within=TAKEN),
    ),
    Fault("the host writes a force limit of 60 N, beyond its range", raises_beyond, UNCHANGED),
    Fault("the host moves the wall by commits at 1 kHz", moves_the_wall, Expected(largest_n=14.0)),
    Fault(
        "the host commits the stiffest wall, 200 kN/m",
        writes(commit=1, wall_stiffness=REGISTERS["wall_stiffness"].high),
        Expected(largest_n=SPEC.force_max_n),
    ),
    Fault("the host asks for a preload", writes(FAILURE, preload=1), UNCHANGED),
    Fault("the host asks for a shift of the origin", writes(FAILURE, origin_shift=1), UNCHANGED),
    Fault(
        "the host disarms, and arms beside a preload, and beside a shift of the origin",
        arms_and_moves,
        Expected(state=DISARMED, within=TAKEN),
    ),
    Fault(
        "homed: the host commits encoder_invert",
        writes(commit=1, encoder_invert=1),
        Expected(state=DISARMED, within=TAKEN + RegisterFile(Design(REGISTERS)).shift_clocks),
        writes(commit=1, encoder_invert=0),
        homed=True,
    ),
    Fault("the host reverses drive_invert", writes(drive_invert=1), UNCHANGED),
    Fault(
        "the host commits encoder_invert",
        writes(commit=1, encoder_invert=1),
        Expected(state=DISARMED, within=TAKEN + RegisterFile(Design(REGISTERS)).shift_clocks),
        writes(commit=1, encoder_invert=0),
    ),
    Fault("the host arms an ARMED axis", writes(FAILURE, arm=1), UNCHANGED),
)
