"""The supervisor, an axis a clock: what the turn of a sample makes of its axis's state and drive."""

from collections.abc import Callable
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Mux, Value

from hardwall.model.axis.supervisor import ALWAYS, ARMED, COUNT, COUNT_BITS, DISARMED, LINK, REQUIRED, TRIPPED, Design

from ..arithmetic.fixed import below, negated
from .pipe import Kept, Pipe


class Turn(NamedTuple):
    """The inputs of the supervisor in a turn; inputs not described here are as of
    `hardwall.hdl.axis.supervisor.Supervisor`.

    Attributes:
        stage: the stage in which all but the next two are there.
        drive, stamp: the drive that the output stage asks for, and the number of the clock, a stage later.
        first: whether it is the axis's first turn after a reset.
        live: whether the host's heartbeat is not overdue.
    """

    stage: int
    drive: Value
    stamp: Value
    first: Value
    live: Value
    causes: Value
    enable: Value
    referenced: Value
    arm: Value
    disarm: Value
    acknowledge: Value
    acknowledged: Value


class Judged(NamedTuple):
    """The decision of a turn, 2 stages later.

    Attributes:
        drives: whether the axis stays ARMED: otherwise the drive that is let out is zero.
        was_armed: whether it was ARMED before.

    The others are as of `hardwall.hdl.axis.supervisor.Supervisor`.
    """

    drives: Value
    was_armed: Value
    magnitude: Value
    negative: Value
    state: Value
    ready: Value
    latched: Value
    first: Value
    first_stamp: Value
    counts: Value


class Supervisors:
    """The supervisors of all axes: a turn is one clock, with a strobe, of `hardwall.hdl.axis.supervisor.Supervisor`.

    Args:
        pipe: the pipeline.
        design: the formats of each.
        word: returns a run-time word of the axis that is in a stage, by the name of the word and the stage.

    Attributes:
        let_out: of every axis, whether the drive that was let out last is at its limit, and whether it is negative.
    """

    def __init__(self, pipe: Pipe, design: Design, word: Callable[[str, int], Value]):
        self._pipe, self._design, self._word = pipe, design, word
        self.let_out: Kept = pipe.kept("let_out", 2)

    def judged(self, turn: Turn) -> Judged:
        """Return what a turn decides, and keep it."""
        pipe, stage, then, word = self._pipe, turn.stage, turn.stage + 1, self._word
        kept = pipe.kept("state", 2)
        state = Mux(turn.first, DISARMED, pipe.taken(kept.read(stage - 1)))
        watched = (word("supervisor_causes", stage) | REQUIRED) & (
            Const(ALWAYS, COUNT) | (state == ARMED).replicate(COUNT)
        )
        present = Cat(~turn.live if bit == LINK else cause for bit, cause in enumerate(turn.causes))
        standing = (present & watched)[:COUNT]
        allowed = turn.enable & turn.live & (turn.referenced | ~word("supervisor_reference", stage))
        ready = pipe.taken((state == DISARMED) & ~standing.any() & allowed, "ready")

        trips, before = pipe.taken(standing.any(), "trips"), pipe.taken(state, "state_before")
        standing, first = pipe.taken(standing, "standing"), pipe.taken(turn.first, "first_turn")
        was_armed, tripped = before == ARMED, before == TRIPPED
        stays = pipe.taken(turn.enable & ~turn.disarm, "stays")
        drives = was_armed & stays & ~trips
        latched, forgotten = self._latched(turn, standing, tripped & ~trips)
        arms = drives | (ready & stays & pipe.taken(turn.arm))
        after = Mux(trips | (tripped & ~forgotten), TRIPPED, Mux(arms, ARMED, DISARMED))[:2]
        kept.leave(then, after)

        magnitude, negative = self._limited(turn, drives)
        trip = self._first(then, first, trips & ~tripped, Cat(standing, turn.stamp))
        return Judged(
            drives=pipe.taken(drives, "drives"),
            was_armed=pipe.taken(was_armed),
            magnitude=magnitude,
            negative=negative,
            state=pipe.taken(after),
            ready=pipe.taken(ready),
            latched=latched,
            first=trip[:COUNT],
            first_stamp=trip[COUNT:],
            counts=self._counts(then, first, standing),
        )

    def _latched(self, turn: Turn, standing: Value, may_forget: Value) -> tuple[Value, Value]:
        """Return the causes since the last acknowledgement, 2 stages later, and whether they are forgotten, one."""
        pipe = self._pipe
        kept = pipe.kept("latched", COUNT)
        before = Mux(turn.first, 0, pipe.taken(kept.read(turn.stage - 1)))
        forgotten = may_forget & pipe.taken(turn.acknowledge & (turn.acknowledged == before), "named")
        latched = Mux(forgotten, 0, pipe.taken(before, "latched_before") | standing)
        kept.leave(turn.stage + 1, latched)
        return pipe.taken(latched, "latched_now"), forgotten

    def _limited(self, turn: Turn, drives: Value) -> tuple[Value, Value]:
        """Let the drive out within the ceiling and the force limit, and raise the ceiling; return what is let out."""
        pipe, stage, then = self._pipe, turn.stage, turn.stage + 1
        fraction, bits = self._design.params.ramp_fraction, self._design.limit.width
        kept = pipe.kept("ceiling", fraction + bits + 1)
        ceiling, most = pipe.taken(kept.read(stage - 1)), self._word("supervisor_force_limit", stage)
        bound = ceiling[fraction:]
        limit = pipe.taken(Mux(bound > most, most, bound)[:bits], "limit")
        raised = Cat(pipe.taken(ceiling[:fraction]), limit) + self._word("supervisor_ramp", then)
        kept.leave(then, Mux(drives, raised, 0))

        # The complement of the drive's magnitude, which a comparison adds.
        less = (~negated(turn.drive, turn.drive[-1]))[: len(turn.drive)]
        within, negative = below(less, limit), drives & turn.drive[-1]
        self.let_out.leave(then, Cat(drives & ~within & limit.any(), negative))
        magnitude = Mux(drives, Mux(within, ~less, limit), 0)[:bits]
        return pipe.taken(magnitude, "magnitude_now"), pipe.taken(negative, "negative_now")

    def _first(self, stage: int, first: Value, caught: Value, trip: Value) -> Value:
        """Keep the causes and the clock of a trip; return the last trip's, a stage later."""
        kept = self._pipe.kept("first_trip", len(trip))
        kept.write(Mux(caught, trip, 0), self._pipe.axis(stage), enable=self._pipe.valid(stage) & (caught | first))
        return kept.read(stage + 1)

    def _counts(self, stage: int, first: Value, standing: Value) -> Value:
        """Return the occurrences of every cause, a stage later; they saturate."""
        pipe = self._pipe
        kept = pipe.kept("counts", COUNT * (COUNT_BITS + 1))
        before = Mux(first, 0, kept.read(stage))
        rose, counts = standing & ~before[:COUNT], []
        for bit, count in enumerate(before[COUNT:].word_select(bit, COUNT_BITS) for bit in range(COUNT)):
            counts.append((count + (rose[bit] & ~count.all()))[:COUNT_BITS])
        kept.leave(stage, Cat(standing, counts))
        return pipe.taken(Cat(counts), "counts_now")
