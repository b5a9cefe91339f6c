"""Stimuli for estimators that time edges: the edges of a wheel that turns at random, and known motions."""

import math
from collections.abc import Iterator
from random import Random
from typing import NamedTuple


class Edge(NamedTuple):
    """An edge: when it was decoded (clocks, unwrapped), its position (counts, unwrapped), and its direction."""

    at: int
    number: int
    down: int


class Strobe(NamedTuple):
    """A sample: its clock, whether it restarts the estimator, and the number of edges kept before it."""

    at: int
    restart: int
    edges: int


def turn(design, random: Random, samples: int, most: int | None = None) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges: steady and accelerated motions of all speeds, turns within a count, stops, pauses.

    A sample lasts any time that the design allows, and has fewer edges than `most`, half the counter's range or one
    edge a clock, whichever is least. Of its edges, the last four are returned: the others are before them in the same
    direction, and leave nothing in the decoder's outputs.
    """
    modulus, clocks = 1 << design.stamp_width, design.clocks
    most = min(clocks, (1 << (design.count_width - 1)) - 2, most or clocks)
    strobes, edges = [], []
    now, place, speed, bend, left = 0, 0.5, 0.0, 0.0, 0
    up = True
    for _ in range(samples):
        if left == 0:
            left = random.randrange(1, 60)
            # From one edge in many samples to one a clock.
            speed = random.choice([-1, 1]) * 10.0 ** random.uniform(-3.0, math.log10(most))
            bend = speed * random.choice([0.0, random.gauss(0.0, 0.2)])
            manner = random.random()
            if manner < 0.1:
                speed = bend = 0.0
        left -= 1
        span = clocks
        if manner < 0.15:  # pauses: the stamps wrap
            span = random.randrange(1, (modulus >> 2) + 1)
        speed = min(max(speed + bend, -most), most)
        aim = place + speed + (random.gauss(0.0, 1.0) if 0.1 <= manner < 0.25 else 0.0)
        aim = min(max(aim, place - most + 1), place + most - 1)
        passed = range(math.floor(place) + 1, math.floor(aim) + 1)
        if aim < place:
            passed = range(math.floor(place), math.floor(aim), -1)
        n = min(len(passed), span - 1)
        times = sorted(random.sample(range(now + 1, now + span), n))
        up = aim > place if n else up
        kept = zip(times[-4:], passed[max(n - 4, 0) : n], strict=True)
        edges += [Edge(at, number, int(not up)) for at, number in kept]
        if n < len(passed):
            aim = passed[n - 1] + (0.5 if up else -0.5) if n else place
        place = aim
        now += span
        strobes.append(Strobe(now, int(random.random() < 0.01), len(edges)))
    return strobes, edges


def run_length(edges: list[Edge]) -> int:
    """Return how many of the last edges have the same direction, at most 4."""
    run = 0
    for edge in reversed(edges[-4:]):
        if edge.down != edges[-1].down:
            break
        run += 1
    return run


def rows(design, strobes: list[Strobe], edges: list[Edge], invert: bool = False):
    """Yield the estimator's inputs at every strobe, in the order of its ports; inverted, the kinds go downwards."""
    modulus, half, way = 1 << design.stamp_width, 1 << (design.count_width - 1), -1 if invert else 1
    stamps, taken = [0, 0, 0, 0], 0
    for strobe in strobes:
        for edge in edges[taken : strobe.edges]:
            stamps[way * edge.number & 3] = edge.at % modulus
        taken = strobe.edges
        last = edges[taken - 1] if taken else Edge(0, 0, 0)
        count = (last.number - last.down + half) % (2 * half) - half
        run = run_length(edges[max(taken - 4, 0) : taken])
        yield count, strobe.at % modulus, *stamps, way * last.number & 3, last.down, run, strobe.restart


def anything(design, random: Random, samples: int):
    """Yield rows that no encoder gives: every input anywhere in its range, often at the ends of the range."""
    half, stamps = 1 << (design.count_width - 1), 1 << design.stamp_width
    count = stamp = 0
    for _ in range(samples):
        count += random.randrange(-half, half) if random.random() < 0.1 else random.randrange(-9, 10)
        stamp += random.randrange(1, stamps)
        ages = [random.getrandbits(random.randrange(1, design.stamp_width + 1)) for _ in range(4)]
        # Ages at the ends of their range, and ages with a single bit, which is all that tells them from 0.
        special = (*[1 << random.randrange(design.stamp_width)] * 4, 0, 1, stamps // 4 * 3, stamps - 1)
        ages = [age if random.random() < 0.85 else random.choice(special) for age in ages]
        kinds = [random.randrange(m) for m in (4, 2, 5)]
        yield (
            (count + half) % (2 * half) - half,
            stamp % stamps,
            *((stamp - age) % stamps for age in ages),
            *kinds,
            int(random.random() < 0.01),
        )


class Sight(NamedTuple):
    """The exact knowledge at a strobe, from all edges so far, unwrapped.

    Attributes:
        restart: whether all earlier samples are to be forgotten.
        count: the count, without wrap.
        down: the last edge's direction.
        ages: the ages in clocks, newest first, of the last edges in one direction, at most 4, that are known; empty if
            the last edge itself is not known.
        news: whether there were edges since the strobe before.
        cycle: (counts, clocks) over whole cycles up to the last edge, if all of their edges have one direction.
    """

    restart: bool
    count: int
    down: bool
    ages: list[int]
    news: bool
    cycle: tuple[int, int] | None


def sights(design, strobes: list[Strobe], edges: list[Edge]) -> Iterator[Sight]:
    """Yield the knowledge at every strobe: edges after a restart are known until 3/4 of the stamp's range old."""
    limit = 3 * (1 << design.stamp_width) // 4
    before, since = None, 0
    for strobe in strobes:
        restart = before is None or bool(strobe.restart)
        since = strobe.edges if restart else since
        last = edges[strobe.edges - 1] if strobe.edges else Edge(0, 0, 0)
        run = run_length(edges[max(strobe.edges - 4, 0) : strobe.edges])
        ages = [strobe.at - edge.at for edge in reversed(edges[max(strobe.edges - run, since) : strobe.edges])]
        ages = [age for age in ages if age < limit]
        news = before is not None and strobe.edges > before.edges
        cycle = _cycle(edges, before, strobe, run, since, limit) if news and ages else None
        yield Sight(restart, last.number - last.down, bool(last.down), ages, news, cycle)
        before = strobe


def _cycle(edges, before: Strobe, strobe: Strobe, run: int, since: int, limit: int) -> tuple[int, int] | None:
    last = edges[strobe.edges - 1]
    old = edges[max(before.edges - 4, 0) : before.edges]
    if not old or old[-1].down != last.down:
        return None
    forward = (last.number - old[-1].number) * (1 - 2 * last.down)
    if forward <= 0 or run < min(4, run_length(old) + forward):
        return None
    for edge in reversed(edges[max(since, before.edges - run_length(old)) : before.edges]):
        if (last.number - edge.number) % 4 == 0:
            return (abs(last.number - edge.number), last.at - edge.at) if before.at - edge.at < limit else None
    return None
