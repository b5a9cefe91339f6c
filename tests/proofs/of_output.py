"""What the output stage promises: limits, zero, and the exact result between them."""

from amaranth.hdl import Mux, Signal

from hardwall.hdl.output import Output
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property

FORCE_LIMIT_IS_LAST = "Mux(over, limit, slewed)"


def output(name: str) -> Output:
    return Output(spec(name).design.output)


def never_beyond_the_axis(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    most = stage.design.force_limit
    bench.promise((stage.drive <= most) & (stage.drive >= -most))


def zero_without_enable(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    bench.promise(bench.past(stage.enable) | (stage.drive == 0))


def zero_until_enabled_from_strobe_to_valid(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    now_and_before = [bench.past(stage.enable, clocks) for clocks in range(1, stage.latency + 1)]
    rose = (stage.drive != 0) & (bench.past(stage.drive) == 0)
    for enabled in now_and_before:
        bench.promise(~rose | enabled)


def within_the_limit_at_run_time(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    word = bench.past(stage.output_force_limit, clocks=2)
    bench.promise(~stage.actuated | (stage.drive <= word) & (stage.drive >= -word))


def zero_after_a_fault(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    idle, faulty = bench.inner["fsm_state"] == 0, Signal()
    with bench.m.If(idle & stage.strobe):
        bench.m.d.sync += faulty.eq(stage.fault)
    bench.promise(idle | ~faulty | ~bench.inner["allowed"])
    bench.promise(~stage.valid | ~faulty | (stage.drive == 0))


def grows_from_the_drive(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    held, negative = bench.inner["held"], bench.inner["held_negative"]
    bench.promise(stage.drive == Mux(negative, -held, held))


PROPERTIES = [
    Property(
        "the magnitude and the sign that the growth is measured from are those of the drive",
        "output mhz",
        grows_from_the_drive,
        depth=4,
        bugs=(
            Bug(Output.elaborate, "held.eq(0), allowed.eq(0)", "allowed.eq(0)"),
            Bug(Output.elaborate, "Signal.like(limit, init=0)", "Signal.like(limit)"),
        ),
        quick=True,
    ),
    Property(
        "the drive never exceeds the axis's limit",
        "output mhz",
        never_beyond_the_axis,
        depth=4,
        bugs=(
            Bug(Output.elaborate, FORCE_LIMIT_IS_LAST, "slewed"),
            Bug(
                Output.elaborate,
                "Mux(self.output_force_limit > most, most, self.output_force_limit)",
                "self.output_force_limit",
            ),
        ),
    ),
    Property(
        "the drive is zero one clock after enable is low",
        "output mhz",
        zero_without_enable,
        depth=4,
        bugs=(Bug(Output.elaborate, "self.drive.eq(0), held.eq(0), allowed.eq(0)", "held.eq(0), allowed.eq(0)"),),
    ),
    Property(
        "the drive stays zero until enable is high from strobe to valid",
        "output mhz",
        zero_until_enabled_from_strobe_to_valid,
        depth=6,
        bugs=(Bug(Output.elaborate, "held.eq(0), allowed.eq(0)]", "held.eq(0)]"),),
        quick=True,
    ),
    Property(
        "at an actuation the drive is within the limit at run time, two clocks before",
        "output mhz",
        within_the_limit_at_run_time,
        depth=4,
        bugs=(Bug(Output.elaborate, FORCE_LIMIT_IS_LAST, "Mux(over & ~negative, limit, slewed)"),),
    ),
    Property(
        "a fault with the strobe makes the drive zero at valid",
        "output mhz",
        zero_after_a_fault,
        depth=5,
        bugs=(Bug(Output.elaborate, "self.enable & ~self.fault", "self.enable"),),
    ),
]
