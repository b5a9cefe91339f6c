"""The world of a supervised axis: a handle that moves at random, loops that open, and a host that looks before it acts.

Every word comes to all of its values, every cause is there again and again, and the host is overdue and comes back.
"""

import random as plain

from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axis.supervised import FIXED, Design
from hardwall.model.axis.supervisor import ALL, ARMED, DISARMED, TRIPPED, WATCHDOG_MS

STROBES = (
    "commit", "arm", "disarm", "acknowledge", "index_arm", "preload", "origin_shift", "clear_flags", "slip",
)  # fmt: skip
QUARTERS = ((0, 0), (1, 0), (1, 1), (0, 1))
ACTS = (
    "", "disarm", "commit", "committed", "live", "settle", "index_arm", "preload", "acknowledge", "origin_shift",
    "slip",
)  # fmt: skip
CHANCES = (0.9814, 0.0005, 0.002, 0.003, 0.0045, 0.0035, 0.002, 0.0013, 0.0002, 0.0015, 0.0002)
"""What a host does beside bringing the axis to ARMED, and the chance of each in a clock."""
FILTERS = (0, 0, 1, 2, 5, 15, 15)


class World:
    """What is around the axis.

    Args:
        design: the axis's.
        seed: of everything random.
    """

    def __init__(self, design: Design, seed: int):
        self.random, self.design = plain.Random(seed), design
        self.position, self.speed, self.reach = 0.0, 0.0, 5
        self.formats = {word.name: word.format for word in design.words if word.name not in FIXED}
        self.committed = [word.name for word in design.committed]
        self.live = [word.name for word in design.live]
        words = {word.name: word.reset for word in design.words}
        self.usual = {name: words[name] for name in self.live}
        # A stiff wall at the handle's place.
        self.wall = {name: words[name] for name in self.committed}
        self.wall |= {"wall_stiffness": self.formats["wall_stiffness"].max, "wall_position": -1}
        # Thresholds that the motion comes to, a limit that is there at once, and a host that is soon overdue.
        self.usual |= {"supervisor_causes": ALL, "supervisor_ramp": design.supervisor.ramp.max}
        self.usual |= {"supervisor_saturated": 1, "supervisor_watchdog": WATCHDOG_MS[0]}
        self.usual |= {"supervisor_turn": 4, "supervisor_index_tolerance": 1, "supervisor_runaway": 0}
        self.inputs = {**self.usual, **self.wall, **dict.fromkeys(LOOPS, 1)}
        self.inputs |= dict.fromkeys(("heartbeat", "preload_count", "acknowledged"), 0)
        # Clocks for which a channel equals its complement, the host is silent, and edges come too many at a time.
        self.dead = self.silent = self.flips = 0
        self.channel = "b"
        self.flipping = self.flipped = 0
        self.clock = 0

    def act(self, state: int, latched: int, live: int) -> dict[str, int]:
        """Return the inputs of a clock; the words of the host change from the next one on.

        Args:
            state, latched, live: the supervisor's outputs.
        """
        random = self.random
        self.clock += 1
        now = {**self.inputs, **dict.fromkeys(STROBES, 0), **self._pins()}
        for name in LOOPS:
            opens = 0 if self.silent else 0.0004
            self.inputs[name] ^= int(random.random() < (opens if self.inputs[name] else 0.02))
        if self.silent:
            # The host is overdue, and nothing else goes wrong meanwhile.
            self.silent = self.silent - 1 if live or state == TRIPPED else 0
            return now | self._awaited(state, latched)
        if state == ARMED and random.random() < 0.003:
            self.silent = 700
            self._settle()
        if random.random() < 0.01:
            self.inputs["heartbeat"] = random.randrange(1 << 16)
        if random.random() < (0.1 if state == TRIPPED else 0.0005):
            now |= self._near_an_end()
        return now | (self._awaited(state, latched) or self._asked())

    def _pins(self) -> dict[str, int]:
        random = self.random
        if random.random() < 0.002:
            self.speed = random.choice((0.0, 0.005, 0.01, 0.02, 0.02, 0.05, 0.2, 0.5, 1.0)) * random.choice((-1, 1))
            self.reach = 13 if random.random() < 0.2 else 5
        if abs(self.position) >= self.reach:
            self.speed = -abs(self.speed) if self.position > 0 else abs(self.speed)
        self.position += self.speed + (2 if random.random() < 0.0002 else 0)
        quarter = int(self.position // 1) % 4
        a, b = QUARTERS[quarter]
        if self.silent:
            self.speed = 0.0
        # One channel that dithers, or both at once, at the pace that the filter passes.
        if not self.flips and not self.silent and random.random() < 0.0003:
            self.flips, self.flipping = random.choice(((120, 1), (120, 2), (300, 3)))
        if self.flips:
            self.speed = 0.0
            if self.clock % (2 + self.inputs["encoder_glitch_clocks"]) == 0:
                self.flips, self.flipped = self.flips - 1, self.flipped ^ self.flipping
        else:
            self.flipped = 0
        a, b = a ^ self.flipped & 1, b ^ self.flipped >> 1
        if random.random() < 0.0005:
            self.dead, self.channel = random.randrange(60), random.choice("ab")
        self.dead -= self.dead > 0
        pins = {"encoder_a": a, "encoder_a_n": 1 - a, "encoder_b": b, "encoder_b_n": 1 - b}
        pins[f"encoder_{self.channel}_n"] ^= int(self.dead > 0)
        return pins | {"encoder_z": int(quarter == 2)}

    def _awaited(self, state: int, latched: int) -> dict[str, int]:
        """Return what brings the axis back to ARMED, if the host does it in this clock."""
        random = self.random
        if random.random() >= 0.03:
            return {}
        if state == TRIPPED:
            clear = int(not self.flips and random.random() < 0.8)
            half = 1 << self.design.spec.count_width - 1
            count = (int(self.position // 1) + half) % (2 * half) - half
            home = {"preload": 1, "preload_count": count} if random.random() < 0.5 else {}
            return {"acknowledge": 1, "acknowledged": latched, "clear_flags": clear, **home}
        return {"arm": int(state == DISARMED)}

    def _asked(self) -> dict[str, int]:
        """Return what else the host asks for, or choose a word."""
        random, half = self.random, 1 << self.design.spec.count_width - 1
        act = random.choices(ACTS, CHANCES)[0]
        if act == "settle":
            self._settle()
            return {"commit": 1}
        if act in ("committed", "live"):
            self._choose(random.choice(self.committed if act == "committed" else self.live))
        elif act in ("preload", "origin_shift"):
            far = half if act == "preload" or random.random() < 0.2 else 2
            return {act: 1, "preload_count": random.randrange(-far, far)}
        elif act == "acknowledge":
            return {"acknowledge": 1, "acknowledged": random.randrange(ALL + 1)}
        elif act:
            return {act: 1}
        return {}

    def _settle(self) -> None:
        """Take the usual words, and mostly the usual wall."""
        self.inputs |= {**self.usual, "supervisor_runaway": self.random.choice((0, 0, 0, 8))}
        if self.random.random() < 0.8:
            self.inputs |= {**self.wall, "encoder_glitch_clocks": self.random.choice(FILTERS)}

    def _choose(self, name: str) -> None:
        """Choose any value that a word may have, of every size."""
        random, kind = self.random, self.formats[name]
        least, most = self.design.ranges.get(name, (kind.min, kind.max))
        size = random.choice((0, random.randrange(kind.width)))
        word = max(random.randint(least, most) >> size, least)
        self.inputs[name] = random.choice(FILTERS) if name == "encoder_glitch_clocks" else word

    def _near_an_end(self) -> dict[str, int]:
        """Return a live word at an end of its range, beside it, or unlike these in one bit."""
        random, (name, ends) = self.random, self.random.choice(list(self.design.ranges.items()))
        kind, end = self.formats[name], random.choice(ends) + random.randint(-1, 1)
        return {name: (end ^ random.choice((0, 1, 1, 1)) << random.randrange(kind.width)) & kind.max}
