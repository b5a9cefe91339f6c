"""The Kalman filter of edges in exact rationals, which the models of `edge-kalman` and `count-kalman` are held to."""

import math
from fractions import Fraction

from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.bursts import NOTHING, watch
from hardwall.model.estimators.edge_kalman_design import LEVELS, Design


class Oracle:
    """The module's equations in exact rationals, rounded as documented, on unwrapped positions."""

    def __init__(self, d: Design):
        self.d, self.known, self.bound = d, None, Fraction(0)
        self.watched = NOTHING

    @staticmethod
    def to(value: Fraction, f: int, add: Fraction = Fraction(0)) -> Fraction:
        """Return the value rounded down to an LSB, after a share of an LSB is added."""
        lsb = Fraction(2) ** -f
        return math.floor(value / lsb + add) * lsb

    def half_up(self, value: Fraction, f: int) -> Fraction:
        return self.to(value, f, Fraction(1, 2))

    @staticmethod
    def held(value: Fraction, fmt) -> Fraction:
        most = fmt.max * Fraction(2) ** -fmt.f
        return max(-most, min(most, value))

    def forget(self) -> None:
        self.x = self.z = self.v = self.a = Fraction(0)
        self.level = Fraction(LEVELS - 1)

    def turn(self, units: int) -> Fraction:
        d = self.d
        beyond = Fraction(2) ** d.motion.i
        return max(-beyond, min(beyond - Fraction(2) ** -d.motion.f, self.to(self.a * units, d.motion.f)))

    def entries(self, units: int, level: int) -> list[Fraction]:
        """Return the row's entries for a time in units: it has two rows an octave, from 2 and from 3 on."""
        length = units.bit_length()
        within = 2 * length + int(length > 1 and units >= 3 << (length - 2))
        row = self.d.table[level * (1 << self.d.row_bits) + within]
        return [int(word) * Fraction(2) ** -fmt.f for word, fmt in zip(row, self.d.columns, strict=True)]

    @property
    def fastest(self) -> Fraction:
        return self.d.velocity.max * Fraction(2) ** -self.d.velocity.f

    def limited(self, v: Fraction) -> Fraction:
        return max(-self.fastest, min(self.fastest, v))

    def step(self, row) -> tuple[Fraction, int, int]:
        d = self.d
        count, now, *stamps, edge, down, _, restart = row
        wide = 1 << d.time_bits
        at, now, number = (stamps[edge] >> d.unit) % wide, (now >> d.unit) % wide, count + down
        if self.known is None or restart:
            self.known, self.anchor, self.doubt = False, (number, at), 0
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
        bent = self.a * Fraction(d.clocks, 1 << d.unit) * Fraction(2) ** d.acceleration.f
        return self.half_up(line, d.velocity.f) * 2**d.velocity.f, math.floor(bent), flags

    def correct(self, passed: int, interval: int) -> int:
        d, e = self.d, self.d.error
        blend, alarm, fall, kx, *_ = self.entries(interval, math.floor(self.level + Fraction(1, 2)))
        turn = self.turn(interval)
        mean = self.to(self.v + turn / 2, d.motion.f)
        edges = max(-d.distance.max, min(d.distance.max, passed))
        far = self.to(Fraction(edges * d.clocks, 1 << d.unit), e.f) - self.half_up(mean * interval, e.f) - self.x
        r = self.held(far, e)
        self.z += self.to(blend * (r - self.z), e.f)
        alarmed = self.to(abs(self.z), d.columns[1].f) > alarm
        level = math.floor(self.level + Fraction(1, 2))
        self.level = Fraction(LEVELS - 1) if alarmed else max(self.level - fall, Fraction(0))
        *_, kx, kv, ka = self.entries(interval, LEVELS - 1 if alarmed else level)
        self.x = self.half_up(kx * r, e.f) - r
        fast = self.v + turn + self.half_up(kv * r, d.motion.f)
        self.v = self.limited(fast)
        self.a = self.held(self.a + self.half_up(ka * r, d.a.f), d.a)
        return int(edges != passed or r != far) | 2 * (self.v != fast)
