"""How much the regressions do: `make test` the short forms, and `make soak`, by `HARDWALL_LOOPS=all`, the long ones.

`make synth` does the long forms of what it tests, too: place and route is not installed everywhere.
"""

import os
from collections.abc import Iterable
from typing import TypeVar

import pytest

from hardwall.testing import SAMPLES

Size = TypeVar("Size")
LONG = os.environ.get("HARDWALL_LOOPS") == "all"
"""Whether the long forms are asked for."""
long_form = pytest.mark.skipif(
    not LONG, reason="it takes minutes: make soak, make synth where it is of place and route, or HARDWALL_LOOPS=all"
)
"""Marks a test that only the long forms have."""
REACHING = 100_000
"""The samples from which a campaign that takes a part of `SAMPLES` reaches every flag: it does not take less."""
EVERY_SIZE = "HARDWALL_EVERY_SIZE"
"""The variable that asks for every size of a block, however short the campaigns are."""
WHOLE = LONG or SAMPLES >= REACHING or bool(os.environ.get(EVERY_SIZE))
"""Whether campaigns are whole: those of the mutants and of the coverage are, and those of `make test` are not."""


def some_of(sizes: Iterable[Size], *places: int) -> list[Size]:
    """Return the sizes of a block that its tests simulate: every one if campaigns are whole, else those at `places`."""
    every = list(sizes)
    return every if WHOLE else [every[place] for place in places]
