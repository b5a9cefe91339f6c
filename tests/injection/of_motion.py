"""Faults of motion: a handle that goes where or as it must not, and reversed polarity."""

from collections.abc import Callable

from hardwall.model.monitors import latency
from hardwall.sim.world.encoder import level
from oracles.supervised import BITS

from .fault import Expected, Fault, trips
from .handle import Wires
from .of_encoder import HARDER_N, first_edge
from .rig import Rig
from .scene import CLOCKS_PER_MS, COUNTED, PUSH_N, REST, SPEC, START, words

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
