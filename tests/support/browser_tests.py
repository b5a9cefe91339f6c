"""What tests of the page in a real browser need: a browser, and a machine for themselves."""

import os
from types import ModuleType

import pytest


def browsers_or_skip() -> ModuleType:
    """Return the module `support.browsers`; skip the test file where there is no browser, or none is asked for."""
    if "HARDWALL_BROWSER" not in os.environ:
        pytest.skip(
            "a browser and a board in simulation want the machine for themselves: make browser", allow_module_level=True
        )
    browsers = pytest.importorskip("support.browsers", reason="playwright is not installed")
    if not browsers.CHROMIUM.exists():
        pytest.skip(browsers.ABSENT, allow_module_level=True)
    return browsers
