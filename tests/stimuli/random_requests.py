"""Random requests to the server, most of them right."""

import numpy as np

from hardwall.model.axis.register_file import Design
from hardwall.model.axis.registers import MAP, RegisterMap

from . import frames


def a_write(random: np.random.Generator, registers: RegisterMap) -> tuple[int, list[int]]:
    """Return the first address and the values of a write that is mostly right."""
    words, values = (*registers.words, *registers.live), []
    first = int(random.integers(0, len(words)))
    for word in words[first : first + int(random.integers(1, 6))]:
        value = int(random.integers(word.low, word.high + 1))
        edge = random.random()
        if edge < 0.3:
            value = int(random.choice((word.low, word.high, 0)))
        elif edge < 0.36:
            beyond = word.low - 1, word.high + 1, word.high + (1 << 16), -(1 << 31), (1 << 31) - 1
            value = int(random.choice(beyond))
        values += [value >> 16 & 0xFFFF, value & 0xFFFF]
    address = words[first].address
    if first == 0 and random.random() < 0.7:
        # Pulses before the words, in the same frame.
        pulses = random.integers(0, 2, random.integers(1, len(registers.pulses) + 1)).tolist()
        address, values = address - len(pulses), [*pulses, *values]
    if random.random() < 0.05:
        address += int(random.integers(-3, 4))
    if random.random() < 0.05:
        values.pop()
    return address, values or [0]


def a_read(random: np.random.Generator, map_end: int) -> tuple[int, int]:
    """Return the first address and the number of registers of a read that is mostly right.

    Args:
        random: draws them.
        map_end: the address behind the window to the map.
    """
    address, count = int(random.choice((0, 0x20, 0x60, 0x80, 0xC0))), int(random.integers(1, 60)) * 2
    case = random.random()
    if case < 0.2:
        address, count = int(random.integers(MAP, map_end + 2)), int(random.integers(1, 20))
    elif case < 0.3:
        address, count = 0x8000 + int(random.integers(0, 310)), int(random.integers(1, 20))
    elif case < 0.4:
        address, count = int(random.integers(0, 1 << 16)), int(random.integers(0, 130))
    elif case < 0.45:
        count = int(random.choice((0, 125, 126, 65535)))
    return address, count


def random_request(random: np.random.Generator, design: Design) -> bytes:
    """Return a function and its data."""
    address, values = a_write(random, design.registers)
    source, count = a_read(random, MAP + len(design.map_cells))
    mangled = bytearray(frames.write(address, values))
    mangled[int(random.integers(3, 6))] ^= 1 << random.integers(0, 8)
    cases = [
        frames.read(source, count),
        frames.read(source, count, 4),
        frames.write(address, values),
        frames.write(address, values),
        frames.write_one(int(random.integers(0x70, 0x82)), int(random.choice((0, 1, 1, 1, 2)))),
        frames.write_and_read(address, values, source, count),
        bytes([8]) + frames.words(random.integers(0, 21), random.choice((0, 0, 0, 5))),
        bytes([43, random.choice((14, 14, 14, 13)), random.integers(0, 6), random.integers(0, 5)]),
        bytes(mangled),
    ]
    return cases[random.integers(0, len(cases))]
