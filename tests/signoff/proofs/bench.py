"""The top of a proof: blocks whose inputs are free, what is assumed of these, and what is promised.

Everything is free that a proof does not bind: every input at every clock, and the reset too, so a promise that is
proven holds for every sequence of inputs and resets.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress

from amaranth.asserts import AnyConst, AnySeq
from amaranth.hdl import Assert, Assume, Cat, Elaboratable, Fragment, Module, ResetSignal, Shape, Signal, Value
from amaranth.lib import wiring

from .widths import FreeProducts, signals_of


class Bench(Elaboratable):
    """The top of a proof.

    Attributes:
        m: the module, for a proof's own registers; it is in the blocks' clock domain and has their reset.
        reset: that reset.
        inner: the signals inside the blocks, by `block`, and a dot before the name of each submodule on the way.
    """

    def __init__(self, describe: Callable[["Bench"], None]):
        self.m = Module()
        self.reset = Signal()
        self.inner: dict[str, Signal] = {}
        self._numbers: dict[str, int] = {}
        self.m.d.comb += self.reset.eq(ResetSignal())
        describe(self)

    def block(self, component: wiring.Component, freed: FreeProducts | None = None, **given: Value) -> wiring.Component:
        """Add a block and return it; its inputs are free but those that are given by name.

        Args:
            component: the block.
            freed: frees the block's products, and may look at its arithmetic; None to leave it as it is.
            given: values of inputs.
        """
        fragment = Fragment.get(component, None)
        self.inner |= signals_of(fragment)
        self.m.submodules[type(component).__name__.lower()] = fragment if freed is None else freed(fragment)
        for path, member, signal in component.signature.flatten(component):
            if member.flow is wiring.In:
                name = "__".join(map(str, path))
                self.m.d.comb += Value.cast(signal).eq(given[name] if name in given else self.free(signal.shape()))
        return component

    def free(self, shape: Shape | int = 1) -> Value:
        """Return a value that is free at every clock."""
        return AnySeq(shape)

    def constant(self, shape: Shape | int = 1) -> Value:
        """Return a value that is free, and the same at every clock."""
        return AnyConst(shape)

    def past(self, value: Value, clocks: int = 1, init: int = 0) -> Value:
        """Return a value of some clocks ago, across resets; `init` in the first clocks."""
        for _ in range(clocks):
            before = Signal(Value.cast(value).shape(), init=init, reset_less=True)
            self.m.d.sync += before.eq(value)
            value = before
        return value

    def assume(self, condition: Value) -> None:
        """Assume a condition at every clock."""
        self.m.d.comb += Assume(condition, src_loc_at=1)

    def promise(self, condition: Value) -> None:
        """Promise a condition at every clock."""
        self.m.d.comb += Assert(condition, src_loc_at=1)

    def state(self, *names: str) -> Value:
        """Return whether the block's machine is in one of the states of these names; promise that it is in any."""
        machine = self.inner["fsm_state"]
        if not self._numbers:
            for number in range(1 << len(machine)):
                with suppress(KeyError):
                    self._numbers[machine.decoder(number).partition("/")[0]] = number
            self.promise(machine < len(self._numbers))
        return Cat(machine == self._numbers[name] for name in names).any()

    def kept(self, values: Iterable[Value], keeps: Value) -> Value:
        """Return whether values are those of the last clock, if that was one of those that keep them."""
        same = Cat(value == self.past(value) for value in values).all()
        return ~self.past(keeps & ~self.reset) | same

    def within(self, **bounds: int | tuple[int, int]) -> None:
        """Promise the ranges of inner signals by name: from the negative of a bound to it, or a lower and an upper."""
        for name, bound in bounds.items():
            low, high = bound if isinstance(bound, tuple) else (-bound, bound)
            signal = self.inner[name]
            self.m.d.comb += Assert((signal >= low) & (signal <= high), src_loc_at=1)

    def falls(self, left: Value, most: int, free: Value, begins: Value, waits: Value | int = 0) -> None:
        """Promise that a block is free again after at most so many clocks in which nothing begins and it does not wait.

        Args:
            left: a number that falls at every such clock until it is 0, and does not rise at a clock at which it waits.
            most: the most that it can be.
            free: what holds when it is 0.
            begins: something begins at this clock, so that the number may rise; a reset is such, too.
            waits: the block waits for another one at this clock.
        """
        now = Signal(Value.cast(left).shape())
        self.m.d.comb += now.eq(left)
        before, waited = self.past(now), self.past(waits)
        fell = (now < before) | (before == 0) & (now == 0) | waited & (now <= before)
        self.promise(now <= most)
        self.promise(free | (now != 0))
        self.promise(fell | self.past(begins | self.reset, init=1))

    def elaborate(self, platform) -> Module:
        return self.m
