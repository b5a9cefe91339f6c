"""Faults of the encoder and of its wires."""

import math
from collections.abc import Callable

from hardwall.model.axis.monitors import latency
from hardwall.model.encoder.quadrature_speed import clocks_to_fault
from oracles.supervised import BITS

from .fault import UNCHANGED, Expected, Fault, trips
from .handle import Wires, sound, wires
from .rig import Rig
from .scene import CLOCKS_PER_MS, COUNTED, GLITCH, PUSH_N, REST, STEP_CLOCKS, TURN, WORDS

HARDER_N = 20.0
BURST = 80
"""Counts in a step: 8 m/s, twice what the filter passes."""
ILLEGAL = COUNTED + 1
FAST = math.ceil(clocks_to_fault(BURST / STEP_CLOCKS, GLITCH)) + 1
LOST = 2 + WORDS["supervisor_loss"].reset + latency("encoder_loss") + 1
"""Clock edges from wires that are equal to the drive at zero: synchroniser, `supervisor_loss`, monitor, supervisor."""
INDEXED = COUNTED + latency("index_spacing") + 1
"""Clock edges from the edge that finds an index to the drive at zero: count, monitor, supervisor."""
NUDGED_N = PUSH_N + 0.3
"""A push by which the handle goes on by some 60 counts; the force stays the same within that of a tremor."""
ONWARD = 10
"""Counts from where the hand pushes on to the false index."""
PAIRS = {"causes": BITS["encoder_loss"]}
INDEX = {"causes": BITS["index_spacing"], "live": {"supervisor_turn": TURN}}


def wired(fault: Callable[[Wires], Wires], push_n: float = PUSH_N, clocks: int | None = None):
    """Return the fault that wires are wrong, for good or for some clocks, while the hand pushes."""

    async def inject(rig: Rig) -> None:
        rig.handle.fault, rig.handle.push_n = fault, push_n
        rig.wire()
        if clocks is not None:
            await rig.run(clocks / CLOCKS_PER_MS)
            rig.handle.fault = sound
            rig.wire()

    return inject


async def mended(rig: Rig) -> None:
    """Mend the wires; the hand holds the handle."""
    rig.handle.fault, rig.handle.held = sound, rig.handle.number
    rig.wire()
    await rig.run(0.1)


def stuck(**levels: int) -> Callable[[Wires], Wires]:
    """Return the fault of wires that have a level for good."""
    return lambda sees: sees | {f"encoder_{name}": level for name, level in levels.items()}


def dies(*names: str, push_n: float = PUSH_N, lives: str | None = None):
    """Return the fault that wires keep the levels that they have; it begins with the next edge of one that lives."""

    async def inject(rig: Rig) -> None:
        now = rig.handle.levels(rig.handle.number)

        def begins(number: int) -> None:
            if wires(number)[lives] != now[lives]:
                rig.begin()
                rig.on_count = lambda number: None

        if lives:
            rig.on_count = begins
        await wired(stuck(**{name: now[f"encoder_{name}"] for name in names}), push_n)(rig)

    return inject


def marks(for_good: bool):
    """Return the fault that Z rises with an edge, for good or for a count, as the hand pushes the handle on a little.

    It begins with the edge after, which finds the index.
    """

    async def inject(rig: Rig) -> None:
        rises = rig.handle.number + ONWARD

        def meets(number: int) -> None:
            if number == rises - 1:
                rig.handle.fault = stuck(z=1)
            elif number > rises:
                rig.begin()
                rig.on_count = lambda number: None
                if not for_good:
                    rig.handle.fault = sound
                    rig.wire()

        rig.on_count, rig.handle.push_n = meets, NUDGED_N
        await rig.until(lambda: rig.handle.number > rises, 9, "the handle has met the false index")

    return inject


