"""The folder of what the program makes for itself: compiled kernels, built hardware, stored results.

All of it can be made again. What is found there is checked before it is used, and a run does without what cannot be
written there.
"""

import atexit
import logging
import multiprocessing
import os
import shutil
import tempfile
from pathlib import Path

LOGGER = logging.getLogger("hardwall")
SHOWN_MAX = 200
"""The most characters of a path in a message."""
_said: set[str] = set()


class BuildFolderError(ValueError):
    """The build folder that is chosen cannot be one."""


def build_dir() -> Path:
    """Return where generated files go: `$HARDWALL_BUILD`, else `build/` of the source tree, else a folder of the user.

    The user's folder serves an installed copy, whose own folder may not be writable. A user without a home has a
    temporary folder for as long as the process runs.

    Raises:
        BuildFolderError: if `$HARDWALL_BUILD` begins with the home of a user who has none.
    """
    if chosen := os.environ.get("HARDWALL_BUILD"):
        try:
            return Path(chosen).expanduser().absolute()
        except RuntimeError:
            raise BuildFolderError(f"HARDWALL_BUILD must not begin with a home that nobody has: {chosen!r}") from None
    root = Path(__file__).absolute().parents[2]
    if (root / "pyproject.toml").exists():
        return root / "build"
    if cache := os.environ.get("XDG_CACHE_HOME"):
        return Path(cache) / "hardwall"
    try:
        return Path.home() / ".cache" / "hardwall"
    except RuntimeError:
        return _for_this_process()


def _for_this_process() -> Path:
    """Return a new folder that is removed at the end; workers find it in the variable."""
    folder = tempfile.mkdtemp(prefix="hardwall-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["HARDWALL_BUILD"] = folder
    warn_once("no home", "there is no home folder: what this run makes is not kept; HARDWALL_BUILD names a folder")
    return Path(folder)


def home_for_tools() -> dict[str, str]:
    """Return the variable that makes the build folder the home of a tool, where the user has none; else nothing.

    Yosys, the placers and ccache keep what they compile below the home, and do not start without one.
    """
    return {} if os.path.expanduser("~") != "~" else {"HOME": str(build_dir())}


def warn_once(kind: str, message: str) -> None:
    """Log a warning, unless this process has logged one of its kind; a worker leaves that to the process it works for.

    Where the project's logger has no handler, Python itself prints warnings on stderr.
    """
    if kind not in _said and multiprocessing.parent_process() is None:
        _said.add(kind)
        LOGGER.warning(message)


def not_kept(path: Path, error: OSError) -> None:
    """Warn that a file or folder cannot be written; the run goes on, and the next one makes its content again."""
    reason = error.strerror or error
    warn_once("not kept", f"{shown_path(path)} cannot be written ({reason}): what this run makes is not kept")


def shown_path(path: Path) -> str:
    """Return a path for a message: printable, on one line, and the middle of a very long one left out."""
    text = str(path) if str(path).isprintable() else repr(str(path))
    half = SHOWN_MAX // 2
    return text if len(text) <= SHOWN_MAX else f"{text[:half]}...{text[-half:]}"
