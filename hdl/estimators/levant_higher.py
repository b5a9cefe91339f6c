"""Levant's sliding-mode differentiators of order 2 and 3, with and without filtering."""

from itertools import pairwise

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed

from hardwall.model.estimators.levant_higher_design import Design

from ..arithmetic.fixed import fits, fitted, shape, shift_floor, shift_round_half_up
from ..arithmetic.powers import Powers
from ..block import Block
from ..wires import port
from .acceleration import AcceleratedBlock
from .levant import arrive


class Estimator(AcceleratedBlock):
    """A differentiator of one of the four designs, one sample at a time.

    Equation, per sample, in counts and sample periods, with r = |e|^(1 / (N + 1)). The error e is z0 - count; with
    filtering it is w. `hardwall.model.estimators.levant_higher_design` has the lines without filtering, too:

        w  <- w + (z0 - count)      - c_N     r^N     sign(e)
        z0 <- z0 + z1 + z2 / 2      - c_(N-1) r^(N-1) sign(e)
        z1 <- z1 + z2 + z3 / 2      - ...
        z2 <- z2 + z3               - ...
        z3 <- z3                    - c_0 sign(e)

    The velocity is z1, the acceleration z2. Start: at the first sample, and with `restart`, z0 = count and all else is
    0.

    Latency: `latency` clocks from `strobe` to `valid`. Without filtering: one for the distance from the count, one for
    the magnitude of e, the powers' own, one for the sums. With filtering, e is known before the strobe: the powers
    begin with it, and the first two clocks are theirs, too. The next `strobe` may come with `valid`.

    Rounding and overflow: the powers are rough, as derived; Taylor's terms and the velocity round half up, the
    acceleration rounds down; saturations are flagged. The count may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.levant_higher_design.Design
        Formats; its module derives them.

    Source: Levant 2003; Livne, Levant 2014; Levant, Livne 2020.
    """

    design_class = Design
    unit_class = Powers

    def elaborate(self, platform):
        m = Module()
        design = self.design
        m.submodules.powers = powers = self.unit_class(design.powers)

        # The states. z1 has half of the output's LSB added; z0 is held as its distance from the last count, `lead`.
        w, half = Signal(shape(design.w)), design.half
        z = [
            Signal(shape(each), name=f"z{n}", init=half if n == 1 else 0)
            for n, each in enumerate(design.z[: design.order], 1)
        ]
        lead = Signal(signed(max(design.gap.width, design.z[0].width, *map(len, self._terms(powers))) + 3))
        led = Signal(signed(max(len(lead), design.count_width + design.gap.f) + 1))
        gap, over, negative, still = Signal(shape(design.gap)), Signal(), Signal(), Signal()
        states = [*([w] if design.filtering else []), lead, *z]
        sums = self._taylor(m, states, gap)
        corrections = self._corrections(m, powers, still)

        m.d.comb += [
            self.velocity.eq(z[0] >> design.z[0].f - design.velocity.f),
            self.acceleration.eq(shift_floor(z[1], design.z[1].f - design.acceleration.f)),
        ]
        near = fitted(led, design.gap.width)
        error = w if design.filtering else near
        size = (error ^ error[-1].replicate(len(error)))[:-2]
        if design.filtering:
            m.d.comb += [powers.size.eq(size), powers.start.eq(self.strobe)]
        else:
            m.d.sync += [powers.size.eq(size), powers.start.eq(0)]
        m.d.sync += self.valid.eq(0)
        with m.FSM():
            first = arrive(m, self, led, lead, design.gap.f, "MAGNITUDE")
            with m.State("MAGNITUDE"):
                m.d.sync += [
                    gap.eq(near),
                    over.eq(~fits(led, design.gap.width)),
                    negative.eq(error[-1]),
                    still.eq(error == 0),
                ]
                if not design.filtering:
                    m.d.sync += powers.start.eq(1)
                m.next = "POWERS"
            with m.State("POWERS"), m.If(powers.done):
                far = [_moved(total, term, ~negative) for total, term in zip(sums, corrections, strict=True)]
                beyond = [~fits(each, len(state)) for each, state in zip(far, states, strict=True)]
                error_beyond, (_, velocity_beyond, *others) = beyond[: design.filtering], beyond[design.filtering :]
                for number, (state, after) in enumerate(zip(states, far, strict=True)):
                    # The lead saturates when it has become the distance from the next count.
                    fresh = first | velocity_beyond if number > design.filtering + 1 else first
                    m.d.sync += state.eq(Mux(fresh, state.init, after if state is lead else fitted(after, len(state))))
                m.d.sync += [
                    self.saturated[0].eq(~first & Cat(over, *error_beyond).any()),
                    self.saturated[1].eq(~first & velocity_beyond),
                    self.saturated[2].eq(~first & Cat(*others).any()),
                    self.valid.eq(1),
                ]
                m.next = "SAMPLE"
        m.d.comb += powers.octaves.eq(self._octaves(m, powers.done & ~first, powers.done & first, gap))
        return m

    def _octaves(self, m: Module, judge: Value, begin: Value, gap: Signal) -> Value:
        """Return by how many octaves L is raised.

        `judge` is high in the last clock of a sample, with its distance `gap`; `begin` in the last clock of the first
        one. What a form that adapts makes of it is for the next sample.
        """
        return port(self, self.design.words[0].name)

    def _terms(self, powers: Block) -> list[Signal]:
        """Return the terms of the states, in their order."""
        return [port(powers, f"term_{number}") for number in range(len(self.design.powers.widths))]

    def _corrections(self, m: Module, powers: Powers, still: Signal) -> list[Value]:
        """Return the corrections of all states; `still` tells that there is no error."""
        return [*self._terms(powers), Mux(still, 0, self._relay(m, powers.octaves))]

    def _taylor(self, m: Module, states: list[Signal], gap: Signal) -> list[Signal]:
        """Return every state moved by those that follow it, in registers, which are ready while the powers are made.

        The states stay until then: `onward`, to which z1 and z2 come first, is ready a clock after them.
        """
        design = self.design
        w, lead, z = states[0], states[design.filtering], states[design.filtering + 1 :]
        f = [design.gap.f, *(each.f for each in design.z)]
        further = self._further(m, z)
        onward, ahead = Signal(signed(max(len(z[0]), len(further) + 1) + 1)), Signal.like(lead)
        m.d.sync += [
            onward.eq(z[0] - design.half + further),
            ahead.eq(gap + shift_round_half_up(onward, f[1] - f[0])),
        ]
        sums = [ahead]
        if design.filtering:
            sums.insert(0, Signal(signed(max(len(w), len(gap)) + 1), name="ahead_w"))
            m.d.sync += sums[0].eq(w + shift_round_half_up(gap, design.gap.f - design.w.f))
        for n, (state, following) in enumerate(pairwise(z), 1):
            change = following
            if n + 2 <= design.order:
                change = following + shift_round_half_up(z[n + 1], f[n + 2] - f[n + 1] + 1)
            sums.append(Signal(signed(max(len(state), len(change)) + 1), name=f"ahead_{n}"))
            m.d.sync += sums[-1].eq(state + shift_round_half_up(change, f[n + 1] - f[n]))
        return [*sums, z[-1]]

    def _further(self, m: Module, z: list[Signal]) -> Value:
        """Return what the states after z1 add to it on the way to z0, at its fraction."""
        return shift_round_half_up(z[1], self.design.z[1].f - self.design.z[0].f + 1)

    def _relay(self, m: Module, octaves: Signal) -> Signal:
        """Return the correction of the last state, in a register, two clocks after the octaves."""
        least, most = self.design.powers.octaves
        relay, taken = Signal((self.design.relays[most]).bit_length()), Signal.like(octaves)
        m.d.sync += taken.eq(octaves)
        with m.Switch(taken):
            for k in range(least, most + 1):
                with m.Case(k):
                    m.d.sync += relay.eq(self.design.relays[k])
        return relay


def _moved(value, by, down):
    """Return a signed value plus an unsigned one, or less it where `down` is high, in one chain of carries."""
    by = Cat(by, Const(0, 1)) ^ down.replicate(len(by) + 1)
    return (Cat(down, value).as_signed() + Cat(down, by).as_signed()) >> 1
