"""Written reasons why something of a block is not as a goal wants it: points not reached, mutants not killed."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Reason:
    """Why something of a block need not be as the goal wants it.

    Attributes:
        block: the block.
        name: the name of what is explained, or of several with `*`.
        reason: one sentence or more.
    """

    block: str
    name: str
    reason: str

    def is_of(self, name: str) -> bool:
        """Return whether it explains what has a name."""
        return re.fullmatch(".*".join(map(re.escape, self.name.split("*"))), name) is not None


def reasons_for(block: str, file: Path) -> list[Reason]:
    """Return the reasons that a file has for a block."""
    listed = tomllib.loads(file.read_text(encoding="utf-8")).get("reason", [])
    return [reason for each in listed if (reason := Reason(**each)).block == block]
