"""The amplifier behind the pins of a drive, and what came of it at every tick."""

from amaranth.hdl import ClockDomain, Instance, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .scene import PUMP_CLOCKS
from .staged import Staged

CLOCK_BITS, STEP_BITS = 40, 32
COUNTERS = dict.fromkeys(("ticks", "last_asked", "last_given"), Out(CLOCK_BITS))
FORCES = {"steps": Out(signed(STEP_BITS)), "given": Out(signed(CLOCK_BITS + STEP_BITS)), "shot": Out(1)}


class Amplified(wiring.Component):
    """The amplifier of `sim/rtl/amplifiers.v` at the pins before `outputs_enable` leaves them to their pulls.

    It is looked at by `tick`, a clock that never stops: `steps` is the force that the pins ask for now, `given` the sum
    of it over the ticks at which the amplifier had its enable, from a charge pump at `alive`. `ticks` counts the ticks;
    `last_asked` and `last_given` are the last ones with a force at the pins, and with one behind the amplifier. `shot`
    is high once both gates of a leg have been on.

    Args:
        stage: the drive stage.
    """

    def __init__(self, stage: Staged):
        self.stage = stage
        pins = dict.fromkeys((*stage.spec.drive.pins, "alive", "tick"), In(1))
        super().__init__({**pins, **COUNTERS, **FORCES})

    def elaborate(self, platform):
        m = Module()
        m.domains.ticked = ticked = ClockDomain("ticked", reset_less=True, local=True)
        m.d.comb += ticked.clk.eq(self.tick)
        shoots = Signal()
        m.submodules.amplifier = self._amplifier(shoots)
        m.d.ticked += self.shot.eq(self.shot | shoots)
        # Ticks since the last edge at the charge pump, which has run down before the first one.
        before, since = Signal(), Signal(range(PUMP_CLOCKS + 1), init=PUMP_CLOCKS)
        enabled = Signal()
        m.d.comb += enabled.eq(since != PUMP_CLOCKS)
        m.d.ticked += [before.eq(self.alive), since.eq(Mux(self.alive != before, 0, since + enabled))]
        m.d.ticked += self.ticks.eq(self.ticks + 1)
        with m.If(self.steps != 0):
            m.d.ticked += self.last_asked.eq(self.ticks)
        with m.If((self.steps != 0) & enabled):
            m.d.ticked += [self.last_given.eq(self.ticks), self.given.eq(self.given + self.steps)]
        return m

    def _amplifier(self, shoots: Signal) -> Instance:
        """Return the amplifier.

        Args:
            shoots: is high while a leg of a bridge shoots through.
        """
        stage = self.stage
        shot = {"o_shot": shoots} if stage.name == "pwm" else {}
        tick = {"i_tick": self.tick} if stage.name == "dac" else {}
        pins = {f"i_{name}": getattr(self, name) for name in stage.spec.drive.pins}
        return Instance(f"{stage.name}_amplifier", *stage.parameters, **pins, **shot, **tick, o_steps=self.steps)
