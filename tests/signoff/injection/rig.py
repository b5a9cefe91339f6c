"""The closed loop around the board under test: its clock, its plant step by step, its host, and what is measured."""

from collections.abc import Callable

import cocotb
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import Timer, ValueChange

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axis.supervisor import ARMED, names

from .fault import NotSteadyError
from .handle import Grasped
from .scene import (
    CLOCK_HZ,
    CLOCK_NS,
    CLOCKS_PER_MS,
    DAMPING_N_S_PER_M,
    PUSH_N,
    REGISTERS,
    REST,
    SOFTER_N_PER_M,
    SPEC,
    START,
    STEP_CLOCKS,
    STIFFNESS_N_PER_M,
    depth,
    words,
)
from .serial_host import SerialHost
from .staged import Staged

RESET_CLOCKS, SETTLING_MS = 100, 1.0
"""The reset lasts until the oscillator has seen that the clock runs."""
TICK_NS = CLOCK_NS - 2
"""Ticks come behind every change of a pin and before the next clock edge; the tick before an edge has its number."""
STEADY_N, STEADY_M_PER_S = 0.3, 2e-3
"""How far force and speed of a steady contact are from the hand's push and from rest, at most."""


class Rig:
    """The board in its loop, with the clock as the time; of several axes, one of them in its loop.

    Attributes:
        stage: the board's drive stage.
        axis: the number of the axis.
        handle: the plant.
        host: the host.
        swapped: whether the wires of the motor are swapped.
        on_count: called with the count of every edge of the encoder, when its wires change.
        began: the clock after whose edge the fault is there; before_n: the drive of that clock.
        turns: clocks and words of every change of the drive that is let out.
        wrong: what the fault itself has found to be wrong.
        beside: the loops of the other axes.
        largest_n: the largest force of the amplifier while it keeps one: of a DAC, or without a clock.
    """

    def __init__(self, dut, stage: Staged, axis: int = 0):
        self.dut, self.stage, self.axis = dut, stage, axis
        self.handle = Grasped()
        self.swapped = False
        self.on_count: Callable[[int], None] = lambda number: None
        self.began, self.before_n = 0, 0.0
        self.turns: list[tuple[int, int]] = []
        self.wrong: list[str] = []
        self.beside: tuple[Rig, ...] = ()
        self.largest_n = self._drive_n = 0.0
        self._stopped: list[Clock] = []
        self._number = START
        self._given = self._given_before = 0
        self._tasks: list = []

    @property
    def now(self) -> int:
        """The number of the last clock edge; between edges, where every pin changes."""
        return int(get_sim_time("ns")) // CLOCK_NS

    def see(self, name: str) -> int:
        """Return a watched port."""
        value = getattr(self.dut, name).value
        return value.to_signed() if name in ("driven", "count", "steps", "given") else int(value)

    def sees(self, state: int) -> bool:
        """Return whether the supervisor is in a state."""
        return self.see("state") == state

    @property
    def _all(self) -> tuple["Rig", ...]:
        return (self, *self.beside)

    @property
    def driven_n(self) -> float:
        return self.see("driven") * SPEC.force_resolution_n

    async def start(self, clocks: tuple[Clock, Clock] | None, oscillator_ns: int) -> tuple[Clock, Clock]:
        """Reset the board, with everything else well; return the clock and the oscillator, for the next rig too.

        Args:
            clocks: those of the last rig; None for the first one.
            oscillator_ns: the period of the oscillator, which begins anew.
        """
        dut = self.dut
        self.pins(**dict.fromkeys(LOOPS, 1), **{f"upset_{name}": 0 for name in self.stage.upsets})
        dut.uart_rx.value = dut.rst.value = 1
        for rig in self._all:
            rig.wire()
        if clocks is None:
            self.clock = Clock(dut.clk, CLOCK_NS, "ns", impl="gpi")
            self.clock.start()
            await Timer(TICK_NS, "ns")
            Clock(dut.tick, CLOCK_NS, "ns", impl="gpi").start()
            await Timer(CLOCK_NS + CLOCK_NS // 2 - TICK_NS, "ns")
        else:
            self.clock, before = clocks
            before.stop()
        self.oscillator = Clock(dut.oscillator, oscillator_ns, "ns", impl="gpi")
        self.oscillator.start()
        await Timer(RESET_CLOCKS * CLOCK_NS, "ns")
        dut.rst.value = 0
        await Timer(RESET_CLOCKS * CLOCK_NS, "ns")
        self.host = SerialHost(dut, self.stage.registers)
        for rig in self._all:
            rig._go(self)
        return self.clock, self.oscillator

    def _go(self, first: "Rig") -> None:
        """Close the loop; the device is that of the rig of its first axis."""
        if self is not first:
            self.clock, self.oscillator, self._stopped = first.clock, first.oscillator, first._stopped
            self.host = SerialHost(self.dut, self.stage.registers, self.axis, first.host)
        self._given = self.see("given")
        self._tasks = [cocotb.start_soon(each) for each in (self._turn(), self._watch_drive())]

    def close(self) -> None:
        """End the loop."""
        self.host.close()
        for task in self._tasks:
            task.cancel()

    def pins(self, **levels: int) -> None:
        """Set pins of the board."""
        for name, level in levels.items():
            getattr(self.dut, name).value = level

    def wire(self) -> None:
        """Let the board see the wires of the encoder as they are now."""
        self.pins(**self.handle.levels(self._number))

    async def _watch_drive(self) -> None:
        change = ValueChange(self.dut.driven)
        while True:
            await change
            self.turns.append((self.now, self.see("driven")))

    async def _turn(self) -> None:
        """Close the loop, step by step."""
        while True:
            passed = 0
            for clock, number in self.handle.step(-self._drive_n if self.swapped else self._drive_n):
                if clock - 1 > passed:
                    await Timer((clock - 1 - passed) * CLOCK_NS, "ns")
                    passed = clock - 1
                self._number = number
                self.wire()
                self.on_count(number)
            await Timer((STEP_CLOCKS - passed) * CLOCK_NS, "ns")
            self._drive_n = self._given_n()

    def _given_n(self) -> float:
        """Return the amplifier's mean force over the last step."""
        given = self.see("given")
        mean_n = (given - self._given) * self.stage.step_n / STEP_CLOCKS
        self._given = given
        self._keep()
        return mean_n

    def _keep(self) -> None:
        """Take part of the largest force, where the amplifier keeps what it has now."""
        if self.stage.has_codes or self.clock in self._stopped:
            self.largest_n = max(self.largest_n, abs(self.see("steps")) * self.stage.step_n)

    def stop_clock(self) -> None:
        """Stop the board's clock."""
        self._stop(self.clock)
        for rig in self._all:
            rig._keep()

    def stop_oscillator(self) -> None:
        """Stop the clock that watches the board's."""
        self._stop(self.oscillator)

    def _stop(self, clock: Clock) -> None:
        self._stopped.append(clock)
        clock.stop()

    async def start_clocks(self) -> None:
        """Let what was stopped go on."""
        while self._stopped:
            await Timer(CLOCK_NS // 2, "ns")
            self._stopped.pop().start()
            await Timer(CLOCK_NS // 2, "ns")

    @property
    def given_clocks(self) -> int:
        """Clocks from the fault to the end of the amplifier's force."""
        return max(self._edge("last_given") + 1 - self.began, 0)

    def begin(self) -> None:
        """Take it that the fault is there from now on."""
        for rig in self._all:
            rig._begin()

    def _begin(self) -> None:
        self.began, self.before_n, self._given_before = self.now, self.driven_n, self.see("given")
        self.largest_n = 0.0
        self._keep()

    @property
    def impulse_n_s(self) -> float:
        """The impulse of the amplifier since the fault."""
        return (self.see("given") - self._given_before) * self.stage.step_n / CLOCK_HZ

    @property
    def last_asked(self) -> int:
        """The clock edge that has seen the last force at the pins."""
        return self._edge("last_asked")

    def _edge(self, name: str) -> int:
        """Return the clock edge of a tick."""
        return self.now + 1 - self.see("ticks") + self.see(name)

    async def acting(self, moment: str) -> None:
        """Wait for the next such moment of the stage."""
        for acts in (False, True):
            await self.until(lambda acts=acts: self.acts is acts, 1, f"it is {moment}", clocks=1)
        if clocks := self.stage.moments[moment]:
            await self.run(clocks / CLOCKS_PER_MS)

    @property
    def acts(self) -> bool:
        """Whether the stage acts."""
        name, level = self.stage.acts
        return self.see(name) == level

    def claim(self, right: bool, otherwise: str) -> None:
        """Keep what is wrong, unless it is right."""
        if not right:
            self.wrong.append(otherwise)

    async def run(self, milliseconds: float) -> None:
        """Let the loop run."""
        await Timer(round(milliseconds * CLOCKS_PER_MS) * CLOCK_NS, "ns")

    async def until(
        self, reached: Callable[[], bool], milliseconds: float, what: str, clocks: int = STEP_CLOCKS
    ) -> None:
        """Let the loop run until something is so, which is looked at after every so many clocks.

        Raises:
            NotSteadyError: if it does not come in time.
        """
        last = self.now + milliseconds * CLOCKS_PER_MS
        while not reached():
            if self.now > last:
                raise NotSteadyError(f"after {milliseconds} ms it is not so that {what}")
            await Timer(clocks * CLOCK_NS, "ns")

    async def contact(
        self, live: dict[str, int], committed: dict[str, int], offset: int = 0, homed: bool = False
    ) -> None:
        """Arm the axis and let go of the handle, in the wall and at rest; with `offset` the count at the mark.

        If it is to be homed, the handle passes its index, and the origin stays where it is.

        Raises:
            NotSteadyError: if force or speed is not that of a steady contact.
        """
        host, handle, stiffness_n_per_m = self.host, self.handle, STIFFNESS_N_PER_M - SOFTER_N_PER_M * self.axis
        wall = words(
            wall_stiffness=stiffness_n_per_m,
            wall_damping=DAMPING_N_S_PER_M,
            wall_position=(REST - START + offset - depth(stiffness_n_per_m)) * SPEC.count_m,
        )
        await host.write(supervisor_ramp=REGISTERS["supervisor_ramp"].high, **live)
        await host.commit(**wall, **committed)
        await self.run(0.02)
        if offset:
            await host.write(preload=1)
        if homed:
            await host.write(index_arm=1)
        handle.held = REST
        await self.until(lambda: handle.number == REST, 2, "the handle is in the wall")
        if homed:
            await host.write(origin_shift=1)
        # No estimate of that motion is left.
        await self.run(SETTLING_MS)
        await host.heartbeat()
        await host.acknowledge(self.see("latched"))
        await host.arm()
        await self.until(lambda: abs(self.driven_n + PUSH_N) < STEADY_N, 2, "the wall holds the handle")
        handle.held = None
        await self.run(SETTLING_MS)
        steady = abs(self.driven_n + PUSH_N) < STEADY_N and abs(handle.speed_m_per_s) < STEADY_M_PER_S
        if not self.sees(ARMED) or not steady:
            found = f"{self.driven_n:.3f} N at {handle.speed_m_per_s:.4f} m/s, {names(self.see('latched'))}"
            raise NotSteadyError(f"the contact is not steady: {found}")
