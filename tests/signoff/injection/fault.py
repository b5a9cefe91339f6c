"""Faults: what goes wrong, what must come of it, and what came."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from hardwall.model.axis.supervisor import ARMED, DISARMED, ENABLED, TRIPPED

from .scene import CLOCK_HZ, OSCILLATOR_NS, PUSH_N, TREMOR_N

STATES = {DISARMED: "DISARMED", ARMED: "ARMED", TRIPPED: "TRIPPED"}


async def nothing(rig) -> None:
    """Repair nothing: the fault is over."""


class NotSteadyError(AssertionError):
    """The contact is not what a fault must find."""


@dataclass(frozen=True)
class Expected:
    """What a page promises of a fault.

    Attributes:
        causes: the causes that trip, all of them in one clock; none: the axis does not trip.
        state: the state in which it is then.
        within: the most clock edges until the drive is at most `down_n`; None: it need not be.
        down_n: see `within`.
        pins_within: the most clock edges until the last force at the pins; None for the stage's latency more than
            `within`.
        largest_n: the largest force from the fault on.
        steady: the force stays what it was.
        stopped: the clock stands still: the pins end the force without it, or the amplifier alone does.
    """

    causes: tuple[str, ...] = ()
    state: int = ARMED
    within: int | None = None
    down_n: float = 0.0
    pins_within: int | None = None
    largest_n: float = PUSH_N + TREMOR_N
    steady: bool = False
    stopped: bool = False

    @property
    def text(self) -> str:
        """What is expected, in words."""
        what = " + ".join(self.causes) or ("no clock" if self.stopped else STATES[self.state])
        parts = [what, "force as before" if self.steady else f"at most {self.largest_n:.1f} N"]
        if self.within is not None:
            goal = f"to {self.down_n:g} N " if self.down_n else ""
            parts.insert(1, f"{goal}within {self.within} clocks")
        return ", ".join(parts)


def trips(*causes: str, within: int, **more) -> Expected:
    """Return the expectation that these causes trip."""
    return Expected(causes, TRIPPED, within, **more)


UNCHANGED = Expected(steady=True)


@dataclass(frozen=True)
class Fault:
    """A fault in a steady contact.

    Attributes:
        name: what goes wrong.
        inject: makes it go wrong, and lasts for as long as the world does something about it.
        expected: what must come of it.
        repair: makes good what is not good by itself, before the host acknowledges and arms.
        observed_ms: how long the loop runs on afterwards.
        causes: causes that are enabled besides those that are after reset; `masked`: causes that are not.
        live, committed: words that the host has written before it arms.
        offset: the count at the mark.
        oscillator_ns: the period of the oscillator, in the time of the simulation.
        rearms: whether the axis can then be armed again.
        homed: whether the axis is homed before, and needs its reference to be armed: the fault takes it away.
        common: of several axes, all of them see the fault, and must come to the same.
    """

    name: str
    inject: Callable[..., Awaitable[None]]
    expected: Expected
    repair: Callable[..., Awaitable[None]] = nothing
    observed_ms: float = 3.0
    causes: int = 0
    masked: int = 0
    live: dict[str, int] = field(default_factory=dict)
    committed: dict[str, int] = field(default_factory=dict)
    offset: int = 0
    oscillator_ns: int = OSCILLATOR_NS
    rearms: bool = True
    homed: bool = False
    common: bool = False

    @property
    def words(self) -> dict[str, int]:
        """The live words, with the causes that are enabled."""
        causes = (ENABLED | self.causes) & ~self.masked
        return {"supervisor_causes": causes, "supervisor_reference": int(self.homed), **self.live}


@dataclass(frozen=True)
class Outcome:
    """What came of a fault.

    Attributes:
        name, expected: the fault's, the latter in words.
        came: the causes that were latched first, or the state.
        clocks: clock edges until the drive was down for good; None: it was not.
        largest_n, impulse_n_s: the largest force and the impulse, from the fault to the end of the observation.
        observed_ms: how long that was.
        wrong: what is not as promised.
    """

    name: str
    expected: str
    came: str
    clocks: int | None
    largest_n: float
    impulse_n_s: float
    observed_ms: float
    wrong: tuple[str, ...]

    @property
    def safe(self) -> bool:
        return not self.wrong

    @property
    def row(self) -> list[str]:
        """The outcome as a row of the table."""
        clocks, us = ("", "") if self.clocks is None else (str(self.clocks), f"{self.clocks * 1e6 / CLOCK_HZ:.2f}")
        figures = [f"{self.largest_n:.1f}", f"{self.impulse_n_s * 1e3:.4f}", f"{self.observed_ms:.0f}"]
        return [self.name, self.expected, self.came, clocks, us, *figures, "; ".join(self.wrong) or "safe"]
