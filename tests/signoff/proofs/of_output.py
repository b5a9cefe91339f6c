"""What the output stage promises: limits, zero, and the exact result between them."""

from amaranth.hdl import Cat, Mux

from hardwall.hdl.axis.output import Output
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property

FORCE_LIMIT_IS_LAST = "Mux(too_low, lowest, fall)"


def output(name: str) -> Output:
    return Output(spec(name).design.output)


def never_beyond_the_axis(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    most = stage.design.force_limit
    bench.promise((stage.drive <= most) & (stage.drive >= -most))


def zero_without_enable(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    bench.promise(bench.past(stage.enable) | (stage.drive == 0))


def zero_until_enabled_at_a_strobe(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    rose = (stage.drive != 0) & (bench.past(stage.drive) == 0)
    bench.promise(~rose | bench.past(stage.strobe & stage.enable))


def within_the_limit_at_run_time(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    word = bench.past(stage.output_force_limit, clocks=stage.design.ahead + stage.latency)
    bench.promise(~stage.actuated | (stage.drive <= word) & (stage.drive >= -word))


def zero_after_a_fault(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    bench.promise(~stage.valid | ~bench.past(stage.fault) | (stage.drive == 0))


def grows_from_the_drive(bench: Bench) -> None:
    stage = bench.block(output("mhz"))
    bench.assume(~stage.strobe | ~Cat(bench.past(stage.strobe, n) for n in range(1, stage.design.interval)).any())
    word = bench.past(stage.output_slew_limit, clocks=stage.design.ahead + stage.latency)
    before = bench.past(stage.drive)
    most, least = Mux(before > 0, before, 0) + word, Mux(before < 0, before, 0) - word
    bench.promise(~stage.actuated | (stage.drive <= most) & (stage.drive >= least))


PROPERTIES = [
    Property(
        "the drive grows by at most the slew limit, from what an enable that was low has left of it",
        "output mhz",
        grows_from_the_drive,
        depth=5,
        bugs=(
            Bug(Output.elaborate, "self.enable & (self.drive[-1] == sign)", "self.drive[-1] == sign"),
            Bug(Output.elaborate, "negative - step", "self.drive - step"),
        ),
        quick=True,
    ),
    Property(
        "the drive never exceeds the axis's limit",
        "output mhz",
        never_beyond_the_axis,
        depth=4,
        bugs=(
            Bug(Output.elaborate, FORCE_LIMIT_IS_LAST, "fall"),
            Bug(
                Output.elaborate,
                "Mux(self.output_force_limit > most, most, self.output_force_limit)",
                "self.output_force_limit",
            ),
            Bug(Output.elaborate, "positive > room", "positive > room + 1"),
        ),
    ),
    Property(
        "the drive is zero one clock after enable is low",
        "output mhz",
        zero_without_enable,
        depth=4,
        bugs=(Bug(Output.elaborate, "~self.enable | self.strobe & self.fault", "self.strobe & self.fault"),),
    ),
    Property(
        "the drive stays zero until a strobe with enable",
        "output mhz",
        zero_until_enabled_at_a_strobe,
        depth=4,
        bugs=(Bug(Output.elaborate, "self.strobe & turn & self.enable", "turn & self.enable"),),
        quick=True,
    ),
    Property(
        "at an actuation the drive is within the limit at run time, as it was ahead of the strobe",
        "output mhz",
        within_the_limit_at_run_time,
        depth=5,
        bugs=(Bug(Output.elaborate, FORCE_LIMIT_IS_LAST, "fall"),),
    ),
    Property(
        "a fault with the strobe makes the drive zero at valid",
        "output mhz",
        zero_after_a_fault,
        depth=4,
        bugs=(Bug(Output.elaborate, "~self.enable | self.strobe & self.fault", "~self.enable"),),
    ),
]
