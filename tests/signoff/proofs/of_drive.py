"""What the drive stages promise: no bridge shoots through, and pins are safe unless everything says otherwise."""

from functools import partial

from amaranth.hdl import Mux, Signal

from hardwall.hdl.drive.dac import Dac
from hardwall.hdl.drive.pdm import Pdm
from hardwall.hdl.drive.pwm import Pwm
from hardwall.hdl.drive.registry import block_of
from hardwall.hdl.drive.scale import Scale
from stimuli.stages import axis

from .bench import Bench
from .bugs import Bug
from .property import Property
from .widths import Widths


def bridge(name: str, bench: Bench) -> Pwm:
    return bench.block(Pwm(axis(name).drive))


def never_shoots_through(name: str, bench: Bench) -> None:
    stage = bridge(name, bench)
    dead = stage.design.dead
    for leg in "ab":
        side, left, high, low = (bench.inner[f"{leg}_{each}"] for each in ("side", "left", "high", "low"))
        pins = {"high": getattr(stage, f"gate_high_{leg}"), "low": getattr(stage, f"gate_low_{leg}")}
        bench.promise(~(pins["high"] & pins["low"]))
        bench.promise(~(high & low) & (~(high | low) | (left == 0)) & (~high | side) & (~low | ~side))
        for gate, other, comes in (("high", "low", side), ("low", "high", ~side)):
            # The clocks for which the other gate has been off, from power-up on, whatever the reset does.
            off = Signal(range(dead + 1), init=dead, reset_less=True, name=f"{leg}_{other}_off")
            bench.m.d.sync += off.eq(Mux(pins[other], 0, Mux(off == dead, dead, off + 1)))
            bench.promise((off <= dead) & (~pins[gate] | (off == dead)))
            bench.promise(~comes | (off + left >= dead - 1))
            bench.promise(~{"high": high, "low": low}[gate] | (off == dead))


def gates_off(name: str, bench: Bench) -> None:
    stage = bridge(name, bench)
    gates = stage.gate_high_a | stage.gate_low_a | stage.gate_high_b | stage.gate_low_b
    bench.promise(stage.permitted | ~gates)
    bench.promise(bench.past(stage.armed & ~bench.reset) | ~gates)


def clear_low(name: str, bench: Bench) -> None:
    stage = bench.block(Dac(axis(name).drive))
    safe = ~stage.dac_clear_n & stage.dac_cs_n
    bench.promise(stage.permitted | safe)
    bench.promise(bench.past(stage.armed & ~bench.reset) | safe)
    # A frame is under way only while the chip is selected, and the clear is high.
    bench.promise((bench.inner["place"] == 0) | bench.inner["ready"])


def no_pulse(name: str, bench: Bench) -> None:
    stage = bench.block(Pdm(axis(name).drive))
    # The supervisor makes the drive zero with the state; behind a scaling the stage looks at the state itself.
    zero = ~stage.armed if stage.design.scale else stage.magnitude == 0
    bench.promise(stage.permitted | ~stage.drive_pdm)
    bench.promise(~bench.past(zero | bench.reset, init=1) | ~stage.drive_pdm)


def no_arithmetic_wraps(name: str, bench: Bench) -> None:
    """The ranges of the registers, too; the bits of a frame leave its word at its upper end, as they are meant to."""
    design = axis(name).drive
    bench.block(block_of(design), Widths(("word",)))
    if design.scale:
        most, largest = design.scale.params.most, design.magnitude.max * design.scale.params.gain
        bench.within(**{"scale.product": (0, largest), "scale.steps": (0, most)})
    if name.startswith("pwm"):
        bench.within(phase=(0, design.period - 1), width=(0, design.most))
    if name.startswith("dac"):
        bench.within(place=(0, 2 * design.params.frame_bits + 2), left=(0, design.params.half - 1))
        if design.params.frames:
            bench.within(told=(0, design.params.frames))


PROPERTIES = [
    Property(
        "the gates of a leg are never on together, and the dead time is between them, through every reset and stop",
        "drive pwm brief",
        partial(never_shoots_through, "pwm brief"),
        depth=2,
        bugs=(
            Bug(Pwm._leg, "left.eq(dead - 1)", "left.eq(0)"),
            Bug(Pwm._leg, "[side.eq(0), left.eq(dead)]", "[side.eq(0), left.eq(0)]"),
            Bug(Pwm._leg, "init=dead", "init=0"),
            Bug(Pwm._leg, "low.eq(~side)", "low.eq(1)"),
        ),
        quick=True,
    ),
    Property(
        "the gates of a leg are never on together, and the dead time is between them, through every reset and stop",
        "drive pwm",
        partial(never_shoots_through, "pwm"),
        depth=2,
        bugs=(Bug(Pwm._leg, "[high.eq(0), low.eq(0)]", "[high.eq(0)]"),),
    ),
    *(
        Property(
            "no gate is on without permission, nor one clock after the axis is not ARMED",
            f"drive {name}",
            partial(gates_off, name),
            depth=2,
            bugs=(
                Bug(Pwm._leg, "low_pin.eq(low & self.permitted)", "low_pin.eq(low)"),
                Bug(Pwm._leg, "with m.If(~self.armed):", "with m.If(0):"),
            ),
            quick=name == "pwm",
        )
        for name in ("pwm brief", "pwm")
    ),
    *(
        Property(
            "the clear is low and no frame goes on without permission, nor one clock after the axis is not ARMED",
            f"drive {name}",
            partial(clear_low, name),
            depth=2,
            bugs=(
                Bug(Dac.elaborate, "ready & self.permitted", "ready"),
                Bug(Dac.elaborate, "ready.eq(self.armed)", "ready.eq(ready | self.armed)"),
                Bug(Dac.elaborate, "select | ~self.permitted", "select"),
                Bug(Dac.elaborate, "Mux(self.armed, Mux(begins, 1, next_place), 0)", "Mux(begins, 1, next_place)"),
            ),
            quick=name == "dac",
        )
        for name in ("dac", "dac narrow")
    ),
    *(
        Property(
            "no pulse comes without permission, nor one clock after the axis is not ARMED",
            f"drive {name}",
            partial(no_pulse, name),
            depth=2,
            bugs=(Bug(Pdm.elaborate, "total[-1] & self.permitted", "total[-1]"), bug),
            quick=name == "pdm",
        )
        for name, bug in (
            ("pdm", Bug(Pdm.elaborate, "total[:-1] + amount", "total[:-1] + amount + 1")),
            ("pdm scaled", Bug(Pdm.elaborate, "Mux(self.armed, scale.steps, 0)", "scale.steps")),
        )
    ),
    *(
        Property(
            "no arithmetic wraps but where it is meant to",
            f"drive {name}",
            partial(no_arithmetic_wraps, name),
            depth=2,
            bugs=(bug,),
        )
        for name, bug in (
            ("pdm", Bug(Pdm.elaborate, "Signal(self._design.params.bits + 1)", "Signal(self._design.params.bits)")),
            ("pdm scaled", Bug(Scale.elaborate, "Mux(rounded > most, most, rounded)", "rounded")),
            ("pwm", Bug(Pwm.elaborate, "Mux(ends, 0, phase + 1)", "phase - 1")),
            ("pwm narrow", Bug(Scale.elaborate, "Mux(rounded > most, most, rounded)", "rounded")),
            ("dac", Bug(Dac._frame, "signed(params.bits + 1)", "signed(params.bits)")),
            ("dac high", Bug(Dac.elaborate, "Mux(place == last + 1, 0, place + 1)", "place + 1")),
        )
    ),
]
