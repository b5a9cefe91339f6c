"""Monitors, supervisors and doors of axes: from what the axes show and the host asks, what must come out."""

from collections import defaultdict

from hardwall.hdl.axis.supervised import COMPLEMENTS, LOOPS
from hardwall.model.arithmetic.fixed import wrap
from hardwall.model.axes import supervised as supervised_axes
from hardwall.model.axes.axis import FRONT_LATENCY
from hardwall.model.axes.monitors import Inputs
from hardwall.model.axes.supervised import LOOK, SAMPLE_WORDS, Design, Turn
from hardwall.model.axis import watchdog
from hardwall.model.axis.monitors import BITS
from hardwall.model.axis.supervised import FIXED, SLIPS
from hardwall.model.axis.supervisor import ARMED

from .supervised import SYNCHRONISER

PINS = ("encoder_a", "encoder_b", *COMPLEMENTS, *LOOPS)
FAULT = BITS["external_fault"]
TURN = "state", "ready", "latched", "first", "first_stamp", "counts"
WATCHED = "encoder_illegal", "encoder_overspeed", "position_wrap", *LOOPS[1:]
"""Causes that wait for a turn in a bit of their own."""


class Follower:
    """The models of all axes' monitors and supervisors, and what acts between their turns.

    Args:
        design: that of the axes.

    Attributes:
        states: for every axis its `supervised_axes.State`.
        reached: every cause that was latched so far.
        slips: the axes that lost their scale at the last edge by what is around them.
    """

    def __init__(self, design: Design):
        self._design, spec = design, design.spec
        self._rota, self._axes, self._all = spec.clocks_per_sample, spec.axes, (1 << spec.axes) - 1
        self._end, self._sampled = spec.latency, FRONT_LATENCY + spec.pipeline.latency
        self._pins = [dict.fromkeys(PINS, 0)] * SYNCHRONISER
        self._looked_at = {word.name for word in design.live} - set(SAMPLE_WORDS)
        self._own = tuple(word.name for word in design.supervisor.words if word.name in Turn._fields)
        self.reached = 0
        self.restart(dict.fromkeys(PINS, 0))

    def restart(self, given: dict[str, int]) -> None:
        """Advance by a clock edge under reset, which the synchronisers of the pins do not have."""
        self._pins = [*self._pins[1:], {name: given[name] for name in PINS}]
        self._clock, self._watchdog = 0, watchdog.START
        self.states = [supervised_axes.START] * self._axes
        self._words = [{word.name: word.reset for word in self._design.words} for _ in range(self._axes)]
        self._passes: dict[tuple[int, int], dict] = defaultdict(dict)
        self._waiting: dict[str, int] = defaultdict(int)
        self._index, self._acknowledged, self._inverted = [0] * self._axes, 0, 0
        self._indexed = self._preloaded = self._shifted = self.slips = self._found = 0
        self._doors = {"magnitude": [0] * self._axes, "negative": 0, "armed": 0, "alive": 0, "drive_inverted": 0}
        self._turn: dict[str, int] = {"turn_valid": 0}

    def wanted(self) -> dict[str, int]:
        """Return the outputs now, by name; those of a turn only with one."""
        width = self._design.supervisor.limit.width
        magnitude = sum(word << width * axis for axis, word in enumerate(self._doors["magnitude"]))
        own = {"live": self._watchdog.live, "magnitude": magnitude}
        return {**self._doors, **own, **self._turn}

    def _at(self, stage: int) -> tuple[int, dict] | None:
        """Return the axis that is in a stage, and its pass."""
        axis, begun = (self._clock - stage) % self._rota, self._clock - stage
        return (axis, self._passes[axis, begun // self._rota]) if begun >= 0 and axis < self._axes else None

    def edge(self, given: dict[str, int], shown: dict[str, int]) -> None:
        """Advance by a clock edge, with the inputs just before it, and what the axes show then."""
        levels, self._pins = self._pins[0], [*self._pins[1:], {name: given[name] for name in PINS}]
        self._sample(given, shown)
        self._look(given, levels, shown)
        self._found = 0
        if at := self._at(self._end):
            at[1]["live"] = self._watchdog.live
        if at := self._at(self._end + 1):
            self._judge(*at, shown)
        self._let_out(levels)
        self._wait(given, levels, shown)
        self._write(given, shown)
        if given["acknowledge"]:
            self._acknowledged = given["acknowledged"]
        beat = watchdog.Inputs(given["heartbeat"], given["supervisor_watchdog"])
        self._watchdog = watchdog.step(self._design.watchdog.params, self._watchdog, beat)
        self._clock += 1

    def _sample(self, given: dict[str, int], shown: dict[str, int]) -> None:
        """Take what belongs to a sample: index and preload with its strobe, then its words, and what was made of it."""
        strobed = 0
        if at := self._at(0):
            axis, now = at
            strobed = 1 << axis
            now["fresh"] = int(self._preloaded >> axis & 1 or self._clock < self._rota)
            now["shifted"] = self._shifted >> axis & 1
            now["indexed"], now["index_count"] = self._indexed >> axis & 1, self._index[axis]
        self._preloaded = given["preload"] | (self._preloaded & ~strobed)
        self._shifted = given["origin_shift"] | (self._shifted & ~strobed)
        moved = given["preload"] | given["origin_shift"]
        self._indexed = (shown["indexed"] | (self._indexed & ~strobed)) & ~moved
        width = self._design.spec.count_width
        for axis in range(self._axes):
            if shown["indexed"] >> axis & 1:
                # The edge that found it has counted away from it.
                back = 1 if shown["edge_down"] >> axis & 1 else -1
                self._index[axis] = wrap((shown["count"] >> width * axis) + back, width)
        if at := self._at(self._sampled - 1):
            at[1].update({name: self._words[at[0]][name] for name in SAMPLE_WORDS})
        if at := self._at(self._sampled):
            at[1].update({name: shown[name] for name in ("velocity", "saturated")}, count=shown["estimated_count"])
        if at := self._at(self._sampled + 1):
            at[1]["shift"] = given["preload_count"]

    def _look(self, given: dict[str, int], levels: dict[str, int], shown: dict[str, int]) -> None:
        """Take what waits for the turn of the axis that is in the stage of the look, and its words."""
        if at := self._at(self._end - LOOK):
            axis, now = at
            now["waited"] = {name: bits >> axis & 1 for name, bits in self._waiting.items()}
            now["waited"]["referenced"] = shown["referenced"] >> axis & 1
            now["acknowledged"] = self._acknowledged
            now.update({name: self._words[axis][name] for name in self._looked_at})
        if at := self._at(self._end - LOOK + 1):
            words = {**at[1], "supervisor_watchdog": given["supervisor_watchdog"]}
            ranges = self._design.ranges.items()
            at[1]["beyond"] = any(not least <= words[name] <= most for name, (least, most) in ranges)

    def _judge(self, axis: int, now: dict, shown: dict[str, int]) -> None:
        """Take the turn of an axis."""
        waited = now["waited"]
        first = self._clock < self._rota + self._end + 1
        seen = {name: now[name] for name in Inputs._fields if name in now}
        for channel in "ab":
            seen[f"lost_{channel}"] = int(not waited.get(f"unlike_{channel}", 0) and not first)
            seen[f"edge_{channel}"] = waited[f"edge_{channel}"]
        causes = sum(1 << BITS[name] for name in WATCHED if waited[name]) | now["beyond"] << BITS["word_range"]
        turn = Turn(
            seen=Inputs(**seen), drive=shown["record_drive"], causes=causes, stamp=shown["stamp"], live=now["live"],
            enable=1 - waited["drive_enable"], acknowledged=now["acknowledged"], drive_invert=now["drive_invert"],
            **{name: waited[name] for name in ("referenced", "arm", "disarm", "acknowledge")},
            **{name: now[name] for name in self._own},
        )  # fmt: skip
        before = self.states[axis]
        self.states[axis] = supervised_axes.step(self._design.params, before, turn)
        after = self.states[axis].supervisor
        watched = self.states[axis].monitors.causes & now["supervisor_causes"]
        self._found = int(any(watched >> bit & 1 for bit in SLIPS)) << axis
        now["drives"] = int(before.supervisor.state == after.state == ARMED)
        self.reached |= after.latched

    def _shut(self, levels: dict[str, int]) -> tuple[dict[str, int], int]:
        """Return the loops that are open now, and the axes whose doors are shut."""
        watches = sum((words["supervisor_causes"] >> FAULT & 1) << axis for axis, words in enumerate(self._words))
        opened = {name: ~levels[name] & self._all for name in LOOPS}
        opened["external_fault"] &= watches
        shut = 0
        for name in LOOPS:
            shut |= opened[name] | self._waiting[name]
        return opened, shut

    def _let_out(self, levels: dict[str, int]) -> None:
        """Open or shut the doors."""
        doors, (_, shut) = self._doors, self._shut(levels)
        armed = doors["armed"]
        self._turn = {"turn_valid": 0}
        if at := self._at(self._end + 2):
            axis, bit = at[0], 1 << at[0]
            after = self.states[axis]
            doors["magnitude"][axis] = after.supervisor.magnitude
            doors["negative"] = doors["negative"] & ~bit | after.supervisor.negative << axis
            doors["drive_inverted"] = doors["drive_inverted"] & ~bit | after.drive_inverted << axis
            armed = armed & ~bit | at[1]["drives"] << axis
            shown = {f"turn_{name}": getattr(after.supervisor, name) for name in TURN}
            self._turn = {"turn_valid": 1, "turn_axis": axis, **shown}
            self._turn["turn_a_channel_idle"] = after.monitors.a_channel_idle
            del self._passes[axis, (self._clock - self._end - 2) // self._rota]
        doors["armed"] = armed & ~shut
        doors["alive"] = doors["armed"] if self._watchdog.wave else 0
        doors["negative"] &= ~shut
        doors["magnitude"] = [0 if shut >> axis & 1 else word for axis, word in enumerate(doors["magnitude"])]

    def _wait(self, given: dict[str, int], levels: dict[str, int], shown: dict[str, int]) -> None:
        """Let what happens wait for the next look, and forget what has been looked at."""
        at = self._at(self._end - LOOK)
        kept = self._all & ~(1 << at[0]) if at else self._all
        pending, written = shown["commit_pending"], 0
        for axis, words in enumerate(self._words):
            written |= words["encoder_invert"] << axis
        turned, self._inverted = pending & (written ^ self._inverted), pending & written | ~pending & self._inverted
        self.slips = given["slip"] | turned | self._found
        kinds = sum((shown["edge_kind"] >> 2 * axis & 1) << axis for axis in range(self._axes))
        happens = {
            **self._shut(levels)[0],
            "encoder_illegal": shown["illegal"], "encoder_overspeed": shown["overspeed"],
            "position_wrap": shown["wrapped"],
            "unlike_a": levels["encoder_a"] ^ levels["encoder_a_n"],
            "unlike_b": levels["encoder_b"] ^ levels["encoder_b_n"],
            "edge_a": shown["stepped"] & ~kinds, "edge_b": shown["stepped"] & kinds,
            "arm": given["arm"], "disarm": given["disarm"] | turned,
        }  # fmt: skip
        for name, bits in happens.items():
            self._waiting[name] = bits | self._waiting[name] & kept
        # A later acknowledgement makes void those that wait.
        self._waiting["acknowledge"] = given["acknowledge"] or self._waiting["acknowledge"] & kept

    def _write(self, given: dict[str, int], shown: dict[str, int]) -> None:
        """Write what the host writes, if it may."""
        name = self._design.words[given["word_number"]].name
        if given["word_write"] and shown["word_ready"] and name not in FIXED:
            self._words[given["word_axis"]][name] = given["word_value"]
