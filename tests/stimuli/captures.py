"""Captures that a host reads: records with any values, and the registers that hold them."""

import numpy as np

from hardwall.model.axis.registers import RegisterMap

VALUES = 3
"""The values of a record: count, velocity or acceleration, and drive."""


def records(registers: RegisterMap, decimation: int, motion: str = "velocity") -> dict[str, np.ndarray]:
    """Return the words of a capture, its values from end to end of their formats; `motion` is the second value."""
    count = registers.capture.records
    rng = np.random.default_rng(1)
    words = {
        name: rng.integers(form.min, form.max, count, endpoint=True)
        for name, form in (
            ("count", registers.capture.count),
            (motion, getattr(registers.capture, motion)),
            ("driven", registers.capture.force),
        )
    }
    for name, form in (("count", registers.capture.count), (motion, getattr(registers.capture, motion))):
        words[name][:2] = form.min, form.max
    words["flags"] = rng.integers(0, 1 << len(registers.capture.flags), count)
    words["stamp"] = 65_000 + np.arange(count) * decimation * registers.spec.clocks_per_sample & 0xFFFF
    return words


def window(words: dict[str, np.ndarray]) -> list[int]:
    """Return the registers of the window to a capture."""
    cells = [words[name] >> shift & 0xFFFF for name in list(words)[:VALUES] for shift in (16, 0)]
    return np.stack([*cells, words["flags"], words["stamp"]], axis=1).ravel().tolist()
