"""What the capture memory of several axes promises: it hears of samples of the axis that its start has taken alone."""

from amaranth.hdl import Signal

from hardwall.hdl.axes.capture import AxesCapture
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.capture import PULSED, SAMPLED, Design
from stimuli.specs import NARROW

from .bench import Bench
from .bugs import Bug
from .property import Property

WHERE = "capture narrow, 3 axes"


def of_the_axis_taken(bench: Bench) -> None:
    axes = AxesSpec(**NARROW, axes=3, estimator="fdm")
    block, taken = bench.block(AxesCapture(Design(axes, 2))), Signal(2)
    with bench.m.If(block.capture_start):
        bench.m.d.sync += taken.eq(block.capture_axis)
    bench.promise(taken == bench.inner["axis"])
    # A sample of the axis before, which is on its way, comes with the start at the latest, and does not count then.
    begins = bench.past(block.capture_start & ~bench.reset)
    begun = bench.past(begins & ~bench.reset, PULSED - 1)
    bench.promise(~begun | bench.past(bench.reset) | bench.inner["capture_start"])
    recorded = block.record_valid & (block.record_axis == taken) & ~bench.reset
    comes = bench.past(recorded)
    heard = bench.inner["sampled"]
    of_it = bench.past(comes & ~bench.reset, SAMPLED - 1) & (bench.past(block.record_axis, SAMPLED) == taken)
    bench.promise(~heard | begins | begun | of_it)
    # Records of one axis are a rota apart.
    bench.promise(~heard | comes | (bench.inner["count"] == bench.past(block.record_count, SAMPLED)))


PROPERTIES = [
    Property(
        "the memory hears only of samples of the axis that the last start took, with the count of their records",
        WHERE,
        of_the_axis_taken,
        depth=4,
        bugs=(
            Bug(AxesCapture.elaborate, "with m.If(self.capture_start):", "with m.If(self.turn_valid):"),
            Bug(AxesCapture.elaborate, "self.record_valid & (self.record_axis == axis)", "self.record_valid"),
            Bug(AxesCapture.elaborate, "memory.sampled.eq(self._late(m, recorded, SAMPLED))", "memory.sampled.eq(1)"),
        ),
        quick=True,
    ),
]
