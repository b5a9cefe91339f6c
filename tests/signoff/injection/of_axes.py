"""Faults of several axes on one board: of one of them, while the others go on, and of all at once."""

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axes import supervised as supervised_axes
from hardwall.model.axis.supervisor import DISARMED
from oracles.supervised import BITS, SYNCHRONISER

from .fault import Expected, Fault, trips
from .of_encoder import FAST, HARDER_N, INDEX, NONE, PAIRS, marks, mended, rushes, slips, stuck, wired
from .of_host import QUICK, SILENT, TAKEN, heard, killed, recovered
from .of_motion import (
    FASTEST_M_PER_S,
    LAST_QUARTER,
    MARGIN,
    RESTING,
    at_rest,
    estimate_saturates,
    limits,
    passes,
    reversed_motor,
    shoved,
    turned_back,
    unswapped,
)
from .of_pins import AT_ONCE, closed, opened, right, upset
from .of_stages import BACK, FOUND, STOPPED_MS, stops
from .rig import Rig
from .scene import CLOCKS_PER_MS, COUNTED, LOOP, SPEC, WORDS, words
from .staged import SEVERAL

AXES = supervised_axes.Design(SEVERAL.spec)
ROTA = SEVERAL.spec.clocks_per_sample
LOOKED = AXES.trip_clocks
"""Clock edges from what waits for a turn to the drive at zero."""
SAMPLED = COUNTED + ROTA + AXES.latency
"""Clock edges from a pin of the encoder to the drive at zero: count, sample, and the clocks to its drive."""
LOST = SYNCHRONISER + WORDS["supervisor_loss"].reset + 2 * ROTA + AXES.turn_clocks
FLIPPED = 1 << 14
"""A bit that makes 40 N, the largest force, 56 N."""


async def written_wrong(rig: Rig) -> None:
    """Let a bit flip on the way of a word to the memory, which the link found to be right."""
    rig.pins(upset_word_value=FLIPPED)
    await heard(writes_the_limit)(rig)
    rig.pins(upset_word_value=0)


async def writes_the_limit(rig: Rig) -> None:
    await rig.host.write(supervisor_force_limit=rig.host.words["supervisor_force_limit"])


OF_ONE = (
    Fault(
        "both channels change at once: the scale slips by two counts",
        slips,
        trips("encoder_illegal", within=COUNTED + LOOKED),
    ),
    Fault(
        "the encoder turns at 8 m/s, twice what its filter passes",
        rushes,
        trips("encoder_overspeed", within=FAST + LOOKED),
    ),
    Fault(
        "homed: the scale slips by two counts",
        slips,
        trips("encoder_illegal", within=COUNTED + LOOKED),
        homed=True,
    ),
    Fault(
        "homed, complements wired: all four wires low for a while",
        wired(stuck(**NONE)),
        trips("encoder_loss", within=LOST),
        mended,
        **PAIRS,
        homed=True,
    ),
    Fault(
        "brown-out, complements wired: all four wires low",
        wired(stuck(**NONE)),
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
    Fault(
        "Z is stuck high from 110 counts off the index on",
        marks(for_good=True),
        trips("index_spacing", within=SAMPLED),
        mended,
        **INDEX,
    ),
    Fault(
        "the hand pushes the handle beyond supervisor_position_high",
        passes(RESTING + MARGIN),
        trips("position_range", within=SAMPLED, largest_n=HARDER_N),
        turned_back,
        live={"supervisor_position_high": RESTING + MARGIN},
    ),
    Fault(
        "the hand pushes the handle into the last quarter of the count",
        passes(RESTING + MARGIN),
        trips("position_wrap", within=SAMPLED, largest_n=HARDER_N),
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
        "the motor's wires are swapped, with a limit of 15 N and 1 mm",
        reversed_motor(20),
        trips("runaway", within=20 * CLOCKS_PER_MS, largest_n=15.0),
        unswapped,
        live=limits(15.0, 1e-3),
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
    Fault(
        "a bit of supervisor_force_limit flips on its way to the memory, to 56 N",
        written_wrong,
        trips("word_range", within=TAKEN + LOOKED),
        writes_the_limit,
    ),
    Fault(
        "the loop of external_fault opens, which the other axes take no part in",
        opened("external_fault"),
        trips("external_fault", within=LOOP),
        closed("external_fault"),
    ),
)
"""Faults of one axis."""
OF_ALL = (
    Fault(
        "the loop of external_fault opens",
        opened("external_fault"),
        trips("external_fault", within=LOOP),
        closed("external_fault"),
        common=True,
    ),
    Fault(
        "the loop of emergency_stop opens",
        opened("emergency_stop"),
        trips("emergency_stop", within=LOOP, pins_within=AT_ONCE),
        closed("emergency_stop"),
        common=True,
    ),
    Fault(
        "the loop of drive_enable opens",
        opened("drive_enable"),
        Expected(state=DISARMED, within=LOOP, pins_within=AT_ONCE),
        closed("drive_enable"),
        common=True,
    ),
    Fault(
        "the plug of all three loops is pulled",
        opened(*LOOPS),
        trips("external_fault", "emergency_stop", within=LOOP, pins_within=AT_ONCE),
        closed(*LOOPS),
        common=True,
    ),
    Fault(
        "supervisor_watchdog becomes 0",
        upset("supervisor_watchdog", WORDS["supervisor_watchdog"].reset),
        trips("word_range", within=LOOKED),
        right("supervisor_watchdog"),
        common=True,
    ),
    Fault(
        "the host is killed (supervisor_watchdog 50 ms)",
        killed,
        trips("link_timeout", within=SILENT + LOOKED),
        recovered,
        live=QUICK,
        common=True,
    ),
    Fault(
        f"the clock stops {SEVERAL.acting}",
        stops(SEVERAL.acting),
        Expected(stopped=True, within=FOUND, largest_n=SEVERAL.stuck_n()),
        observed_ms=0.5,
        common=True,
    ),
    Fault(
        f"the clock stops {SEVERAL.acting}, and comes back after {STOPPED_MS} ms",
        stops(SEVERAL.acting, comes_back=True),
        Expected(state=DISARMED, within=BACK, largest_n=SEVERAL.stuck_n()),
        common=True,
    ),
)
"""Faults of all axes: what begins is that of the first one."""
FAULTS = (*OF_ONE, *OF_ALL)
