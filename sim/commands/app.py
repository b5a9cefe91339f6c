"""The command line. Results go to stdout, everything else to stderr.

The exit codes are 0, 1 for a failed run, and 2 for bad input. This module imports nothing that comes with an extra, so
that it can name an extra that is not installed.
"""

import importlib.metadata
import os
import re
import signal
import sys
from importlib import import_module

from ..scene.errors import SceneError
from .errors import BadInput, one_line


def main() -> None:
    """Run the command line; report every failure as one line on stderr and an exit code."""
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
        print(f"hardwall: error: {one_line(message)}", file=sys.stderr)
    sys.exit(code)


def _interrupted(*_: object) -> None:
    """Stop at once: a KeyboardInterrupt raised in compiled code, or in its compiler, crashes the process."""
    # A progress bar may have hidden the cursor.
    shown = "\x1b[?25h" if sys.stderr.isatty() else ""
    print(f"{shown}hardwall: error: interrupted", file=sys.stderr, flush=True)
    os._exit(1)


def _extra_of(module: str | None) -> str | None:
    """Return the extra of this project that installs a module; None if no extra does."""
    name = (module or "").partition(".")[0].replace("_", "-").lower()
    for requirement in importlib.metadata.requires("hardwall") or []:
        match = re.fullmatch(r"([\w-]+)==.*extra == ['\"](\w+)['\"]", requirement)
        if match and match[1].replace("_", "-").lower() == name:
            return match[2]
    return None
