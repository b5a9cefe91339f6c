"""The closed loop around the board under test: its clock, its plant step by step, its host, and what is measured."""

import sys
from collections.abc import Callable

import cocotb
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import FallingEdge, Timer, ValueChange

from hardwall.hdl.supervised import LOOPS
from hardwall.model.supervisor import ARMED, names

from .damaged import INSIDE, LIVE
from .handle import Grasped
from .scene import (
    CLOCK_HZ,
    CLOCK_NS,
    CLOCKS_PER_MS,
    DAMPING_N_S_PER_M,
    DEPTH,
    FULL_SCALE_N,
    PUSH_N,
    REGISTERS,
    REST,
    SPEC,
    START,
    STEP_CLOCKS,
    STIFFNESS_N_PER_M,
    words,
)
from .serial_host import SerialHost

RESET_CLOCKS, SETTLING_MS = 100, 1.0
"""The reset lasts until the oscillator has seen that the clock runs."""
PULSE_N = FULL_SCALE_N / STEP_CLOCKS
"""The mean force over a step of one pulse in it."""
STEADY_N, STEADY_M_PER_S = 0.3, 2e-3
"""How far force and speed of a steady contact are from the hand's push and from rest, at most."""
PUMP_CLOCKS = CLOCKS_PER_MS // 5
"""The time, 200 us, after which a charge pump without an edge of `alive` has run down: 2.5 of its periods."""


class NotSteadyError(AssertionError):
    """The contact is not what a fault must find."""


class Rig:
    """The board in its loop, with the clock as the time.

    Attributes:
        handle: the plant.
        host: the host.
        swapped: whether the wires of the motor are swapped.
        on_count: called with the count of every edge of the encoder, when its wires change.
        began: the clock after whose edge the fault is there; before_n: the drive of that clock.
        turns: clocks and words of every change of the drive that is let out.
        wrong: what the fault itself has found to be wrong.
        stuck_n: the largest force without a clock.
    """

    def __init__(self, dut):
        self.dut = dut
        self.handle = Grasped()
        self.swapped = False
        self.on_count: Callable[[int], None] = lambda number: None
        self.began, self.before_n = 0, 0.0
        self.turns: list[tuple[int, int]] = []
        self.wrong: list[str] = []
        self.stuck_n = self._stuck_n_s = self._drive_n = 0.0
        self._stuck: int | None = None
        self._stopped: list[Clock] = []
        self._number = START
        self._alive_at = self._fell_at = self._pulses = self._pulses_before = 0
        self._tasks: list = []

    @property
    def now(self) -> int:
        """The number of the last clock edge; between edges, where every pin changes."""
        return int(get_sim_time("ns")) // CLOCK_NS

    def see(self, name: str) -> int:
        """Return a watched port."""
        value = getattr(self.dut, name).value
        return value.to_signed() if name in ("driven", "count", "pulses") else int(value)

    def sees(self, state: int) -> bool:
        """Return whether the supervisor is in a state."""
        return self.see("state") == state

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
        for name in LOOPS:
            getattr(dut, name).value = 1
        for name in (*LIVE, *INSIDE):
            getattr(dut, f"upset_{name}").value = 0
        dut.uart_rx.value = dut.rst.value = 1
        self.wire()
        if clocks is None:
            self.clock = Clock(dut.clk, CLOCK_NS, "ns", impl="gpi")
            self.clock.start()
            await Timer(CLOCK_NS // 2, "ns")
        else:
            self.clock, before = clocks
            before.stop()
        self.oscillator = Clock(dut.oscillator, oscillator_ns, "ns", impl="gpi")
        self.oscillator.start()
        await Timer(RESET_CLOCKS * CLOCK_NS, "ns")
        dut.rst.value = 0
        await Timer(RESET_CLOCKS * CLOCK_NS, "ns")
        self._pulses = self.see("pulses")
        self.host = SerialHost(dut)
        self._tasks = [cocotb.start_soon(each) for each in (self._turn(), self._watch_drive(), self._watch_alive())]
        return self.clock, self.oscillator

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

    async def _watch_alive(self) -> None:
        change = ValueChange(self.dut.alive)
        while True:
            await change
            self._alive_at = self.now

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
        """Return the amplifier's force by the last step's pulses; without a clock, by the level of the pin."""
        if self._stuck is None:
            pulses = self.see("pulses")
            given = (pulses - self._pulses) * PULSE_N
            self._pulses = pulses
            return given
        # The pin is at one level until it falls, and acts only as long as the pump lasts.
        ends = min(self.now, self._fell_at, self._alive_at + PUMP_CLOCKS)
        given = (1 - 2 * self.see("drive_sign")) * max(ends - self._stuck, 0) * PULSE_N
        self._stuck_n_s += given * STEP_CLOCKS / CLOCK_HZ
        if given:
            self._stuck, self.stuck_n = ends, FULL_SCALE_N
        return given

    async def _watch_pin(self) -> None:
        await FallingEdge(self.dut.drive_pdm)
        self._fell_at = self.now + 1

    def stop_clock(self) -> None:
        """Stop the board's clock; from now on the amplifier looks at `alive`, and its drive is the level of the pin."""
        self._stuck = self._fell_at = self.now
        if self.see("drive_pdm"):
            self._fell_at = sys.maxsize
            self._tasks.append(cocotb.start_soon(self._watch_pin()))
        self._stop(self.clock)

    def stop_oscillator(self) -> None:
        """Stop the clock that watches the board's."""
        self._stop(self.oscillator)

    def _stop(self, clock: Clock) -> None:
        self._stopped.append(clock)
        clock.stop()

    async def start_clocks(self) -> None:
        """Let what was stopped go on, and count pulses again."""
        while self._stopped:
            await Timer(CLOCK_NS // 2, "ns")
            self._stopped.pop().start()
            await Timer(CLOCK_NS // 2, "ns")
        self._stuck, self._pulses = None, self.see("pulses")

    @property
    def stuck_clocks(self) -> int:
        """Clocks from the fault to the end of the force of an amplifier without a clock."""
        return self._stuck - self.began

    def begin(self) -> None:
        """Take it that the fault is there from now on."""
        self.began, self.before_n, self._pulses_before = self.now, self.driven_n, self.see("pulses")

    @property
    def impulse_n_s(self) -> float:
        """The impulse that the pins have asked for since the fault."""
        return (self.see("pulses") - self._pulses_before) * PULSE_N * STEP_CLOCKS / CLOCK_HZ + self._stuck_n_s

    @property
    def last_pulse(self) -> int:
        """The clock edge that has seen the last pulse at the pin."""
        return self.now + 1 - self.see("now") + self.see("last_pulse")

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

    async def contact(self, live: dict[str, int], committed: dict[str, int], offset: int = 0) -> None:
        """Arm the axis and let go of the handle, in the wall and at rest; with `offset` the count at the mark.

        Raises:
            NotSteadyError: if force or speed is not that of a steady contact.
        """
        host, handle = self.host, self.handle
        wall = words(
            wall_stiffness=STIFFNESS_N_PER_M,
            wall_damping=DAMPING_N_S_PER_M,
            wall_position=(REST - START + offset - DEPTH) * SPEC.count_m,
        )
        await host.write(supervisor_ramp=REGISTERS["supervisor_ramp"].high, **live)
        await host.commit(**wall, **committed)
        await self.run(0.02)
        if offset:
            await host.write(preload=1)
        handle.held = REST
        await self.until(lambda: handle.number == REST, 2, "the handle is in the wall")
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
