"""The members that every velocity estimator has in hardware, with the bus from the decoder."""

from collections.abc import Callable

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Member, Out, connect, flipped

from hardwall.model.estimators.estimate import EstimatorDesign

from ..arithmetic.fixed import shape
from ..block import Block
from ..encoder.quadrature import Seen
from .bursts import Bursts


class EstimatorBlock(Block):
    """A velocity estimator with the members that all estimators have; a subclass adds the logic.

    Parameters
    ----------
    design : hardwall.model.estimators.estimate.EstimatorDesign
        The estimator's design, of its `design_class`.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    seen : In(Seen)
        The decoder's outputs, valid with `strobe`; an estimator uses the fields `design.inputs`.
    one input for each of `design.words` : In
        Run-time parameters; constant from a `strobe` to its `valid`.
    velocity : Out(SQ)
        Velocity, counts a sample, in the format `design.velocity`; constant from one `valid` to the next.
    saturated : Out
        From `valid` until the next `strobe`: bits as in `design.flags`.
    valid : Out(1)
        High for one clock. The next `strobe` may come with it.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    @staticmethod
    def members(design: EstimatorDesign) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "restart": In(1),
            "seen": In(Seen(design.count_width, design.stamp_width)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "velocity": Out(shape(design.velocity)),
            "saturated": Out(len(design.flags)),
            "valid": Out(1),
        }

    def _bursts(self, m: Module) -> Bursts:
        """Add the watch over bursts, and return it: its outputs hold from its latency on until the next strobe."""
        m.submodules.watch = watch = Bursts(self._design.bursts)
        m.d.comb += [watch.strobe.eq(self.strobe), watch.restart.eq(self.restart)]
        connect(m, flipped(self.seen), watch.seen)
        return watch

    def _step_by_step(
        self, m: Module, moved: Signal, forget: Callable[[Value], None], sequence: dict[str, list]
    ) -> None:
        """Describe a machine that takes the count with the strobe, and then goes through a sequence, a step a clock.

        Args:
            m: the block's module.
            moved: takes the difference from the last count: 0 at the first sample and with `restart`.
            forget: called with the condition that there is no past; describes the actions at the strobe in this case.
            sequence: the statements of every step, by its name.
        """
        running = Signal()
        last = Signal.like(self.seen.count)
        following = [*list(sequence)[1:], "SAMPLE"]
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                fresh = self.restart | ~running
                # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                m.d.sync += [
                    moved.eq(Mux(fresh, 0, (self.seen.count - last)[: len(moved)].as_signed())),
                    last.eq(self.seen.count),
                    running.eq(1),
                ]
                forget(fresh)
                m.next = next(iter(sequence))
            for (name, statements), after in zip(sequence.items(), following, strict=True):
                with m.State(name):
                    m.d.sync += statements
                    m.next = after
