"""Helpers that the tests of estimators with an acceleration share."""

from hardwall.testing.accelerations import OUTPUTS, model


def equals(oracle, d, rows, start) -> None:
    """Hold the model to an oracle, which yields velocity, acceleration and flags; counts of the rows wrap."""
    half = 1 << (d.count_width - 1)
    rows = [((count + half) % (2 * half) - half, *rest) for count, *rest in rows]
    seen = model(d, rows, start)
    for k, given in enumerate(oracle(d, rows)):
        assert given == tuple(seen[name][k] for name in OUTPUTS), f"sample {k}: {rows[k]}"
