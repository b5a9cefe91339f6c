"""The checks of the register files of one axis and of several: a register, a value against its bounds, and pulses."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import Component, PureInterface

from hardwall.model.axis.register_file import EXCLUSIVE
from hardwall.model.axis.registers import RegisterMap

from ..wires import names_of


class Pulses:
    """The pulses that a frame asks for, and the means to refuse one beside another, in the order of `EXCLUSIVE`.

    Args:
        m: the module.
        host: what the server asks for.
        registers: the map.
        is_pulse, place: whether the address is a pulse's, and its lowest bits.

    Attributes:
        names: the names of all pulses.
        marks: the written ones.
        wanted: the pulses that address and value ask for.
        exclusive, after: the exclusive pulses of the frame so far, and the same with the wanted pulses.
        several: whether one of these is refused.
    """

    def __init__(self, m: Module, host: PureInterface, registers: RegisterMap, is_pulse: Value, place: Value):
        self.names = names_of(registers.pulses)
        self.marks = Signal(len(registers.pulses))
        self.wanted = Signal.like(self.marks)
        for bit, pulse in enumerate(registers.pulses):
            m.d.comb += self.wanted[bit].eq(is_pulse & (place[:4] == pulse.address % 16) & host.value[0])
        wanted = (self.wanted[self.names.index(name)] for name in EXCLUSIVE)
        self.exclusive, asked = Signal(len(EXCLUSIVE)), Cat(wanted)
        # A frame begins perhaps in the clock of its first check.
        before = Mux(host.clear, 0, self.exclusive)
        beside = {name: before[bit] for bit, name in enumerate(EXCLUSIVE)}
        refused = (
            asked[bit] & Cat(beside[other] for other in EXCLUSIVE[name]).any() for bit, name in enumerate(EXCLUSIVE)
        )
        self.after, self.several = before | asked, Cat(refused).any()

    def marked(self, name: str) -> Value:
        """Return whether a pulse is written."""
        return self.marks[self.names.index(name)]

    def begin(self, m: Module, host: PureInterface, *others) -> None:
        """Forget the findings of the last frame with `host.clear`; `others` are further assignments for this."""
        with m.If(host.clear):
            m.d.sync += [host.absent.eq(0), host.outside.eq(0), host.refused.eq(0), *others, self.exclusive.eq(0)]

    def check(self, m: Module, host: PureInterface, absent: Value, refused: Value) -> None:
        """Note what the check of a write has found."""
        with m.If(absent):
            m.d.sync += host.absent.eq(1)
        with m.If(refused):
            m.d.sync += host.refused.eq(1)
        m.d.sync += self.exclusive.eq(self.after)


class Bounds:
    """One subtraction compares a bound with a value: signed at the top of a value, and only as long as it was equal.

    Args:
        top: whether these are the highest registers of a value.
        tied: for the least and for the most value, whether all above was equal.
        difference: the bound without the value.
    """

    def __init__(self, top: Value, tied: Signal, difference: Signal):
        self._top, self._tied, self._difference, self._equal = top, tied, difference, ~difference.any()

    def add_states(self, m: Module, host: PureInterface, most: list, fetch: list) -> None:
        """Add the states that compare.

        Args:
            m: the module.
            host: what the server asks for.
            most: assignments that ask for the most value, and fetch the least.
            fetch: assignments that fetch the most.
        """
        top, tied, difference = self._top, self._tied, self._difference
        with m.State("LEAST"):
            m.d.comb += most
            m.next = "ABOVE"
        with m.State("ABOVE"):
            m.d.comb += fetch
            m.d.sync += tied[0].eq((top | tied[0]) & self._equal)
            with m.If((top | tied[0]) & ~difference[-1] & ~self._equal):
                m.d.sync += host.outside.eq(1)
            m.next = "BELOW"
        with m.State("BELOW"):
            m.d.sync += tied[1].eq((top | tied[1]) & self._equal)
            with m.If((top | tied[1]) & difference[-1]):
                m.d.sync += host.outside.eq(1)
            m.next = "DONE"


def check_read(m: Module, file: Component, absent: Value, in_capture: Value) -> None:
    """Note what the check of a read has found; the capture memory can be read only when it is done."""
    with m.If(absent):
        m.d.sync += file.host.absent.eq(1)
    if file.design.registers.capture:
        with m.If(in_capture & ~file.capture_done):
            m.d.sync += file.host.refused.eq(1)
