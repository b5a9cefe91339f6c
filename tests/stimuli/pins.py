"""Stimuli of the decoder: arrays over clocks, one for every input and one for the reset."""

import numpy as np

from hardwall.model.encoder.quadrature import Inputs, Strobes

INPUTS = (*Inputs._fields, *Strobes._fields)
STROBES = {"preload": 0.004, "origin_shift": 0.02, "arm": 0.02, "clear": 0.02, "slip": 0.002}
"""The strobes, and the chance of each at a clock."""


def stimulus(clocks: int, **columns) -> dict[str, np.ndarray]:
    """Return `columns` (scalars or arrays) as arrays, zeros for the other inputs, with a reset in the first clock."""
    full = {n: np.broadcast_to(columns.get(n, 0), clocks).astype(np.int64) for n in ("reset", *INPUTS)}
    full["reset"][0] = 1
    return full


def joined(*parts: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: np.concatenate([part[name] for part in parts]) for name in ("reset", *INPUTS)}


def pins(position) -> dict[str, np.ndarray]:
    """Return the pins at a position in counts, with an index one count long every 16."""
    position = np.asarray(position)
    return {"a": (position + 3) % 4 < 2, "b": (position + 2) % 4 < 2, "z": position % 16 == 5}


def at(clocks: int, *when: int) -> np.ndarray:
    """Return a strobe at the given clocks."""
    return np.isin(np.arange(clocks), when)


def pulses(channel: str, glitch_clocks: int) -> dict[str, np.ndarray]:
    """Return pulses of every width from 1 to glitch_clocks + 2 on one channel, the others low.

    The handle moves up by a count before a pulse on Z, by another one a clock after it begins, and back behind it.
    """
    hold = glitch_clocks + 4
    apart, begins = (4 * hold + 3, hold + 1) if channel == "z" else (2 * hold + 1, 0)
    clock = np.arange(apart * (glitch_clocks + 3))
    up, down = (
        ((clock % apart)[:, None] >= edges).sum(axis=1) for edges in ((1, hold + 2), (2 * hold + 2, 3 * hold + 2))
    )
    levels = pins(up - down) if channel == "z" else {}
    levels[channel] = (begins <= clock % apart) & (clock % apart < begins + clock // apart)
    return stimulus(len(clock), glitch_clocks=glitch_clocks, arm=clock % apart == apart - 1, **levels)


def turning(way: int) -> dict[str, np.ndarray]:
    """Return a motion of 40 counts with 5 clocks a count, from 3 counts before the narrow counter wraps."""
    return stimulus(200, preload=at(200, 1), preload_count=4 * way, **pins(way * (np.arange(200) // 5)))


def jumping(state: int) -> dict[str, np.ndarray]:
    """Return both pins changing together, there and back, every 5 clocks from clock 10 on."""
    clock = np.arange(40)
    return stimulus(40, **pins(state + 2 * (np.maximum(clock // 5 - 1, 0) % 2)))


def faulty(state: int) -> dict[str, np.ndarray]:
    """Return both pins changing together at 300 clocks in a row, from clock 10 on: more than 8 bits count."""
    clock = np.arange(320)
    return stimulus(320, **pins(state + 2 * (np.clip(clock - 9, 0, 300) % 2)), clear=at(320, 315))


def starting(levels: int, edge: int, glitch_clocks: int) -> dict[str, np.ndarray]:
    """Return pins at the given levels, and a change of A at the clock `edge` after the reset."""
    a = (np.arange(30) > edge) ^ (levels & 1)
    return stimulus(30, a=a, b=levels >> 1 & 1, z=levels >> 2, glitch_clocks=glitch_clocks)


def meeting(strobe: str, when: int) -> dict[str, np.ndarray]:
    """Return counts 1 to 6 at clocks 12 to 17, an index, a jump and an overspeed, with a strobe at clock `when`."""
    clock = np.arange(60)
    columns = {
        **pins(np.clip(clock - 11, 0, 6) + 2 * (clock >= 30)),
        "glitch_clocks": 2 * (clock >= 40),
        "preload_count": -5 if strobe == "origin_shift" else 5,
        "arm": at(60, 4),
    }
    columns["a"] = columns["a"] ^ at(60, 50, 51)
    columns["b"] = columns["b"] ^ (clock >= 51)
    columns[strobe] = columns.get(strobe, 0) | at(60, when)
    return stimulus(60, **columns)


def directed() -> dict[str, np.ndarray]:
    return joined(
        *(pulses(channel, glitch_clocks) for channel in "abz" for glitch_clocks in range(16)),
        *(turning(way) for way in (1, -1)),
        *(jumping(state) for state in range(4)),
        *(faulty(state) for state in range(4)),
        *(starting(levels, edge, length) for levels in range(8) for edge in range(6) for length in (0, 1, 15)),
        *(meeting(strobe, when) for strobe in (*STROBES, "reset") for when in range(1, 60)),
    )


def random_stimulus(generator: np.random.Generator, clocks: int, width: int) -> dict[str, np.ndarray]:
    """Return motion at 0 to nearly 4 edges a clock, reversing, with glitches, strobes and controls at random."""

    def held(values: np.ndarray, longest: int) -> np.ndarray:
        return np.repeat(values, generator.integers(1, longest, len(values)))[:clocks]

    rate = 10 ** generator.uniform(-2.5, 0.6, clocks) * generator.choice([-1, 0, 1], clocks)
    position = np.floor(np.cumsum(held(rate, 300)) + generator.uniform(0, 0.2, clocks)).astype(np.int64)
    # A half of the preloads is at an end of the range, beyond which the count wraps.
    half = 1 << (width - 1)
    anywhere, ends = generator.integers(-half, half, clocks), generator.choice([-half, half - 1], clocks)
    return stimulus(
        clocks,
        **{name: level ^ held(generator.random(clocks) < 0.02, 6) for name, level in pins(position).items()},
        **{name: generator.random(clocks) < chance for name, chance in STROBES.items()},
        reset=generator.random(clocks) < 1 / 2000,
        glitch_clocks=held((16 ** generator.random(clocks)).astype(np.int64) - 1, 200),
        invert=held(generator.integers(0, 2, clocks), 200),
        preload_count=np.where(generator.random(clocks) < 0.5, ends, anywhere),
    )
