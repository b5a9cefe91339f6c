"""Faults of motion: a handle that goes where or as it must not, and reversed polarity."""

from collections.abc import Callable

from hardwall.model.axis.monitors import latency
from hardwall.model.axis.supervisor import RAMP_S
from hardwall.model.encoder.quadrature import latency as decoded
from hardwall.sim.world.encoder import level
from oracles.supervised import BITS

from .fault import Expected, Fault, trips
from .handle import Wires, wires
from .of_encoder import HARDER_N, first_edge, wired
from .rig import Rig
from .scene import CLOCKS_PER_MS, COUNTED, PUSH_N, REST, SPEC, START, WORDS, words

RESTING = REST - START
"""The count of the steady contact."""
MARGIN = 100
LAST_QUARTER = 3 << SPEC.count_width - 3
OTHERS = {
    "encoder_a": "encoder_b",
    "encoder_b": "encoder_a",
    "encoder_a_n": "encoder_b_n",
    "encoder_b_n": "encoder_a_n",
}
SHOVE_N, FASTEST_M_PER_S = 80.0, 0.1
EASED_N = 5.0
FASTEST_PACE = 96
"""Counts in a step: 9.6 m/s, beyond the estimator's format."""
FASTEST_COUNTS = 200_000
RAISES, RAISED = 100, 20
"""How often the host raises the force limit, and by what, force LSB."""


def seen(cause: str) -> int:
    """Return the clock edges from a pin of the encoder to the drive at zero: count, monitor, supervisor."""
    return COUNTED + latency(cause) + 1


def passes(count: int, push_n: float = HARDER_N):
    """Return the fault that the hand pushes the handle beyond a count of the scale; it begins there."""

    async def inject(rig: Rig) -> None:
        def begins(number: int) -> None:
            if number - START == count + 1:
                rig.begin()
                rig.on_count = lambda number: None

        rig.on_count = begins
        rig.handle.push_n = push_n
        await rig.until(lambda: rig.handle.number - START > count + 2, 20, "the handle has passed")

    return inject


async def shoved(rig: Rig) -> None:
    """Push until the handle is faster than the limit."""
    rig.handle.push_n = SHOVE_N
    await rig.until(lambda: rig.handle.speed_m_per_s > FASTEST_M_PER_S, 5, "the handle is fast")
    rig.begin()


def reversed_motor(milliseconds: float):
    """Return the fault that the wires of the motor are swapped: the wall pulls the handle in."""

    async def inject(rig: Rig) -> None:
        rig.swapped = True
        await rig.run(milliseconds)

    return inject


async def reversed_while_raised(rig: Rig) -> None:
    """Swap the wires of the motor, while the host raises the limit as fast as it can."""
    rig.swapped = True
    limit = rig.host.words["supervisor_force_limit"]
    for _ in range(RAISES):
        limit += RAISED
        await rig.host.write(supervisor_force_limit=limit)


async def reversed_before_arming(rig: Rig) -> None:
    """Arm with the wires of the motor swapped and the ramp of after reset, and let go of the handle."""
    rig.handle.held, rig.swapped = rig.handle.number, True
    await rig.host.write(disarm=1)
    await rig.host.write(supervisor_ramp=WORDS["supervisor_ramp"].reset)
    rig.claim(await rig.host.arm(), "an arm is refused")
    rig.begin()
    rig.handle.held = None
    await rig.run(60)


async def jitters_beyond(rig: Rig) -> None:
    """Let the count be one beyond its limit for two clocks, the fewest that a filter of one clock passes."""
    rig.handle.held = number = rig.handle.number
    await rig.host.write(supervisor_position_high=rig.see("count"))
    rig.begin()
    await wired(lambda levels: wires(number + 1), clocks=2)(rig)


def turned(number: int) -> Callable[[Wires], Wires]:
    """Return the fault that the encoder counts the other way, which changes no level at this count.

    Its channels are in each other's place; where they differ, they are complemented too.
    """
    differ = level(number) in (1, 2)

    def fault(levels: Wires) -> Wires:
        return {name: levels[OTHERS.get(name, name)] ^ (differ and name in OTHERS) for name in levels}

    return fault


def reversed_encoder(push_n: float, milliseconds: float):
    """Return the fault that the encoder counts the other way, while the hand pushes more or less."""

    async def inject(rig: Rig) -> None:
        rig.handle.fault = turned(rig.handle.number)
        rig.wire()
        rig.begin()
        rig.handle.push_n = push_n
        await rig.run(milliseconds)

    return inject


async def estimate_saturates(rig: Rig) -> None:
    """Move the handle faster than the estimator can say."""
    rig.handle.held, rig.handle.pace = REST + FASTEST_COUNTS, FASTEST_PACE
    rig.on_count = first_edge(rig)
    await rig.run(18)


