"""What axes in a rota promise, each of them, with any estimator's arithmetic: limits and zero."""

from hardwall.hdl.axes import output
from hardwall.hdl.axes.axis import Axes
from hardwall.model.axes.axis import AxesSpec
from stimuli.specs import NARROW

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import FreeProducts

WHERE = "axes narrow fdm"
NUMBER = 2


def axes(bench: Bench) -> Axes:
    """Return two axes with narrow words and the slowest clock, so that proofs see many samples."""
    rota = {**NARROW, "actuation_hz": NARROW["sample_hz"], "axes": NUMBER, "estimator": "fdm"}
    slots = AxesSpec(**rota).slots
    return bench.block(Axes(AxesSpec(**{**rota, "clock_hz": slots * NARROW["sample_hz"]})), FreeProducts())


def never_beyond_its_limit(bench: Bench) -> None:
    block = axes(bench)
    most = block.spec.force_limit_word
    for drive in block.drive:
        bench.promise((drive <= most) & (drive >= -most))


def zero_without_enable(bench: Bench) -> None:
    block = axes(bench)
    for number, drive in enumerate(block.drive):
        bench.promise(bench.past(block.drive_enable[number]) | (drive == 0))


def changes_with_its_sample_alone(bench: Bench) -> None:
    block = axes(bench)
    for number, drive in enumerate(block.drive):
        same = drive == bench.past(drive)
        bench.promise(same | block.sampled[number] | (drive == 0))
    bench.promise(~block.sampled.all())


PROPERTIES = [
    Property(
        "no drive exceeds its axis's limit",
        WHERE,
        never_beyond_its_limit,
        depth=5,
        bugs=(Bug(output.drive, "Mux(over, limit, slewed)", "slewed"),),
    ),
    Property(
        "the drive of an axis is zero one clock after its drive_enable is low",
        WHERE,
        zero_without_enable,
        depth=4,
        bugs=(Bug(Axes._end, "mine | ~self.drive_enable[number]", "mine"),),
    ),
    Property(
        "the drive of an axis changes with its own sample alone, or to zero",
        WHERE,
        changes_with_its_sample_alone,
        depth=6,
        bugs=(Bug(Axes._end, "with m.If(turn)", "with m.If(pipe.valid(end))"),),
    ),
]
