"""Monitors and supervisor beside a supervised axis: from what the axis shows and the host asks, what must come out."""

from operator import attrgetter, itemgetter

from hardwall.hdl.axis.supervised import COMPLEMENTS, LOOPS, SHOWN
from hardwall.model.axis import monitors, supervisor
from hardwall.model.axis.supervised import FROM_AXIS, FROM_OUTSIDE, Design
from hardwall.model.axis.supervisor import CAUSES

SYNCHRONISER = 2
"""Clock edges from a change of a pin to the last edge that does not act on it."""
PINS = ("encoder_a", "encoder_b", *COMPLEMENTS, *LOOPS)
BITS = {cause.name: 1 << bit for bit, cause in enumerate(CAUSES)}
SHOWING = attrgetter(*SHOWN)
OTHERS = *FROM_AXIS, *FROM_OUTSIDE
WATCHED = "count", "stepped", "edge_kind", "edge_down", "indexed", "velocity", "saturated", "negative"
"""Inputs of the monitors that the axis shows by the same names."""
OWN = "strobe", "drive", "causes", "stamp", "enable", "referenced"
HEARD = tuple(name for name in supervisor.Inputs._fields if name not in OWN)
"""Inputs of the supervisor: those from the axis around it, and the host's."""


class Follower:
    """The models of monitors and supervisor, clock for clock.

    Args:
        design: the axis's.
        high: the pins that were high before the first edge.

    Attributes:
        supervisor: the supervisor's state.
        inverted: whether the sign of the drive's pins is to be reversed.
        reached: every cause that was latched so far.
    """

    def __init__(self, design: Design, high: tuple[str, ...] = ()):
        self._design = design
        self._monitors, self.supervisor = monitors.START, supervisor.START
        self._pins = [{name: int(name in high) for name in PINS}] * (SYNCHRONISER + 1)
        self.inverted = self.reached = self._encoder_inverted = 0
        self._asked = itemgetter(*(word.name for word in design.monitors.words), *design.ranges, *HEARD)
        self._last: tuple[int, ...] = ()

    def restart(self, given: dict[str, int]) -> None:
        """Advance by a clock edge under reset, which the synchronisers of the pins do not have."""
        self._pins = [*self._pins[1:], {name: given[name] for name in PINS}]
        self._monitors, self.supervisor = monitors.START, supervisor.START
        self.inverted = self._encoder_inverted = 0

    def wanted(self) -> dict[str, int]:
        """Return the outputs now, by name."""
        shown = dict(zip(SHOWN, SHOWING(self.supervisor), strict=True))
        own = {"drive_inverted": self.inverted, "a_channel_idle": self._monitors.a_channel_idle}
        return shown | own

    def level(self, pin: str) -> int:
        """Return the level of a pin as the axis sees it at the next edge."""
        return self._pins[1][pin]

    def _turns(self, given: dict[str, int]) -> bool:
        """Return whether a commit takes another direction."""
        return bool(given["commit"]) and given["encoder_invert"] != self._encoder_inverted

    def slip(self, given: dict[str, int]) -> int:
        """Return whether the axis loses its scale at the next edge by what is around it, with the inputs before it."""
        watched = self._monitors.causes & given["supervisor_causes"]
        found = any(watched & BITS[name] for name in ("encoder_loss", "index_spacing"))
        return int(given["slip"] or self._turns(given) or found)

    def edge(self, given: dict[str, int], shown: dict[str, int]) -> None:
        """Advance by a clock edge, with the inputs just before it, and what the axis shows then."""
        self._pins = [*self._pins[1:], {name: given[name] for name in PINS}]
        level = self._pins[0]
        if (asked := self._asked(given)) != self._last:
            self._last = asked
            self._take(given)
        seen = self._watched._replace(**{name: shown[name] for name in WATCHED}, **{
            "valid": shown["estimated"], "at_limit": self.supervisor.at_limit,
            "a": level["encoder_a"], "a_n": level["encoder_a_n"], "b": level["encoder_b"], "b_n": level["encoder_b_n"],
        })  # fmt: skip
        stands = {"encoder_illegal": shown["illegal"], "encoder_overspeed": shown["overspeed"]}
        stands["position_wrap"] = shown["wrapped"]
        stands |= {"strobe_busy": shown["strobe_busy"], "word_range": self._beyond}
        stands |= {"external_fault": not level["external_fault"], "emergency_stop": not level["emergency_stop"]}
        causes = self._monitors.causes | sum(BITS[name] for name in OTHERS if stands[name])
        heard = self._heard._replace(
            strobe=shown["sampled"], drive=shown["drive"], causes=causes, stamp=shown["stamp"],
            enable=level["drive_enable"], referenced=shown["referenced"],
        )  # fmt: skip
        if self._turns(given):
            self._encoder_inverted, heard = given["encoder_invert"], heard._replace(disarm=1)
        if self.supervisor.state != supervisor.ARMED:
            self.inverted = given["drive_invert"]
        self._monitors = monitors.step(self._design.monitors.params, self._monitors, seen)
        self.supervisor = supervisor.step(self._design.supervisor.params, self.supervisor, heard)
        self.reached |= self.supervisor.latched

    def _take(self, given: dict[str, int]) -> None:
        """Make what follows from the host's words alone, which few edges see changed."""
        self._watched = monitors.Inputs(**{word.name: given[word.name] for word in self._design.monitors.words})
        self._heard = supervisor.Inputs(**{name: given[name] for name in HEARD})
        ranges = self._design.ranges.items()
        self._beyond = any(not least <= given[name] <= most for name, (least, most) in ranges)