def warned(inject, warns: bool):
    """Return a fault, at the end of which the warning must have come, or cannot have come."""

    async def watched(rig: Rig) -> None:
        await inject(rig)
        await rig.run(9)
        rig.claim(rig.see("a_channel_idle") == warns, f"the warning a_channel_idle is {1 - warns}")

    return watched


async def slips(rig: Rig) -> None:
    rig.handle.slipped += 2
    rig.wire()


async def rushes(rig: Rig) -> None:
    """Move the handle faster than the filter passes."""
    # The burst begins with the next step.
    rig.handle.held, rig.handle.pace = REST + 10 * BURST, BURST
    rig.on_count = first_edge(rig)
    await rig.run(1)


def first_edge(rig: Rig) -> Callable[[int], None]:
    """Return what takes the first edge as the begin of the fault."""

    def begins(number: int) -> None:
        rig.begin()
        rig.on_count = lambda number: None

    return begins


BLIND = Expected(steady=True)
"""No cause, and the force stays: no more than a warning is promised."""
NONE = {"a": 0, "b": 0, "a_n": 0, "b_n": 0}
FAULTS = (
    Fault(
        "both channels change at once: the scale slips by two counts", slips, trips("encoder_illegal", within=ILLEGAL)
    ),
    Fault("the encoder turns at 8 m/s, twice what its filter passes", rushes, trips("encoder_overspeed", within=FAST)),
    Fault("homed: the scale slips by two counts", slips, trips("encoder_illegal", within=ILLEGAL), homed=True),
    Fault("homed: the encoder turns at 8 m/s", rushes, trips("encoder_overspeed", within=FAST), homed=True),
    Fault(
        "homed, complements wired: all four wires low for a while",
        wired(stuck(**NONE)),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
        homed=True,
    ),
    Fault("a glitch on A, as long as the filter", wired(stuck(a=0), clocks=GLITCH), UNCHANGED),
    Fault(
        "brown-out, complements wired: all four wires low",
        wired(stuck(**NONE)),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
    ),
    Fault(
        "complements wired: both channels low",
        wired(stuck(a=0, b=0)),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
    ),
    Fault(
        "complements wired: both channels high",
        wired(stuck(a=1, b=1)),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
    ),
    Fault(
        "complements wired: the wire of B is cut, and reads as its complement",
        wired(lambda sees: sees | {"encoder_b": sees["encoder_b_n"]}),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
    ),
    *(
        Fault(
            f"complements wired: channel {name.upper()} is dead and its complement lives, as the hand pushes on",
            dies(name, push_n=HARDER_N, lives=f"encoder_{name}_n"),
            trips("encoder_loss", within=LOST),
            mended,
            **PAIRS,
        )
        for name in ("a", "b")
    ),
    Fault(
        "complements wired: channel A and its complement are dead, as the hand pushes on",
        warned(dies("a", "a_n", push_n=HARDER_N), True),
        BLIND,
        **PAIRS,
    ),
    *(
        Fault(
            f"single-ended: channel {name.upper()} is dead, as the hand pushes on",
            warned(dies(name, push_n=HARDER_N), True),
            BLIND,
        )
        for name in ("a", "b")
    ),
    Fault(
        "single-ended: brown-out, both channels low, as the hand pushes on",
        warned(wired(stuck(**NONE), push_n=HARDER_N), False),
        BLIND,
    ),
    Fault("Z is dead", wired(stuck(z=0)), UNCHANGED, **INDEX),
    Fault("noise on Z between two edges", wired(stuck(z=1), clocks=20), UNCHANGED, **INDEX),
    Fault(
        "a false pulse on Z, a count wide, 110 counts from the index",
        marks(for_good=False),
        trips("index_spacing", within=INDEXED),
        **INDEX,
    ),
    Fault(
        "Z is stuck high from 110 counts off the index on",
        marks(for_good=True),
        trips("index_spacing", within=INDEXED),
        mended,
        **INDEX,
    ),
    Fault("index_spacing is off: a false pulse on Z, a count wide", marks(for_good=False), UNCHANGED),
)
