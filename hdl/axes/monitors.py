"""The monitors of samples, an axis a clock: what is wrong with an axis, for the supervisor's turn."""

from collections.abc import Callable
from typing import NamedTuple

from amaranth.hdl import Cat, Const, Mux, Value

from hardwall.model.axes.supervised import Design
from hardwall.model.axis.monitors import (
    ENCODER_LOSS,
    ESTIMATOR_SATURATED,
    IDLE_EDGES,
    INDEX_SPACING,
    POSITION_RANGE,
    POSITION_WRAP,
    RUNAWAY,
    VELOCITY_LIMIT,
)

from .pipe import Kept, Pipe


class Sample(NamedTuple):
    """A sample as it enters the monitors.

    Attributes:
        stage: the stage in which it does.
        first: whether it is its axis's first one after a reset.
        fresh: whether it is, or comes after a preload.
        shifted: whether it comes after a shift of the origin.
        shift: the counts of that shift, a stage later.
        indexed: whether an index came since the axis's last sample.
        index_low: the low bits of its place: enough to tell how far the sample is from it.
    """

    stage: int
    first: Value
    fresh: Value
    shifted: Value
    shift: Value
    indexed: Value
    index_low: Value
    count: Value
    velocity: Value
    saturated: Value


class Looked(NamedTuple):
    """The encoder's events since the last turn, as a turn's look shows them, a stage later.

    Attributes:
        stage: that stage.
        lost: for both channels, whether it has equalled its complement at every clock.
        edges: for both channels, whether it had an edge.
    """

    stage: int
    first: Value
    lost: Value
    edges: Value


