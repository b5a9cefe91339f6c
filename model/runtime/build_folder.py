"""The folder of what the program makes for itself: compiled kernels, built hardware, stored results.

All of it can be made again. Its content is checked before use. A run does without files that cannot be written there.
"""

import atexit
import functools
import logging
import multiprocessing
import os
import shutil
import tempfile
from pathlib import Path

LOGGER = logging.getLogger("hardwall")
CACHES = "wasmtime", "YoWASP"
"""The folders in a user's cache of Amaranth's Yosys, and of Yosys and the placers for bitstreams."""
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
            raise BuildFolderError(
                f"HARDWALL_BUILD must not begin with the home of an unknown user: {chosen!r}"
            ) from None
    root = Path(__file__).absolute().parents[2]
    if (root / "pyproject.toml").exists():
        return root / "build"
    cache = _cache_of_the_user()
    return cache / "hardwall" if cache else _for_this_process()


def _home() -> Path | None:
    """Return the user's home; None if the variable is empty or relative, or the system does not know the user."""
    # Python takes an empty HOME for the root folder, and a relative one as it is.
    home = os.environ.get("HOME", os.path.expanduser("~"))
    return Path(home) if os.path.isabs(home) else None


def _cache_of_the_user() -> Path | None:
    """Return the folder for what programs can make again: `$XDG_CACHE_HOME` if it is absolute, else below the home.

    A relative path has no effect: so says the XDG Base Directory Specification, version 0.8, chapter 3.
    """
    if os.path.isabs(cache := os.environ.get("XDG_CACHE_HOME", "")):
        return Path(cache)
    home = _home()
    return home / ".cache" if home else None


def _for_this_process() -> Path:
    """Return a new folder that is removed at the end; workers find it in the variable."""
    folder = _temporary()
    os.environ["HARDWALL_BUILD"] = str(folder)
    warn_once("no home", "there is no home folder: what this run makes is not kept; HARDWALL_BUILD names a folder")
    return folder


@functools.cache
def _temporary() -> Path:
    """Return a folder that is removed at the end of the process."""
    folder = tempfile.mkdtemp(prefix="hardwall-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def folder_of_tools() -> Path:
    """Return the folder in which tools may write: the build folder, or else one that is removed at the end."""
    return build_dir() if _takes_files(build_dir()) else _temporary()


def home_for_tools() -> dict[str, str]:
    """Return the environment variables for a tool's cache folder: below the user's home if that can be written.

    Yosys, the placers and ccache do not start without such a home, or with a relative path. The home itself is not
    made: a folder that is not there may be meant to stay so.
    """
    home, cache = _home(), _cache_of_the_user()
    if home and cache and (home.is_dir() or home not in cache.parents) and _takes_all(cache):
        return {"XDG_CACHE_HOME": str(cache)}
    home = folder_of_tools()
    return {"HOME": str(home), "XDG_CACHE_HOME": str(home / ".cache")}


def _takes_all(cache: Path) -> bool:
    """Return whether a tool can write to a user's cache, and to its own folder there: another user may have made it."""
    return _takes_files(cache) and all(_takes_files(each) for name in CACHES if (each := cache / name).exists())


def _takes_files(folder: Path) -> bool:
    """Return whether files can be written to a folder, which is made if it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


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