async def turned_back(rig: Rig) -> None:
    """Let the host widen what a handle elsewhere is beyond."""
    most = (1 << SPEC.count_width - 1) - 1
    await rig.host.write(supervisor_position_high=most)


async def at_rest(rig: Rig) -> None:
    """Hold the handle until the estimate has come to rest."""
    rig.handle.held = rig.handle.number
    await rig.run(20)


async def unswapped(rig: Rig) -> None:
    """Put the wires right."""
    rig.swapped = False


def limits(force_n: float, way_m: float) -> dict[str, int]:
    """Return words that bound a runaway."""
    return words(supervisor_force_limit=force_n, supervisor_runaway=way_m)


FAULTS = (
    Fault(
        "the hand pushes the handle beyond supervisor_position_high",
        passes(RESTING + MARGIN),
        trips("position_range", within=seen("position_range"), largest_n=HARDER_N),
        turned_back,
        live={"supervisor_position_high": RESTING + MARGIN},
    ),
    Fault(
        "a pulse of two clocks on a channel is one count beyond supervisor_position_high, the filter a clock long",
        jitters_beyond,
        trips("position_range", within=decoded(1) + latency("position_range") + 1),
        turned_back,
        committed={"encoder_glitch_clocks": 1},
    ),
    Fault(
        "the hand pushes the handle into the last quarter of the count",
        passes(RESTING + MARGIN),
        trips("position_wrap", within=seen("position_wrap"), largest_n=HARDER_N),
        live={"supervisor_position_high": (1 << SPEC.count_width - 1) - 1},
        committed={"preload_count": LAST_QUARTER - RESTING - MARGIN - 1},
        offset=LAST_QUARTER - RESTING - MARGIN - 1,
        rearms=False,
    ),
    Fault(
        "the hand shoves the handle beyond supervisor_velocity_limit, 0.1 m/s",
        shoved,
        trips("velocity_limit", within=CLOCKS_PER_MS, largest_n=20.0),
        at_rest,
        live=words(supervisor_velocity_limit=FASTEST_M_PER_S),
    ),
    Fault(
        "the motor's wires are swapped, with the words after reset",
        reversed_motor(40),
        trips("runaway", within=40 * CLOCKS_PER_MS, largest_n=SPEC.force_max_n),
        unswapped,
    ),
    Fault(
        "the motor's wires are swapped, with a limit of 15 N and 1 mm",
        reversed_motor(20),
        trips("runaway", within=20 * CLOCKS_PER_MS, largest_n=15.0),
        unswapped,
        live=limits(15.0, 1e-3),
    ),
    Fault(
        "the motor's wires are swapped, with a limit of 15 N and 1 mm, and the host raises the limit again and again",
        reversed_while_raised,
        # The host goes on raising it for longer.
        trips("runaway", within=8 * CLOCKS_PER_MS, largest_n=15.0 + RAISES * RAISED * SPEC.force_resolution_n),
        unswapped,
        live=limits(15.0, 1e-3),
    ),
    Fault(
        "the motor's wires are swapped before the axis is armed, and the ramp is that after reset",
        reversed_before_arming,
        trips("runaway", within=60 * CLOCKS_PER_MS, largest_n=60e-3 * SPEC.force_max_n / RAMP_S),
        unswapped,
    ),
    Fault(
        "the encoder counts the other way, and the hand eases",
        reversed_encoder(EASED_N, 60),
        trips("runaway", within=60 * CLOCKS_PER_MS, largest_n=SPEC.force_max_n),
    ),
    Fault(
        "the encoder counts the other way, the hand eases, with a limit of 15 N and 1 mm",
        reversed_encoder(EASED_N, 40),
        trips("runaway", within=40 * CLOCKS_PER_MS, largest_n=15.0),
        live=limits(15.0, 1e-3),
    ),
    Fault(
        "the encoder counts the other way, and the hand pushes on: the wall is gone",
        reversed_encoder(HARDER_N, 30),
        Expected(within=30 * CLOCKS_PER_MS, largest_n=PUSH_N + 1.0),
    ),
    Fault(
        "the handle is faster than the estimator can say, velocity_limit and runaway off",
        estimate_saturates,
        trips("estimator_saturated", within=20 * CLOCKS_PER_MS, largest_n=SPEC.force_max_n),
        masked=BITS["velocity_limit"] | BITS["runaway"] | BITS["position_range"],
        live={"supervisor_saturated": SPEC.sample_hz // 10_000},
        committed={"encoder_glitch_clocks": 0},
        rearms=False,
    ),
)