class Monitors:
    """The monitors of `hardwall.model.axes.monitors`.

    Args:
        pipe: the pipeline.
        design: formats and the clocks of a rota.
        word: returns a run-time word of the axis that is in a stage, by the name of the word and the stage.
    """

    def __init__(self, pipe: Pipe, design: Design, word: Callable[[str, int], Value]):
        self._pipe, self._word = pipe, word
        self._width, self._shift, self._rota = design.params.monitors

    def of_sample(self, sample: Sample, stage: int) -> dict[int, Value]:
        """Return the causes that a sample alone shows, by their bits, in a later stage."""
        pipe, word, now = self._pipe, self._word, sample.stage
        top = sample.count[-3:]
        limit = Cat(Const(0, self._shift), word("supervisor_velocity_limit", now))
        found = {
            POSITION_RANGE: (sample.count < word("supervisor_position_low", now))
            | (sample.count > word("supervisor_position_high", now)),
            # Beyond three quarters of the range of two's complement, by the first three bits.
            POSITION_WRAP: (top == 0b011) | (top == 0b100),
            VELOCITY_LIMIT: ~_within(sample.velocity, limit),
        }
        causes = {bit: pipe.later(wrong, stage - now) for bit, wrong in found.items()}
        causes[ESTIMATOR_SATURATED] = pipe.later(self._saturated(sample), stage - now - 2)
        causes[INDEX_SPACING] = pipe.later(self._index_is_wrong(sample), stage - now - 4)
        return causes

    def _saturated(self, sample: Sample) -> Value:
        """Return whether the estimate has been saturated for too many samples, 2 stages later."""
        pipe, now = self._pipe, sample.stage
        limit = self._word("supervisor_saturated", now + 1)
        kept = pipe.kept("saturated_samples", len(limit) + 1)
        before = pipe.taken(Mux(sample.first, 0, kept.read(now)), "samples_before")
        # What is read, compared and counted on has a stage each.
        more, enough = pipe.taken(before <= limit, "more"), pipe.taken(before >= limit, "enough")
        saturated = pipe.later(sample.saturated, 2)
        kept.leave(now + 2, Mux(saturated, pipe.taken(before) + more, 0)[: len(limit) + 1])
        return saturated & enough

    def _index_is_wrong(self, sample: Sample) -> Value:
        """Return whether an index is neither at the last one nor a turn away, 4 stages later."""
        pipe, width, now = self._pipe, self._width, sample.stage
        bits = len(sample.index_low)
        since = (sample.count[:bits] - sample.index_low)[:bits].as_signed()
        place = pipe.taken((sample.count - since)[:width], "index_place")
        indexed, fresh = pipe.taken(sample.indexed), pipe.taken(sample.fresh)
        kept = pipe.kept("last_index", width + 1)
        shift = Mux(pipe.taken(sample.shifted), sample.shift, 0)
        last, known = (kept.read(now + 1)[:width] + shift)[:width], kept.read(now + 1)[-1] & ~fresh
        kept.leave(now + 1, Cat(Mux(indexed, place, last), indexed | known))

        distance = pipe.taken((place - last)[:width].as_signed(), "index_distance")
        measured = pipe.later(indexed & known, 3)
        way = pipe.taken(Mux(distance < 0, -distance, distance)[:width], "index_way")
        far = pipe.taken(way > self._word("supervisor_index_tolerance", now + 3))
        beyond = pipe.taken(way - self._word("supervisor_turn", now + 3))
        tolerance = Cat(self._word("supervisor_index_tolerance", now + 4), Const(0, len(beyond)))[: len(beyond) - 1]
        return measured & far & ~_within(beyond, tolerance)

    def moved(self, sample: Sample) -> Value:
        """Return the counts since the axis's last sample, 0 at a fresh or shifted one, one stage later."""
        kept = self._pipe.kept("monitored_count", self._width)
        kept.leave(sample.stage, sample.count)
        moved = (sample.count - kept.read(sample.stage).as_signed())[: self._width]
        return self._pipe.taken(Mux(sample.fresh | sample.shifted, 0, moved), "moved").as_signed()

    def runaway(self, moved: Value, first: Value, let_out: Kept, stage: int) -> dict[int, Value]:
        """Return whether the handle has moved too far against a drive at its limit, by the cause's bit, 3 stages later.

        Args:
            moved: the counts since the axis's last sample, in that stage.
            first: whether the sample is its axis's first one, a stage later.
            let_out: whether the drive that was let out last is at its limit, and whether it is negative, a stage later.
            stage: the stage.
        """
        pipe, width = self._pipe, self._width
        kept = pipe.kept("way", width + 2)
        before, then = kept.read(stage), stage + 1
        # The way is negative, so that a sum compares it.
        down, up = (
            pipe.taken((before[:width] - moved)[:width], "down"),
            pipe.taken((before[:width] + moved)[:width], "up"),
        )
        pressed_before, negative_before = pipe.taken(before[width:])
        at_limit, negative = let_out.read(then)
        pressed = at_limit & ~first
        held = pressed & pressed_before & (negative == negative_before)
        way = Mux(held, Mux(negative, down, up), 0)
        kept.leave(then, Cat(way, pressed, negative))
        longest = self._word("supervisor_runaway", then + 1)
        return {RUNAWAY: pipe.taken(longest + pipe.taken(way, "way_now").as_signed() < 0)}

    def of_look(self, looked: Looked) -> tuple[dict[int, Value], Value]:
        """Return the cause that the look alone shows, by its bit, and the warning, a stage later."""
        pipe, stage = self._pipe, looked.stage
        longest = self._word("supervisor_loss", stage)
        wrong = []
        for channel, lost in zip("ab", looked.lost, strict=True):
            kept = pipe.kept(f"lost_{channel}", range((1 << len(longest)) + self._rota))
            passed = Mux(looked.first, 0, pipe.taken(kept.read(stage - 1)))
            too_long, more = passed > longest, passed + self._rota
            kept.leave(stage, Mux(lost, Mux(too_long, passed, more), 0))
            wrong.append(lost & (too_long | (more > longest)))

        kept = pipe.kept("edges", 1 + IDLE_EDGES.bit_length())
        before = Mux(looked.first, 0, pipe.taken(kept.read(stage - 1)))
        channel, edges, (edge_a, edge_b) = before[0], before[1:], looked.edges
        more = Mux(channel == edge_b, Mux(edges == IDLE_EDGES, edges, edges + 1), 1)
        counted = Mux(edge_a & edge_b, 0, Mux(edge_a | edge_b, more, edges))[: len(edges)]
        kept.leave(stage, Cat(Mux(edge_a ^ edge_b, edge_b, channel), counted))
        return {ENCODER_LOSS: pipe.taken(Cat(wrong).any())}, pipe.taken(counted == IDLE_EDGES)


def _within(value: Value, limit: Value) -> Value:
    """Return whether the magnitude of a signed value is at most a limit that has its bits but the sign.

    A subtraction adds the complement of the magnitude and one: of a negative value, the value itself.
    """
    sign, bits = value[-1], value[:-1]
    return (Cat(Const(1, 1), limit) + Cat(~sign, bits ^ ~sign.replicate(len(bits))))[-1]
