"""Bitstreams are put into a board by openFPGALoader, over the board's own USB bridge."""

import hashlib
import tempfile
from pathlib import Path

from ...model.runtime.termination import undone
from ..boards.description import Description, Memory
from . import tools
from .tools import SynthesisError

LOADER = "openfpgaloader-cli"
OPTION: dict[Memory, str] = {"sram": "--write-sram", "flash": "--write-flash"}


def load(board: Description, bitstream: Path, memory: Memory, sha256: str) -> None:
    """Put a bitstream into a board: into the part, until the supply goes, or into the flash that it is loaded from.

    The loader gets a copy with a checked digest. So the board gets exactly the built bitstream, whoever else writes to
    the file.

    Raises:
        SynthesisError: if the bitstream has another digest than `sha256`, there is no loader, or it fails, as it does
            without a board.
    """
    folder = tempfile.TemporaryDirectory(prefix="hardwall-")
    with undone(folder.cleanup):
        work = Path(folder.name)
        copy = work / bitstream.name
        copy.write_bytes(_content(board, bitstream, sha256))
        command = (LOADER, "--board", board.loader, OPTION[memory], str(copy))
        tools.run(work, work / "loader.log", command, f"loading {board.name}")


def _content(board: Description, bitstream: Path, sha256: str) -> bytes:
    """Return the content of a bitstream; raise SynthesisError if it is not what was built."""
    try:
        content = bitstream.read_bytes()
    except OSError as error:
        raise SynthesisError(f"loading {board.name} failed: {bitstream} cannot be read: {error.strerror}") from None
    if hashlib.sha256(content).hexdigest() != sha256:
        raise SynthesisError(
            f"loading {board.name} failed: {bitstream} has changed since it was built: build it again, into a folder "
            "that nothing else writes to"
        )
    return content
