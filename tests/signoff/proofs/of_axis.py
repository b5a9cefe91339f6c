"""What the whole axis promises, with any estimator's arithmetic: limits, zero, and parameters that change together."""

from dataclasses import replace
from functools import partial

from hardwall.hdl.axis.axis import Axis
from hardwall.hdl.axis.output import Output
from hardwall.model.spec import AxisSpec
from stimuli.specs import MHZ

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import FreeProducts


def axis_of(estimator: str) -> Axis:
    """Return an axis of 1 MHz with the slowest clock that it takes, so that proofs see many samples, which overlap."""
    roomy = AxisSpec(**MHZ, estimator=estimator)
    return Axis(replace(roomy, clock_hz=roomy.design.interval * roomy.sample_hz))


def never_beyond_its_limit(estimator: str, bench: Bench) -> None:
    axis = bench.block(axis_of(estimator), FreeProducts())
    most = axis.spec.force_limit_word
    bench.promise((axis.drive <= most) & (axis.drive >= -most))


def zero_without_enable(estimator: str, bench: Bench) -> None:
    axis = bench.block(axis_of(estimator), FreeProducts())
    bench.promise(bench.past(axis.drive_enable) | (axis.drive == 0))


def parameters_change_at_a_strobe(estimator: str, bench: Bench) -> None:
    axis = bench.block(axis_of(estimator), FreeProducts())
    begun, late = bench.inner["begun"], axis.spec.design.output.words
    first = bench.past(bench.inner["strobe"] & axis.commit_pending & ~bench.reset)
    last = bench.past(begun & axis.estimated & ~bench.reset)
    for word in axis.spec.design.words:
        active, taken = bench.inner[f"active_{word.name}"], last if word in late else first
        bench.promise(taken | bench.past(bench.reset) | (active == bench.past(active, init=word.reset)))
        bench.promise(~taken | (active == bench.past(getattr(axis, word.name))))
    # None is left out: between the first and the last of them the commit is pending, and the last end it.
    bench.promise(~begun | axis.commit_pending)
    bench.promise(~first | begun | last)
    bench.promise(~last | ~begun & (axis.commit_pending == bench.past(axis.commit)))


def zero_before_a_commit(estimator: str, bench: Bench) -> None:
    axis = bench.block(axis_of(estimator))
    inner = bench.inner
    bench.assume(~axis.commit)
    bench.promise(~axis.commit_pending)
    bench.promise(~inner["begun"])
    for word in axis.spec.design.words:
        bench.promise(inner[f"active_{word.name}"] == word.reset)
    half = 1 << (axis.spec.design.wall.push - 1)
    for name, signal in inner.items():
        if name.startswith(("wall.spring_", "wall.damper_")) or name == "wall.force":
            bench.promise(signal == 0)
    bench.promise((inner["wall.total"] == 0) | (inner["wall.total"] == half - 1))
    bench.promise(inner["wall.left"] == 0)
    bench.promise(axis.drive == 0)


PAST_THE_OUTPUT = Bug(Axis._show, "self.drive.eq(output.drive)", "self.drive.eq(decoder.seen.count)")


def of(estimator: str, *deep: Bug) -> list[Property]:
    """Return the properties of the axis with an estimator; `deep` are bugs that show in the second sample."""
    block = f"axis mhz {estimator}"
    return [
        Property(
            "the drive never exceeds the axis's limit",
            block,
            partial(never_beyond_its_limit, estimator),
            depth=4,
            bugs=(PAST_THE_OUTPUT, *deep[:1]),
        ),
        Property(
            "the drive is zero one clock after drive_enable is low",
            block,
            partial(zero_without_enable, estimator),
            depth=4,
            bugs=(PAST_THE_OUTPUT, *deep[1:]),
            quick=estimator == "levant",
        ),
        Property(
            "parameters take effect together, at a strobe after a commit, the output stage's with its velocity",
            block,
            partial(parameters_change_at_a_strobe, estimator),
            depth=4,
            bugs=(
                Bug(Axis._active, "m.If(strobe & pending)", "m.If(pending)"),
                Bug(Axis._active, "m.If(begun & estimated)", "m.If(estimated)"),
                Bug(Axis._active, "pending & ~(begun & estimated)", "pending & ~strobe"),
            ),
        ),
        Property(
            "the drive is zero until a commit",
            block,
            partial(zero_before_a_commit, estimator),
            depth=12,
            bugs=(PAST_THE_OUTPUT, Bug(Axis._active, "init=word.reset", "init=1")),
        ),
    ]


PROPERTIES = [
    *of(
        "fdm",
        Bug(Output.elaborate, "Mux(too_low, lowest, fall)", "fall"),
        Bug(Axis.elaborate, "output.enable.eq(self.drive_enable)", "output.enable.eq(1)"),
    ),
    *of("levant"),
]
