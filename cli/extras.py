"""The extras of this project, by the modules that they install."""

import importlib.metadata
import re


def extra_of(module: str | None) -> str | None:
    """Return the extra of this project that installs a module; None if no extra does."""
    name = (module or "").partition(".")[0].replace("_", "-").lower()
    for requirement in importlib.metadata.requires("hardwall") or []:
        match = re.fullmatch(r"([\w-]+)==.*extra == ['\"](\w+)['\"]", requirement)
        if match and match[1].replace("_", "-").lower() == name:
            return match[2]
    return None
