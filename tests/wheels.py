"""Edges of a wheel that turns at random: rows for the estimators that time them, and the speeds they promise."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np


@dataclass(frozen=True)
class Edge:
    """When it was decoded (clocks, without wrap), where it stands (counts, without wrap), its kind and direction."""

    at: int
    number: int
    kind: int
    down: int


@dataclass(frozen=True)
class Strobe:
    """A sample: when, whether it restarts, and how many edges came before it."""

    at: int
    restart: int
    edges: int


def turn(design, random: np.random.Generator, samples: int, invert: bool = False) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges: steady and bent motions of all speeds, turns within a count, bursts, stops, pauses.

    A sample lasts any time that the design allows, and has no more edges than half the counter's range.
    """
    modulus, clocks = 1 << design.stamp_width, design.clocks
    most = min(clocks, (1 << (design.count_width - 1)) - 2)
    strobes, edges = [], []
    now, place, speed, bend, left = 0, 0.5, 0.0, 0.0, 0
    up = True
    for _ in range(samples):
        if left == 0:
            left = int(random.integers(1, 60))
            # From one edge in many samples to one a clock.
            speed = float(random.choice([-1, 1])) * 10.0 ** random.uniform(-3.0, np.log10(most))
            bend = speed * random.choice([0.0, random.normal(0.0, 0.2)])
            manner = random.random()
            if manner < 0.1:
                speed = bend = 0.0
        left -= 1
        span = clocks
        if manner < 0.15:  # pauses: the stamps wrap
            span = int(random.integers(1, (modulus >> 2) + 1))
        speed = min(max(speed + bend, -most), most)
        aim = place + speed + (random.normal(0.0, 1.0) if 0.1 <= manner < 0.25 else 0.0)
        aim = min(max(aim, place - most + 1), place + most - 1)
        passed = range(int(np.floor(place)) + 1, int(np.floor(aim)) + 1)
        if aim < place:
            passed = range(int(np.floor(place)), int(np.floor(aim)), -1)
        n = min(len(passed), span - 1)
        times = now + 1 + np.sort(random.choice(span - 1, n, replace=False)) if n else []
        for at, number in zip(times, passed[:n], strict=True):
            up = aim > place
            kind = -number if invert else number
            edges.append(Edge(int(at), number, kind & 3, int(not up)))
        if n < len(passed):
            aim = passed[n - 1] + (0.5 if up else -0.5) if n else place
        place = aim
        now += span
        strobes.append(Strobe(now, int(random.random() < 0.01), len(edges)))
    return strobes, edges


def run_length(edges: list[Edge]) -> int:
    """Return how many of the last edges went the same way, at most 4."""
    run = 0
    for edge in reversed(edges[-4:]):
        if edge.down != edges[-1].down:
            break
        run += 1
    return run


def rows(design, strobes: list[Strobe], edges: list[Edge]):
    """Yield what an estimator gets, as its inputs are listed."""
    modulus, half = 1 << design.stamp_width, 1 << (design.count_width - 1)
    stamps, taken = [0, 0, 0, 0], 0
    for strobe in strobes:
        for edge in edges[taken : strobe.edges]:
            stamps[edge.kind] = edge.at % modulus
        taken = strobe.edges
        last = edges[taken - 1] if taken else Edge(0, 0, 0, 0)
        count = (last.number - last.down + half) % (2 * half) - half
        run = run_length(edges[max(taken - 4, 0) : taken])
        yield count, strobe.at % modulus, *stamps, last.kind, last.down, run, strobe.restart


def speeds(design, strobes: list[Strobe], edges: list[Edge]):
    """Yield (speed, direction) that `period` promises at each strobe, exact, from every edge there was, unwrapped."""
    limit = Fraction(3, 4) * (1 << design.stamp_width)
    before, since, speed = None, None, Fraction(0)
    for k, strobe in enumerate(strobes):
        if k == 0 or strobe.restart:
            since = strobe.edges  # edges before are forgotten
        seen = edges[: strobe.edges] if strobe.edges < 40 else edges[strobe.edges - 40 : strobe.edges]
        dropped = strobe.edges - len(seen)
        known = [e for i, e in enumerate(seen) if i + dropped >= since and strobe.at - e.at < limit]
        if not known or known[-1] is not seen[-1]:
            speed, before = Fraction(0), strobe
            yield speed, bool(seen and seen[-1].down)
            continue
        last, run = seen[-1], run_length(seen)
        mine = [e for e in seen[-run:] if e in known]
        if strobe.edges > before.edges:
            speed = Fraction(0)
            if len(mine) >= 2:
                speed = Fraction(1, mine[-1].at - mine[-2].at)
            if cycle := last_cycle(edges, before, strobe, run, since, limit):
                speed = cycle
        bounds = [Fraction(3, 2) / (strobe.at - last.at)]
        if len(mine) == 4:
            bounds.append(Fraction(4, strobe.at - mine[0].at))
        before = strobe
        yield min(speed, *bounds), bool(last.down)


def last_cycle(edges, before: Strobe, strobe: Strobe, run: int, since: int, limit: Fraction) -> Fraction | None:
    """Return the speed over whole cycles up to the last edge, if all of them went one way."""
    last = edges[strobe.edges - 1]
    old = edges[max(before.edges - 4, 0) : before.edges]
    if not old or old[-1].down != last.down:
        return None
    forward = abs(last.number - old[-1].number)
    if (last.number - old[-1].number) * (1 - 2 * last.down) <= 0 or run < min(4, run_length(old) + forward):
        return None
    first = max(since, before.edges - run_length(old))
    for edge in reversed(edges[first : before.edges]):
        if edge.kind == last.kind:
            return Fraction(abs(last.number - edge.number), last.at - edge.at) if before.at - edge.at < limit else None
    return None
