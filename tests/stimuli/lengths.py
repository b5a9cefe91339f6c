"""How much the regressions do: `make test` the short forms, and `make soak`, by `HARDWALL_LOOPS=all`, the long ones."""

import os

import pytest

LONG = os.environ.get("HARDWALL_LOOPS") == "all"
"""Whether the long forms are asked for."""
long_form = pytest.mark.skipif(not LONG, reason="it takes minutes: make soak, or HARDWALL_LOOPS=all")
"""Marks a test that only the long forms have."""
REACHING = 100_000
"""The samples from which a campaign that takes a part of `SAMPLES` reaches every flag: it does not take less."""
