"""Stimuli for estimators that time edges: the edges of a wheel that turns at random, and known motions."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hardwall.sim.estimates import accuracy, motions, playback, signals


@dataclass(frozen=True)
class Edge:
    """An edge: when it was decoded (clocks, unwrapped), its position (counts, unwrapped), its kind and direction."""

    at: int
    number: int
    kind: int
    down: int


@dataclass(frozen=True)
class Strobe:
    """A sample: its clock, whether it restarts the estimator, and the number of edges before it."""

    at: int
    restart: int
    edges: int


def turn(
    design, random: np.random.Generator, samples: int, invert: bool = False, most: int | None = None
) -> tuple[list[Strobe], list[Edge]]:
    """Return strobes and edges: steady and accelerated motions of all speeds, turns within a count, stops, pauses.

    A sample lasts any time that the design allows, and has fewer edges than `most`, half the counter's range or one
    edge a clock, whichever is least.
    """
    modulus, clocks = 1 << design.stamp_width, design.clocks
    most = min(clocks, (1 << (design.count_width - 1)) - 2, most or clocks)
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
    """Return how many of the last edges have the same direction, at most 4."""
    run = 0
    for edge in reversed(edges[-4:]):
        if edge.down != edges[-1].down:
            break
        run += 1
    return run


def rows(design, strobes: list[Strobe], edges: list[Edge]):
    """Yield the estimator's inputs at every strobe, in the order of its ports."""
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


def anything(design, random: np.random.Generator, samples: int):
    """Yield rows that no encoder gives: every input anywhere in its range, often at the ends of the range."""
    half, stamps = 1 << (design.count_width - 1), 1 << design.stamp_width
    count = stamp = 0
    for _ in range(samples):
        count += int(random.integers(-half, half) if random.random() < 0.1 else random.integers(-9, 10))
        stamp += int(random.integers(1, stamps))
        ages = [int(random.integers(0, 1 << int(random.integers(1, design.stamp_width + 1)))) for _ in range(4)]
        ages = [
            age if random.random() < 0.9 else int(random.choice([0, 1, stamps // 4 * 3, stamps - 1])) for age in ages
        ]
        kinds = [int(random.integers(0, m)) for m in (4, 2, 5)]
        yield (
            (count + half) % (2 * half) - half,
            stamp % stamps,
            *((stamp - age) % stamps for age in ages),
            *kinds,
            int(random.random() < 0.01),
        )


@dataclass(frozen=True)
class Sight:
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
        last = edges[strobe.edges - 1] if strobe.edges else Edge(0, 0, 0, 0)
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
        if edge.kind == last.kind:
            return (abs(last.number - edge.number), last.at - edge.at) if before.at - edge.at < limit else None
    return None


def velocities(signal, axis, backend, encoder=(0.0, 0.0, 0.0, 0.0)):
    """Return the velocity at every sample, m/s, and the flags."""
    chunks = list(playback.velocities(signal, axis, "u", backend, encoder))
    return np.concatenate([chunk for _, chunk, _ in chunks]), chunks[-1][2]


def exact(signal, axis, samples):
    """Return the exact velocity at every sample, m/s."""
    return np.array([motions.velocity(signal.motion, k / axis.sample_hz) for k in range(samples)])


def check_rounding_is_the_only_difference(name: str, rate: int) -> None:
    """Check that `fixed` is within half an LSB of `float`, and within 1 % of the estimator's own error in RMS."""
    signal = replace(signals.paper(), seconds=0.3)
    axis = accuracy.axis_spec(name, rate, signal.acceleration_max_m_per_s2)
    fixed, flags = velocities(signal, axis, "fixed")
    real, _ = velocities(signal, axis, "float")
    assert flags == 0
    half_lsb = axis.design.estimator.velocity.lsb / 2 * axis.velocity_unit_m_per_s
    assert np.abs(fixed - real).max() <= half_lsb * (1 + 1e-9)
    first = rate // 100  # the signal starts at full speed, so the error is the whole speed until the first edges
    own = real[first::7] - exact(signal, axis, len(real))[first::7]
    assert np.sqrt(np.mean((fixed - real) ** 2)) <= 0.01 * np.sqrt(np.mean(own**2))
