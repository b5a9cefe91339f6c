"""What the capture memory promises: once it is done it stays as it is until a start, and a start always begins."""

from hardwall.hdl.axis.capture import Capture
from hardwall.model.axis.capture import DONE, FILLING, TRIGGERED, Design
from stimuli.specs import spec

from .bench import Bench
from .bugs import Bug
from .property import Property

WHERE = "capture mhz"


def memory(bench: Bench) -> Capture:
    """Return the smallest capture memory."""
    return bench.block(Capture(Design(spec("mhz"), 2)))


def frozen(bench: Bench) -> None:
    block = memory(bench)
    shown = block.capture_state, block.capture_place, block.capture_stamp
    bench.promise(bench.kept(shown, (block.capture_state == DONE) & ~block.capture_start))
    bench.promise(~block.done | ~bench.inner["writes"])
    bench.promise(block.done == (block.capture_state == DONE))


def started(bench: Bench) -> None:
    block = memory(bench)
    begun = bench.past(block.capture_start & ~bench.reset)
    state, hand = block.capture_state, bench.past(block.capture_trigger)
    bench.promise(~begun | (state == TRIGGERED) | (state == FILLING) & ~hand)
    bench.promise(~begun | (block.capture_place == 0) & (bench.inner["kept"] == 0))


PROPERTIES = [
    Property(
        "a capture that is done is not written, and stays until a start",
        WHERE,
        frozen,
        depth=2,
        bugs=(
            Bug(Capture._memory, "writing & ~self.done", "writing"),
            Bug(Capture.elaborate, "trigger & (waiting | self.capture_start)", "trigger"),
        ),
        quick=True,
    ),
    Property(
        "a start begins a capture in every state, and a trigger with it is taken",
        WHERE,
        started,
        depth=2,
        bugs=(
            Bug(Capture.elaborate, "trigger & (waiting | self.capture_start)", "trigger & waiting"),
            Bug(Capture.elaborate, "[kept.eq(0), left.eq(0)", "[left.eq(0)"),
        ),
        quick=True,
    ),
]
