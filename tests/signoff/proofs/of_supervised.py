"""What the supervised axis promises, from its pins to the drive that may leave the FPGA."""

from functools import partial

from amaranth.hdl import Cat, Signal

from hardwall.hdl.axis.supervised import SupervisedAxis
from hardwall.hdl.axis.supervisor import Supervisor
from hardwall.model.axis.supervisor import ALWAYS, ARMED, CAUSES, LINK, REQUIRED, TRIPPED
from hardwall.model.spec import AxisSpec
from stimuli.specs import MHZ

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import FreeProducts

BIT = {cause.name: bit for bit, cause in enumerate(CAUSES)}


SHOWN_ONES = "ports(supervisor, SHOWN)"
WORDS_IN_RANGE = '"word_range": Cat(beyond).any()'
FAULT_LOOP = '"external_fault": ~levels["external_fault"]'
EXCHANGED = '"external_fault": Cat(beyond).any(), "word_range": ~levels["external_fault"]'
"""The last one of a name is what a dict has: the two causes with the source of each other."""
PAST_THE_SUPERVISOR = f"{SHOWN_ONES} | {{'driven': axis.count}}"


def supervised(estimator: str, bench: Bench) -> SupervisedAxis:
    """Return a supervised axis of 1 MHz with the slowest clock that it takes, its products free."""
    roomy = AxisSpec(**MHZ, estimator=estimator)
    clock_hz = roomy.design.interval * roomy.sample_hz
    return bench.block(SupervisedAxis(AxisSpec(**{**MHZ, "clock_hz": clock_hz}, estimator=estimator)), FreeProducts())


def seen(bench: Bench, axis: SupervisedAxis, pin: str) -> Signal:
    """Return a pin as the axis sees it, and promise that this is the pin of two clocks ago."""
    first, level = (bench.inner[f"{pin}_synchroniser.stage{stage}"] for stage in (0, 1))
    bench.promise(first == bench.past(getattr(axis, pin)))
    bench.promise(level == bench.past(first))
    return level


def within_the_limit(estimator: str, bench: Bench) -> None:
    axis = supervised(estimator, bench)
    limit = bench.past(axis.supervisor_force_limit)
    bench.promise((axis.driven <= limit) & (axis.driven >= -limit))


def zero_when_a_loop_opens(estimator: str, bench: Bench) -> None:
    axis = supervised(estimator, bench)
    for pin in ("drive_enable", "emergency_stop", "external_fault"):
        seen(bench, axis, pin)
        opened = ~bench.past(getattr(axis, pin), axis.loop_latency)
        if pin == "external_fault":
            opened &= bench.past(axis.supervisor_causes[BIT[pin]])
        bench.promise(~opened | (axis.driven == 0) & (axis.state != ARMED) & ~axis.alive)


def trips_at_once(estimator: str, bench: Bench) -> None:
    axis = supervised(estimator, bench)
    inner = bench.inner
    words = ((getattr(axis, name), least, most) for name, (least, most) in axis.design.ranges.items())
    sources = {
        "encoder_illegal": inner["axis.decoder.illegal"],
        "encoder_overspeed": inner["axis.decoder.overspeed"],
        "strobe_busy": inner["axis.strobe_busy"],
        "word_range": Cat((word < least) | (word > most) for word, least, most in words).any(),
        "external_fault": ~seen(bench, axis, "external_fault"),
        "emergency_stop": ~seen(bench, axis, "emergency_stop"),
    }
    # What a monitor, too, reports for a single clock is enough.
    armed = axis.state == ARMED
    for bit, cause in enumerate(CAUSES):
        enabled = 1 if REQUIRED >> bit & 1 else axis.supervisor_causes[bit]
        relevant = 1 if ALWAYS >> bit & 1 else armed
        made = ~axis.live if bit == LINK else inner["monitors.causes"][bit]
        told = bench.past(sources.get(cause.name, made) & enabled & relevant & ~bench.reset)
        stood = bench.past(inner["supervisor.standing"][bit] & ~bench.reset)
        bench.promise(~(told | stood) | (axis.driven == 0) & (axis.state == TRIPPED) & axis.latched[bit])


def no_cause_is_lost(estimator: str, bench: Bench) -> None:
    axis = supervised(estimator, bench)
    before = bench.past(axis.latched)
    told = bench.past(axis.acknowledge) & (bench.past(axis.acknowledged) == before)
    bench.promise(((before & ~axis.latched) == 0) | told | bench.past(bench.reset))


def zero_until_an_arm(estimator: str, bench: Bench) -> None:
    axis = supervised(estimator, bench)
    # The host's arm since the axis was last not to drive: since a reset, a disarm, an open loop or a trip.
    asked = Signal()
    stopped = axis.disarm | ~seen(bench, axis, "drive_enable") | (axis.state == TRIPPED)
    with bench.m.If(stopped):
        bench.m.d.sync += asked.eq(0)
    with bench.m.Elif(axis.arm & axis.live):
        bench.m.d.sync += asked.eq(1)
    bench.promise((axis.state != ARMED) | asked)
    bench.promise((axis.driven == 0) | asked)
    bench.promise(~axis.alive | asked)


def of(estimator: str) -> list[Property]:
    """Return the properties of the supervised axis with an estimator."""
    block = f"supervised mhz {estimator}"
    quick = estimator == "fdm"
    return [
        Property(
            "the drive that leaves is within the force limit's word of one clock ago",
            block,
            partial(within_the_limit, estimator),
            depth=2,
            bugs=(Bug(SupervisedAxis.elaborate, SHOWN_ONES, PAST_THE_SUPERVISOR),),
            within=12,
        ),
        Property(
            "drive and alive are zero three clocks after a loop's pin opens",
            block,
            partial(zero_when_a_loop_opens, estimator),
            depth=2,
            bugs=(
                Bug(
                    SupervisedAxis.elaborate, 'supervisor.enable.eq(levels["drive_enable"])', "supervisor.enable.eq(1)"
                ),
                Bug(SupervisedAxis.elaborate, '~levels["emergency_stop"]', "0"),
            ),
            quick=quick,
            within=12,
        ),
        Property(
            "one clock with a cause trips: the drive is zero at the next clock and the cause is latched",
            block,
            partial(trips_at_once, estimator),
            depth=2,
            bugs=(
                Bug(SupervisedAxis.elaborate, '~levels["emergency_stop"]', '~levels["external_fault"]'),
                Bug(SupervisedAxis.elaborate, WORDS_IN_RANGE, '"word_range": 0'),
                Bug(SupervisedAxis.elaborate, FAULT_LOOP, EXCHANGED),
                Bug(Supervisor.elaborate, "present & watched", "present & watched & ~before"),
            ),
            within=12,
        ),
        Property(
            "a latched cause is forgotten only when exactly the latched ones are acknowledged, whatever else happens",
            block,
            partial(no_cause_is_lost, estimator),
            depth=2,
            bugs=(
                Bug(Supervisor.elaborate, "(self.acknowledged == self.latched)", "(self.acknowledged != 0)"),
                Bug(Supervisor.elaborate, "self.latched | standing", "standing"),
            ),
            within=12,
        ),
        Property(
            "the drive is zero from power-up, and from every stop on, until the host's arm",
            block,
            partial(zero_until_an_arm, estimator),
            depth=2,
            bugs=(
                Bug(Supervisor.elaborate, "self.arm & ready", "ready"),
                Bug(SupervisedAxis.elaborate, "self.disarm | turned", "turned"),
            ),
            within=12,
        ),
    ]


PROPERTIES = [*of("fdm"), *of("levant")]
