"""The command line. Results go to stdout, everything else to stderr; exit codes: 0, 1 failed run, 2 bad input.

Nothing is imported here that comes with an extra: one that is not installed is named.
"""

import importlib.metadata
import os
import re
import signal
import sys
from importlib import import_module

from ..scene.errors import SceneError
from .errors import BadInput


def main() -> None:
    """Run the command line; every failure is one line on stderr and an exit code."""
    signal.signal(signal.SIGINT, _interrupted)
    try:
        import_module(".group", __package__).run()
    except (BadInput, SceneError) as error:
        code, message = 2, str(error)
    except ModuleNotFoundError as error:
        extra = _extra_of(error.name)
        if extra is None:
            raise
        code, message = 1, f"{error.name} is not installed: it comes with pip install 'hardwall[{extra}]'"
    except (RuntimeError, OSError) as error:
        code, message = 1, str(error)
    else:
        return
    if message:
        print(f"hardwall: error: {message}", file=sys.stderr)
    sys.exit(code)


def _interrupted(*_: object) -> None:
    """Stop at once: raising KeyboardInterrupt into compiled code, or into its compiler, crashes the process."""
    # A bar may have hidden the cursor.
    shown = "\x1b[?25h" if sys.stderr.isatty() else ""
    print(f"{shown}hardwall: error: interrupted", file=sys.stderr, flush=True)
    os._exit(1)


def _extra_of(module: str | None) -> str | None:
    """Return the extra of this project that a module comes with; None for what comes with none."""
    name = (module or "").partition(".")[0].replace("_", "-").lower()
    for requirement in importlib.metadata.requires("hardwall") or []:
        found = re.fullmatch(r"([\w-]+)==.*extra == ['\"](\w+)['\"]", requirement)
        if found and found[1].replace("_", "-").lower() == name:
            return found[2]
    return None
