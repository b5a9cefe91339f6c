"""The verdict: the hardware's outputs against the model's, word for word."""

import os
from pathlib import Path

import numpy as np

from .packing import Rows


class Wrong(AssertionError):
    """Hardware that is wrong at a sample; the sample's number is kept, so that a second run can trace that sample."""

    def __init__(self, sample: int, message: str):
        super().__init__(message)
        if left := os.environ.get("HARDWALL_WRONG_SAMPLE"):
            Path(left).write_text(str(sample), encoding="ascii")


def check(inputs: Rows, outputs: Rows, expected: dict[str, np.ndarray], latency: int | None = None) -> None:
    """Compare every recorded output with the model's, exactly; fail on a lost or an extra output, or on none at all.

    Args:
        inputs: the inputs that the hardware took.
        outputs: the outputs that it gave.
        expected: the model's outputs for `inputs`, by the names of `outputs`.
        latency: the number of clocks after its input at which every output must come; default: not checked.

    Raises:
        AssertionError: if an output differs, is missing, is extra, or comes at another clock.
    """
    assert len(outputs.clocks) > 0, "nothing was compared"
    assert len(inputs.clocks) == len(outputs.clocks), f"{len(inputs.clocks)} inputs but {len(outputs.clocks)} outputs"
    assert set(expected) == set(outputs.names), "the model and the monitor name different outputs"
    for name, values in expected.items():
        seen, model = outputs.column(name), np.asarray(values)
        wrong = np.flatnonzero(seen != model)
        if len(wrong):
            first = int(wrong[0])
            raise Wrong(
                first,
                f"{name} differs at {len(wrong)} of {len(seen)} samples, first at {first}: RTL {seen[first]}, "
                f"model {model[first]}, inputs {dict(zip(inputs.names, inputs.rows[first], strict=True))}",
            )
    if latency is not None:
        taken = np.array(outputs.clocks) - np.array(inputs.clocks)
        wrong = np.flatnonzero(taken != latency)
        if len(wrong):
            raise Wrong(int(wrong[0]), f"latency {sorted(set(taken.tolist()))} clocks, promised {latency}")
