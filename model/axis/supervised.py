"""An axis with its supervisor: every run-time word, and what the words of the axis alone are then fixed to."""

from collections.abc import Sequence

from ..arithmetic.fixed import UQ
from ..register import VALUE_BITS, Kind, Register, word_register
from ..spec import AxisSpec
from ..words import Word, ranges_of
from . import monitors, supervisor
from .designed import DesignedAxis
from .supervisor import BEAT_BITS, CAUSES, COUNT, COUNT_BITS

FIXED = ("output_force_limit",)
"""Words of the axis that no host writes: the supervisor's force limit holds at once, and after everything."""
FROM_AXIS = ("encoder_illegal", "encoder_overspeed", "position_wrap", "strobe_busy")
FROM_OUTSIDE = ("word_range", "external_fault", "emergency_stop")
"""Causes that come from the axis, and causes that come from live words and pins. The monitors show the others, and with
the axis position_wrap."""


SLIPS = monitors.ENCODER_LOSS, monitors.INDEX_SPACING
"""Causes that mean a lost scale: an axis that watches them loses its reference."""


class Design:
    """The designs of an axis's parts, and all their run-time words.

    Attributes:
        spec: the axis.
        monitors, supervisor: the designs of the blocks beside it.
        committed: words that take effect together, at a sample after a commit.
        live: words that act at the next clock.
        ranges: the least and the largest of the live words that may not have every value of their formats.
    """

    def __init__(self, spec: AxisSpec):
        self.spec = spec
        self.monitors = monitors.Design(spec, spec.design.estimator)
        self.supervisor = supervisor.Design(spec)
        self.committed = tuple(word for word in spec.design.words if word.name not in FIXED)
        doc = "1: the sign of the drive's pins is reversed; taken in every state but ARMED"
        invert = Word("drive_invert", UQ(1, 0), 1.0, "", int(spec.stage.inverted), doc)
        self.live = (*self.supervisor.words, *self.monitors.words, invert)
        self.ranges = ranges_of(self.live)

    @property
    def words(self) -> tuple[Word, ...]:
        """Every word that a host writes."""
        return (*self.committed, *self.live)

    def registers(self) -> tuple[Register, ...]:
        """Return the host's registers of the supervisor and the monitors, status and pulses."""
        return registers_of(self.spec, self.live)


def registers_of(spec: DesignedAxis, live: Sequence[Word]) -> tuple[Register, ...]:
    """Return the host's registers of an axis's supervisor and monitors, status and pulses.

    Args:
        spec: the axis, alone or one of several.
        live: its words that need no commit.
    """
    causes = ", ".join(f"bit {bit} {cause.name}" for bit, cause in enumerate(CAUSES))
    per_value = VALUE_BITS // COUNT_BITS
    status = [
        ("state", UQ(2, 0), "The state of the supervisor: 0 DISARMED, 1 ARMED, 2 TRIPPED."),
        ("live", UQ(1, 0), "The host's heartbeat is not overdue."),
        ("ready", UQ(1, 0), "The axis can be armed."),
        ("referenced", UQ(1, 0), "The origin was shifted since the index was latched, and the scale has not slipped."),
        ("latched", UQ(COUNT, 0), f"The causes since the last acknowledgement: {causes}."),
        ("first", UQ(COUNT, 0), "The causes of the clock that led to the last trip."),
        ("a_channel_idle", UQ(1, 0), "A warning: the last edges were all of one channel."),
        *(
            (
                f"counts_{first // per_value}",
                UQ(COUNT_BITS * min(per_value, COUNT - first), 0),
                f"The occurrences of {min(per_value, COUNT - first)} causes, from bit {first} on.",
            )
            for first in range(0, COUNT, per_value)
        ),
    ]
    pulses = [
        ("arm", "The axis is armed; refused unless ready."),
        ("disarm", "The axis is disarmed."),
        ("acknowledge", "The causes in acknowledged are acknowledged, if they are those latched."),
    ]
    second = 1 / spec.clock_hz
    return (
        *(Register(name, Kind.STATUS, fmt, meaning) for name, fmt, meaning in status),
        Register("first_stamp", Kind.STATUS, UQ(spec.stamp_width, 0), "The number of that clock.", second, "s"),
        Register("driven", Kind.STATUS, spec.force, "The drive that is let out.", spec.force_resolution_n, "N"),
        *(Register(name, Kind.PULSE, UQ(1, 0), meaning) for name, meaning in pulses),
        Register("heartbeat", Kind.LIVE, UQ(BEAT_BITS, 0), "A word that the host changes again and again."),
        Register("acknowledged", Kind.LIVE, UQ(COUNT, 0), "The causes that the host has read."),
        *(word_register(word, Kind.LIVE) for word in live),
    )
