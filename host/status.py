"""The status of a board: the state of its axis, and the causes of a trip."""

from dataclasses import dataclass
from enum import IntEnum

from ..model.axis import output, supervisor
from ..model.axis.design import ENCODER_FLAGS
from ..model.axis.supervisor import CAUSES, COUNT_BITS


class State(IntEnum):
    """The state of the supervisor."""

    DISARMED = supervisor.DISARMED
    ARMED = supervisor.ARMED
    TRIPPED = supervisor.TRIPPED


@dataclass(frozen=True)
class Trip:
    """The causes that are latched since the last acknowledgement, all of one moment.

    Attributes:
        latched: the word of the causes.
        causes: the names of the latched causes; first: the names of the causes of the last trip.
        counts: how often every cause has come since the board's reset, at most 15, by name.
    """

    latched: int
    causes: tuple[str, ...]
    first: tuple[str, ...]
    counts: dict[str, int]

    def __str__(self) -> str:
        said = {cause.name: cause.doc for cause in CAUSES}
        others = ", ".join(name for name in self.causes if name not in self.first)
        began = "; ".join(f"{name}: {said[name]}" for name in self.first or self.causes)
        return f"{began} (then {others})" if self.first and others else began


@dataclass(frozen=True)
class Status:
    """The status of an axis. All values are of one clock, except the causes: they are read at most 1000 clocks later.

    Attributes:
        state: the state of the supervisor.
        position_m, velocity_m_per_s: the handle's, estimated at the last sample.
        acceleration_m_per_s2: the handle's, estimated at the last sample; None if the board's estimator has none.
        wall_force_n: the wall's force on the handle at the last sample.
        force_n: the force that is let out.
        stamp_s: the time of the clock, which wraps behind the largest value of the register `stamp`.
        live: whether the heartbeat is not overdue; ready: whether the axis can be armed.
        referenced: whether the origin was shifted since the index was found, and the scale has not slipped.
        flags: names of the sticky flags; the estimator's own are `estimator_0` and so on.
        a_channel_idle: the warning that the last edges were all of one channel.
        trip: the causes that are latched; None if none is.
    """

    state: State
    position_m: float
    velocity_m_per_s: float
    acceleration_m_per_s2: float | None
    wall_force_n: float
    force_n: float
    stamp_s: float
    live: bool
    ready: bool
    referenced: bool
    flags: tuple[str, ...]
    a_channel_idle: bool
    trip: Trip | None


def status_of(words: dict[str, int], si: dict[str, float], flag_bits: int) -> Status:
    """Return the status from the words of registers and their SI values, both by name; `flag_bits` is the number of
    bits of `flags`."""
    return Status(
        State(words["state"]),
        si["count"],
        si["velocity"],
        si.get("acceleration"),
        si["wall_force"],
        si["driven"],
        si["stamp"],
        bool(words["live"]),
        bool(words["ready"]),
        bool(words["referenced"]),
        tuple(name for bit, name in enumerate(flag_names(flag_bits)) if words["flags"] >> bit & 1),
        bool(words["a_channel_idle"]),
        _trip(words) if words["latched"] else None,
    )


def flag_names(bits: int) -> tuple[str, ...]:
    """Return the names of so many sticky flags, bit 0 first: the encoder's, the estimator's, and the output's."""
    between = bits - len(ENCODER_FLAGS) - len(output.FLAGS)
    return (*ENCODER_FLAGS, *(f"estimator_{number}" for number in range(between)), *output.FLAGS)


def _trip(words: dict[str, int]) -> Trip:
    counts = words["counts_0"] | words["counts_1"] << 32
    most = (1 << COUNT_BITS) - 1
    return Trip(
        words["latched"],
        tuple(supervisor.names(words["latched"])),
        tuple(supervisor.names(words["first"])),
        {cause.name: counts >> COUNT_BITS * bit & most for bit, cause in enumerate(CAUSES)},
    )
