"""The command line. Results go to stdout, everything else to stderr.

The exit codes are 0, 1 for a failed run, 2 for bad input, and 141 if stdout was closed early; 129 after SIGHUP, 130
after SIGINT, 143 after SIGTERM. This module imports nothing from an extra, so it can name a missing extra. It imports
nothing slow, because an interrupt gives a Python traceback until `main` handles signals.
"""

import gc
import sys

from ..model.runtime import termination
from ..model.runtime.build_folder import BuildFolderError
from ..model.runtime.input_error import InputError
from . import streams
from .errors import BadInput, one_line

COLLECTED = 100_000, 100, 100
"""How seldom Python looks for garbage. Imports and the compiler make objects that stay. By Python's default thresholds,
going through them again and again takes an eighth of the time in which a loop is compiled."""


def main() -> None:
    """Run the command line; report every failure as one line on stderr and an exit code."""
    termination.hear_signals()
    gc.set_threshold(*COLLECTED)
    termination.begin()
    streams.prepare()
    code, message = _run()
    try:
        sys.stdout.flush()
    except streams.StdoutError as error:
        if not message:
            code, message = error.code, str(error)
    if message:
        print(f"hardwall: error: {one_line(message)}", file=sys.stderr)
    if code:
        sys.exit(code)


def _run() -> tuple[int, str]:
    """Run the command that is called; return the exit code and the message of its failure."""
    try:
        from . import group  # noqa: PLC0415  (what reads the options comes with an extra)

        group.run()
    except (BadInput, ValueError) as error:
        # A scene may be valid and its axis have no board, which is an error of the model; its import is slow.
        of_board = hasattr(error, "field")
        if not of_board and not isinstance(error, BadInput | InputError | BuildFolderError):
            raise
        return 2, f"the scene's {error}" if of_board else str(error)
    except ImportError as error:
        from ..model.runtime import extras  # noqa: PLC0415  (the list of what is installed is slow to import)

        message = extras.lacking(error)
        if message is None:
            raise
        return 1, message
    except streams.StdoutError as error:
        return error.code, str(error)
    except (RuntimeError, OSError, MemoryError) as error:
        what = "this run needs more memory than there is" if isinstance(error, MemoryError) else error
        return 1, f"{what}{termination.remark()}"
    except SystemExit as exit_:
        return exit_.code or 0, ""
    return 0, ""
