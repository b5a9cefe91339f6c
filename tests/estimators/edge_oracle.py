"""The Kalman filter of edges in exact rationals, which the models of `edge-kalman` and `count-kalman` are held to."""

import math
from fractions import Fraction
from functools import cache

from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.bursts import NOTHING, watch
from hardwall.model.estimators.count_kalman import Filter
from hardwall.model.estimators.edge_kalman_design import Design
from hardwall.model.estimators.edge_kalman_tables import GAIN_FORMATS, gain_words


def word(integer: int, f: int) -> Fraction:
    """Return the value of an integer whose LSB is 2**-f."""
    return Fraction(integer, 1 << f) if f >= 0 else Fraction(integer << -f)


class Oracle:
    """The module's equations in exact rationals, rounded as documented, on unwrapped positions."""

    def __init__(self, d: Design):
        self.d, self.known, self.bound = d, None, Fraction(0)
        self.watched, self.share, self.halvings = NOTHING, Fraction(7, 16), 0
        # The times of counts err in patterns, so that filter learns nothing.
        self.most = 0 if isinstance(d, Filter) else 7
        self.beyond, self.step_of_motion = Fraction(2) ** d.motion.i, word(1, d.motion.f)
        self.fastest = word(d.velocity.max, d.velocity.f)
        # Every row of the tables is taken many times.
        self.row, self.gains = cache(self.row), cache(self.gains)

    @staticmethod
    def to(value: Fraction, f: int, halves: int = 0) -> Fraction:
        """Return the value rounded down to an LSB, after some halves of an LSB are added."""
        doubled, unit = value.numerator << max(f + 1, 0), value.denominator << max(-f - 1, 0)
        return word((doubled + halves * unit) // (2 * unit), f)

    def half_up(self, value: Fraction, f: int) -> Fraction:
        return self.to(value, f, 1)

    @staticmethod
    def held(value: Fraction, fmt) -> Fraction:
        most = word(fmt.max, fmt.f)
        return max(-most, min(most, value))

    def forget(self) -> None:
        self.x = self.z = self.v = self.a = Fraction(0)
        self.memory = Fraction(0)

    def turn(self, units: int) -> Fraction:
        return max(-self.beyond, min(self.beyond - self.step_of_motion, self.to(self.a * units, self.d.motion.f)))

    @staticmethod
    def time(units: int) -> int:
        """Return the row of a time in units: there are two an octave, from 2 and from 3 on."""
        length = units.bit_length()
        return 2 * length + int(length > 1 and units >= 3 << (length - 2))

    def limits(self, time: int) -> list[Fraction]:
        """Return blend, alarm, usual |r|, quiet and agile memory for the error that was learned."""
        return self.row(self.halvings * (1 << self.d.row_bits) + time)

    def row(self, number: int) -> list[Fraction]:
        """Return a row of the table of limits."""
        row = self.d.limits[number]
        return [word(int(each), fmt.f) for each, fmt in zip(row, self.d.columns, strict=True)]

    def gains(self, memory: int, time: int) -> list[Fraction]:
        """Return the memory's growth over the time and K_x, K_v / K_x, K_a / K_v, for whole half octaves."""
        # The longest time is twice the memory, two half octaves more.
        row = gain_words()[2 * (memory - time + 2) + memory % 2]
        words = [word(int(each), fmt.f) for each, fmt in zip(row, GAIN_FORMATS, strict=True)]
        # Of a rate, 24 bits are kept, the first of which is a 1 before the point for the shortest memory.
        kept = 23 + self.d.shortest
        return words[:2] + [self.to(each / 2 ** (memory // 2), kept) for each in words[2:]]

    def limited(self, v: Fraction) -> Fraction:
        return max(-self.fastest, min(self.fastest, v))

    def step(self, row) -> tuple[Fraction, int, int]:
        d = self.d
        count, now, *stamps, edge, down, _, restart = row
        wide = 1 << d.time_bits
        at, now, number = (stamps[edge] >> d.unit) % wide, (now >> d.unit) % wide, count + down
        if self.known is None or restart:
            self.known, self.anchor, self.doubt = False, (number, at), 0
            self.share, self.halvings = Fraction(7, 16), 0
            self.forget()
        # The watch over bursts is held to lists of edges in its own test.
        self.watched, found = watch(d.bursts, self.watched, Seen(*row[: len(Seen._fields)]), restart)
        half, flags = 1 << (d.count_width - 1), 0
        passed = (number - self.anchor[0] + half) % (2 * half) - half
        interval = (at - self.anchor[1]) % wide
        self.doubt = max(self.doubt - 1, 0)
        if interval or passed:
            if not self.known or interval >= wide // 2:
                self.known, self.doubt = True, 0
                self.forget()
            else:
                before = self.v
                flags = self.correct(passed, interval)
                fastest = max(self.bound - abs(before), abs(before) / 2)
                if self.v * before >= 0 and abs(self.v) > fastest:
                    self.doubt = d.doubt
            self.anchor = number, at
        self.doubt = d.doubt if self.watched.jolt else self.doubt
        age = (now - self.anchor[1]) % wide
        straight = self.v + self.turn(age)
        line = self.limited(straight)
        far = line != straight
        # The usual error of an edge is 0.1 counts, so two are at most 1.5 counts apart.
        bound = Fraction(3 * d.clocks, 1 << d.unit) / 2 ** max(age.bit_length() - 1, 0)
        self.bound = min(self.to(bound, d.motion.f), 2 * self.fastest)
        rests = age >= wide // 2 or (not self.doubt and abs(line) >= 2 * self.bound)
        if not self.doubt:
            sign = -1 if self.v < 0 else 1
            line = sign * max(-abs(self.v), min(sign * line, max(self.bound - abs(self.v), 0)))
        flags |= 2 * (far and not rests) | found << 2
        if rests:
            x, self.known = self.x, self.known and age < wide // 2
            self.forget()
            self.x, line = x, Fraction(0)
        bent = self.a * Fraction(d.clocks, 1 << d.unit) / word(1, d.acceleration.f)
        return self.half_up(line, d.velocity.f) * 2**d.velocity.f, math.floor(bent), flags

    def correct(self, passed: int, interval: int) -> int:
        d, e, time = self.d, self.d.error, self.time(interval)
        turn = self.turn(interval)
        mean = self.to(self.v + turn / 2, d.motion.f)
        edges = max(-d.distance.max, min(d.distance.max, passed))
        far = self.to(Fraction(edges * d.clocks, 1 << d.unit), e.f) - self.half_up(mean * interval, e.f) - self.x
        r = self.held(far, e)
        memory = self.remember(r, time, passed)
        _, kx, kv, ka = self.gains(memory, time)
        nearer = self.half_up(kx * r, e.f)
        self.x = nearer - r
        far_faster = self.half_up(kv * nearer, d.motion.f)
        # A correction has a bit more of range than a velocity.
        faster = max(-self.beyond, min(self.beyond - self.step_of_motion, far_faster))
        fast = self.v + turn + faster
        self.v = self.limited(fast)
        self.a = self.held(self.a + self.half_up(ka * faster, d.a.f), d.a)
        return int(edges != passed or r != far) | 2 * (self.v != fast or faster != far_faster)

    def size(self, value: Fraction) -> Fraction:
        """Return the magnitude of a word of the error, less an LSB if it is negative."""
        return value if value >= 0 else -value - word(1, self.d.error.f)

    def remember(self, r: Fraction, time: int, passed: int) -> int:
        """Change the mean, the memory and what is learned by an innovation; return the half octaves of the gains."""
        d, e = self.d, self.d.error
        blend, alarm, usual, quiet, agile = self.limits(time)
        before = max(self.memory, agile)
        grow, *_ = self.gains(math.floor(before + Fraction(1, 2)), time)
        self.z += self.half_up(blend * (r - self.z), e.f)
        alarmed = self.to(self.size(self.z), d.columns[1].f) > alarm
        self.memory = agile if alarmed else min(before + grow, quiet)
        used = math.floor((agile if alarmed else before) + Fraction(1, 2))
        if not passed:  # its own error is in the innovation twice
            return used
        large = int(self.to(self.size(r), d.columns[2].f) > usual)
        self.share += self.half_up((large - self.share) / 128, 12)
        change = int(self.share < Fraction(5, 32)) - int(self.share > Fraction(5, 8))
        if change and 0 <= self.halvings + change <= self.most:
            self.share, self.halvings = Fraction(7, 16), self.halvings + change
        return used
