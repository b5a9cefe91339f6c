"""Commands as they run in a folder outside the checkout."""

import os
import subprocess
from pathlib import Path


def run(folder: Path, command: list[str], **environ: str) -> subprocess.CompletedProcess:
    """Run a command in a folder, without the environment of the checkout's own tests."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("HARDWALL_", "PY", "COCOTB"))}
    return subprocess.run(command, cwd=folder, env=kept | environ, capture_output=True, text=True, check=False)
