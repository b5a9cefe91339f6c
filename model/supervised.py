"""An axis with its supervisor: every run-time word, and what the words of the axis alone are then fixed to."""

from . import monitors, supervisor
from .spec import AxisSpec
from .supervisor import CAUSES

FIXED = ("output_force_limit",)
"""Words of the axis that no host writes: the supervisor's force limit holds at once, and after everything."""
FROM_AXIS = ("encoder_illegal", "encoder_overspeed", "strobe_busy")
FROM_OUTSIDE = ("word_range", "external_fault", "emergency_stop")
"""Causes that the axis shows, and causes that pins and the host's registers show; the others are the monitors'."""


class Design:
    """The designs of an axis's parts, and all their run-time words.

    Attributes:
        spec: the axis.
        monitors, supervisor: the designs of the blocks beside it.
        committed: words that take effect together, at a sample after a commit.
        live: words that act at the next clock.
    """

    def __init__(self, spec: AxisSpec):
        self.spec = spec
        self.monitors = monitors.Design(spec, spec.design.estimator.velocity)
        self.supervisor = supervisor.Design(spec)
        self.committed = tuple(word for word in spec.design.words if word.name not in FIXED)
        self.live = (*self.supervisor.words, *self.monitors.words)

    @property
    def words(self):
        """Every word that a host writes."""
        return (*self.committed, *self.live)


assert {*FROM_AXIS, *FROM_OUTSIDE, *monitors.MADE, "link_timeout"} == {cause.name for cause in CAUSES}
