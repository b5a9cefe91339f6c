"""Random values one at a time: of single values, the standard library's generator makes ten in the time of NumPy's."""

from random import Random

from hardwall.testing import SEED


def seeded() -> Random:
    """Return a generator seeded from `HARDWALL_SEED`."""
    return Random(SEED)
