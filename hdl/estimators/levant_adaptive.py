"""Levant's differentiator of order 3 with filtering, whose bound L follows the signal."""

from amaranth.hdl import Array, Module, Mux, Signal, Value

from hardwall.model.estimators.levant_adaptive import FALL, LEVELS, Design

from ..arithmetic.fixed import shape
from ..arithmetic.powers import entry_of
from ..wires import port
from . import levant_higher


class Estimator(levant_higher.Estimator):
    """A differentiator of order 3 with filtering that lowers L while it follows, one sample at a time.

    Equation: as of `levant_higher`, with L 2**-level for L. A sample with d = |z0 - count| counts gives the next one
    a level by this law:

        d < LOST                  no doublings; after HOLD T samples of this, level rises by 1
        d < 2 LOST, level < FALL  the same
        d >= LOST 2**doublings    level falls by FALL, at most to 0; one doubling more
        otherwise                 level stays

    `hardwall.model.estimators.levant_adaptive` says why.

    Start: at the first sample, and with `restart`, z0 = count and all else is 0.

    Latency: `latency` clocks from `strobe` to `valid`, as of `levant_higher`. The next `strobe` may come with `valid`.

    Rounding and overflow: as of `levant_higher`; no count of the law overflows.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_adaptive.Design
        Formats; its module derives them.

    Source: Levant 2003; Levant, Livne 2012 and 2020; the law is this project's.
    """

    design_class = Design

    def _octaves(self, m: Module, judge: Value, begin: Value, gap: Signal) -> Value:
        design = self.design
        word = port(self, design.words[0].name)
        holds = design.holds.tolist()
        level, lower, after = (Signal(range(LEVELS + 1), name=name) for name in ("level", "lower", "level_after"))
        calm = Signal(range(max(holds)))
        doublings = Signal(range(-(-LEVELS // FALL) + 1))
        octaves = Signal(shape(design.powers.octave_format))
        m.d.comb += octaves.eq(word - level)

        # The last sample of a hold has the number of its samples less one. The table is read before a sample comes.
        longest, ahead = Signal.like(calm), Signal(range(len(holds)))
        m.d.comb += ahead.eq(design.words[0].high - word + level)
        m.d.sync += longest.eq(entry_of(m, ahead, [samples - 1 for samples in holds], "hold"))

        # The distance in multiples of LOST; a negative one is complemented.
        far = (gap ^ gap[-1].replicate(len(gap)))[design.gap.f + design.lost_bits : -1]
        lost = Array([far[doubled:].any() for doubled in range(1 << len(doublings))])[doublings]
        held, last = calm >= longest, level == LEVELS
        m.d.comb += [lower.eq(Mux(level < FALL, 0, level - FALL)), after.eq(level)]
        with m.If(judge):
            with m.If(~Mux(level < FALL, far[1:], far).any()):
                m.d.sync += [calm.eq(Mux(last | held, 0, calm + 1)), doublings.eq(0)]
                m.d.comb += after.eq(Mux(held & ~last, level + 1, level))
            with m.Else():
                m.d.sync += calm.eq(0)
                with m.If(lost & (level != 0)):
                    m.d.comb += after.eq(lower)
                    m.d.sync += doublings.eq(doublings + 1)
        with m.If(begin):
            m.d.comb += after.eq(0)
            m.d.sync += calm.eq(0)
        m.d.sync += level.eq(after)
        return octaves
