"""Frames of Modbus RTU for tests, built by hand from the specification."""

from collections.abc import Iterator

import numpy as np

from hardwall.model.link.line import framed

NOT_TOGETHER = (("arm", "commit"), ("arm", "preload"), ("arm", "origin_shift"), ("preload", "origin_shift"))
"""Pairs of pulses that no frame may have."""


def words(*values: int) -> bytes:
    """Return 16-bit values, big-endian."""
    return b"".join((int(value) & 0xFFFF).to_bytes(2, "big") for value in values)


def read(address: int, count: int, function: int = 3) -> bytes:
    """Return a request to read registers."""
    return bytes([function]) + words(address, count)


def write(address: int, values: list[int]) -> bytes:
    """Return a request to write registers with function 16."""
    return bytes([16]) + words(address, len(values)) + bytes([2 * len(values)]) + words(*values)


def write_one(address: int, value: int) -> bytes:
    """Return a request to write a register with function 6."""
    return bytes([6]) + words(address, value)


def write_and_read(address: int, values: list[int], read_address: int, count: int) -> bytes:
    """Return a request to write and then read registers."""
    head = bytes([23]) + words(read_address, count, address, len(values))
    return head + bytes([2 * len(values)]) + words(*values)


def requests(random: np.random.Generator, count: int, unit: int | None = None, known: bool = False) -> Iterator[bytes]:
    """Yield whole frames to random units, or to one; with functions of any number unless `known`."""
    for _ in range(count):
        address, value = (int(each) for each in random.integers(0, 1 << 16, 2))
        values = random.integers(0, 1 << 16, random.integers(1, 20)).tolist()
        cases = [
            read(address, value),
            read(address, value, 4),
            write_one(address, value),
            bytes([8]) + words(address, value),
            write(address, values),
            write_and_read(address, values, value, 9),
            bytes([43, 14, address % 256, value % 256]),
        ]
        if not known:
            cases.append(bytes([100 + address % 20]) + random.bytes(random.integers(0, 9)))
        to = int(random.choice((0, 1, 1, 1, 2, 255))) if unit is None else unit
        yield framed(bytes([to]) + cases[random.integers(0, len(cases))])


def flips(frame: bytes) -> Iterator[bytes]:
    """Yield a frame with every single bit flipped in turn."""
    for bit in range(8 * len(frame)):
        flipped = bytearray(frame)
        flipped[bit // 8] ^= 1 << bit % 8
        yield bytes(flipped)
