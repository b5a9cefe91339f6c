"""Captures that a host reads: records with any values, and the registers that hold them."""

import numpy as np

from hardwall.model.axis.registers import RegisterMap


def records(registers: RegisterMap, decimation: int) -> dict[str, np.ndarray]:
    """Return the words of a capture, its values from end to end of their formats."""
    count = registers.capture.records
    rng = np.random.default_rng(1)
    words = {
        name: rng.integers(form.min, form.max, count, endpoint=True)
        for name, form in (
            ("count", registers.capture.count),
            ("velocity", registers.capture.velocity),
            ("driven", registers.capture.force),
        )
    }
    for name, form in (("count", registers.capture.count), ("velocity", registers.capture.velocity)):
        words[name][:2] = form.min, form.max
    words["flags"] = rng.integers(0, 1 << len(registers.capture.flags), count)
    words["stamp"] = 65_000 + np.arange(count) * decimation * registers.spec.clocks_per_sample & 0xFFFF
    return words


def window(words: dict[str, np.ndarray]) -> list[int]:
    """Return the registers of the window to a capture."""
    cells = [words[name] >> shift & 0xFFFF for name in ("count", "velocity", "driven") for shift in (16, 0)]
    return np.stack([*cells, words["flags"], words["stamp"]], axis=1).ravel().tolist()
