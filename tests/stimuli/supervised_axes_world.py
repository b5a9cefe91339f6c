"""The world of supervised axes: a handle, loops and whims of a host for each, and one port and one beat for all."""

import random as plain

from hardwall.hdl.axis.supervised import COMPLEMENTS, LOOPS
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.supervised import Design
from hardwall.model.axis.supervisor import TRIPPED, WATCHDOG_MS
from hardwall.model.estimators import levant

from .specs import NARROW
from .supervised_world import STROBES, World

RATE_HZ = 1_000
"""Samples a second: so few that a heartbeat is overdue after some hundred clocks."""
FIELDS = {
    **NARROW, "sample_hz": RATE_HZ, "actuation_hz": RATE_HZ // 2, "speed_max_m_per_s": 1e-3,
    "damping_max_n_s_per_m": 200e3,
}  # fmt: skip
AS_SLOW = levant.Gains(1.0, 2.0)
"""Levant's gains that samples so far apart allow; the axis's own are beyond."""
BITS = "encoder_a", "encoder_b", "encoder_z", *COMPLEMENTS, *LOOPS, *STROBES
"""Inputs of one bit for each axis."""
SILENT_CLOCKS_PER_MS = 80
ASKS = 4
"""Of so many axes, on average, the host may want something else in a clock: it writes one word a clock."""


def slow(axes: int, estimator: str, spare: int = 0) -> AxesSpec:
    """Return narrow axes with that many clocks of a rota to spare, and so slow a clock that a host is soon overdue."""
    made = {**FIELDS, "axes": axes, "estimator": estimator, "gains": {"levant": AS_SLOW}.get(estimator)}
    slots = AxesSpec(**{**made, "clock_hz": 1_000_000}).slots
    return AxesSpec(**{**made, "clock_hz": RATE_HZ * (slots + spare)})


class Lane(World):
    """What is around one of the axes; its host writes through the one port of the device."""

    def __init__(self, design: Design, seed: int):
        super().__init__(design, seed)
        self.formats[design.watchdog.word.name] = design.watchdog.word.format
        self.round, self.spins, self.longest = 1 << design.spec.count_width, 0, 0

    def act_of(self, state: int, latched: int, asks: float) -> dict[str, int]:
        """Return the inputs of a clock; words beyond their ranges stay until the host takes its usual ones."""
        random = self.random
        self.clock += 1
        # As fast as a clock can count, for a rota of few clocks.
        self.speed = random.choice((-1.0, 1.0)) if random.random() < 0.001 else self.speed
        self._spin()
        now = {**self.inputs, **dict.fromkeys(STROBES, 0), **self._pins()}
        for name in LOOPS:
            self.inputs[name] ^= int(random.random() < (0.0004 if self.inputs[name] else 0.02))
        if state == TRIPPED and random.random() < 0.02:
            self._settle()
        if random.random() < 0.0005:
            self.inputs |= self._near_an_end()
        if random.random() < 0.0004:
            # The handle is within a count of where it may be, so that every bit of a limit decides.
            limit = random.choice(("supervisor_position_low", "supervisor_position_high"))
            near, half = int(self.position // 1) + random.randint(-1, 1), self.round // 2
            self.inputs[limit] = (near + half) % self.round - half
        if self.spins and random.random() < 0.05:
            return now | {"commit": 1}
        return now | (self._awaited(state, latched) or (self._asked() if random.random() < asks else {}))

    def _spin(self) -> None:
        """Let the handle go round, too fast to be estimated, at times for as long as that may be.

        A count goes round with it: what follows is as near to the limits as before.
        """
        random, name = self.random, "supervisor_saturated"
        if not self.spins and random.random() < 0.0002:
            self.longest = random.getrandbits(self.formats[name].width) >> random.randrange(4)
            self.spins = (self.longest + 8) * self.design.spec.clocks_per_sample
        if self.spins:
            self.spins -= 1
            # A filter would see no edges; and a host that takes its usual words again leaves this one.
            self.inputs |= {"encoder_glitch_clocks": 0, name: self.longest}
            self.speed, self.reach = 0.5, self.round
            self.position = (self.position + self.round / 2) % self.round - self.round / 2


class AxesWorld:
    """What is around all axes.

    Args:
        design: that of the axes.
        seed: of everything random.
    """

    def __init__(self, design: Design, seed: int):
        self.random, self.design = plain.Random(seed), design
        axes = design.spec.axes
        self.lanes = [Lane(design, seed + axis) for axis in range(axes)]
        self.numbers = {word.name: number for number, word in enumerate(design.words)}
        self.written = [{word.name: word.reset for word in design.words} for _ in range(axes)]
        self.heartbeat = self.silent = self.shifting = self.shift = 0
        self.turn = design.spec.clocks_per_sample + design.latency
        self.place = 0

    def act(self, states: list[tuple[int, int]], ready: int) -> dict[str, int]:
        """Return the inputs of a clock.

        Args:
            states: for every axis the state of its supervisor and the latched causes.
            ready: whether words can be written.
        """
        random, lanes = self.random, self.lanes
        asks = min(1.0, ASKS / len(lanes))
        acts = [lane.act_of(*state, asks) for lane, state in zip(lanes, states, strict=True)]
        given = {name: sum(act[name] << axis for axis, act in enumerate(acts)) for name in BITS}
        pulses = {"preload_count": ("origin_shift", "preload"), "acknowledged": ("acknowledge",)}
        for name, those in pulses.items():
            asked = [act[name] for pulse in those for act in acts if act[pulse]]
            given[name] = asked[0] if asked else random.choice(acts)[name]
        # What an origin is shifted by stays until every axis has had its turn; another shift waits for that.
        self.shifting -= self.shifting > 0
        if self.shifting:
            given |= {"origin_shift": 0, "preload_count": self.shift}
        elif given["origin_shift"]:
            self.shifting, self.shift = self.turn, given["preload_count"]
        if random.random() < 0.0005:
            self.silent = random.randrange(SILENT_CLOCKS_PER_MS * WATCHDOG_MS[0])
        self.silent -= self.silent > 0
        if not self.silent and random.random() < 0.02:
            self.heartbeat = random.randrange(1 << 16)
        watchdog = random.choice((0, 49, 2001, 2047)) if random.random() < 0.0002 else WATCHDOG_MS[0]
        return given | {"heartbeat": self.heartbeat, "supervisor_watchdog": watchdog, **self._writing(ready)}

    def restart(self) -> None:
        """Take it that the words are as after a reset."""
        self.written = [{word.name: word.reset for word in self.design.words} for _ in self.lanes]

    def _writing(self, ready: int) -> dict[str, int]:
        """Return what is written: the next word of the next axis that is not yet as it should be, or anything."""
        random, lanes = self.random, self.lanes
        for _ in lanes:
            self.place = (self.place + 1) % len(lanes)
            written, wanted = self.written[self.place], self.lanes[self.place].inputs
            name = next((name for name, word in written.items() if wanted.get(name, word) != word), "")
            if name and random.random() < 0.9:
                if ready:
                    written[name] = wanted[name]
                return self._port(self.place, name, wanted[name])
        if random.random() < 0.01:
            # This word is not the host's to write.
            return self._port(random.randrange(len(lanes)), "output_force_limit", random.randrange(100))
        return {"word_write": 0, "word_axis": 0, "word_number": 0, "word_value": 0}

    def _port(self, axis: int, name: str, word: int) -> dict[str, int]:
        return {"word_write": 1, "word_axis": axis, "word_number": self.numbers[name], "word_value": word}
