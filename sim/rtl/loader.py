"""Bitstreams are put into a board by openFPGALoader, over the board's own USB bridge."""

import tempfile
from pathlib import Path

from ..boards.description import Description, Memory
from . import tools

LOADER = "openfpgaloader-cli"
OPTION: dict[Memory, str] = {"sram": "--write-sram", "flash": "--write-flash"}


def load(board: Description, bitstream: Path, memory: Memory) -> None:
    """Put a bitstream into a board: into the part, until the supply goes, or into the flash that it is loaded from.

    Raises:
        SynthesisError: if there is no loader, or it fails, as it does without a board.
    """
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        command = (LOADER, "--board", board.loader, OPTION[memory], str(bitstream.absolute()))
        tools.run(work, work / "loader.log", command, f"loading {board.name}")
